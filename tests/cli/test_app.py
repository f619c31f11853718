"""The command as a whole: speed, exit codes, what goes to stdout and what to stderr."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import typer
from commanding import BAD_SPEC, COMMANDS, REPLAY, ROOT, command, process
from fakes import PYTHON
from typer.main import get_command
from typer.testing import CliRunner, Result

from stemcal import __version__
from stemcal.cli.app import app
from stemcal.cli.exit_codes import exit_codes
from stemcal.cli.spec import _not_ready
from stemcal.errors import (
    FolderLocked,
    RunsFailed,
    SimulationFailed,
    SpecError,
    SpecProblem,
    StemcalError,
    TargetUnreachable,
    UsageError,
)
from stemcal.processes.interrupts import Terminated
from stemcal.study.reading import load_study

RUNNING = "sys.argv[0] = 'stemcal'; runpy.run_module('stemcal', run_name='__main__', alter_sys=True)"
HEAVY = ("numpy", "scipy", "pandas", "numba", "pydantic", "statsmodels", "matplotlib", "jinja2", "yaml")


def test_help_names_every_command_and_imports_nothing_heavy(tmp_path: Path) -> None:
    done = process(tmp_path, "--help", PYTHONPROFILEIMPORTTIME="1")
    assert done.returncode == 0 and all(f" {name} " in done.stdout for name in COMMANDS)
    imported = {line.rpartition("|")[2].strip().partition(".")[0] for line in done.stderr.splitlines()}
    assert "typer" in imported and not set(HEAVY) & imported


def test_showing_what_is_finished_loads_no_solver() -> None:
    shown = "stemcal.report.terminal, stemcal.stages.verdict.verdict_rules, stemcal.report.outcome"
    code = f"import sys, {shown}; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT, timeout=60
    )
    assert not {"numba", "scipy", "pandas"} & set(done.stdout.split())


def test_help_of_a_command_is_short_and_begins_with_its_purpose() -> None:
    """At most 40 lines at 100 columns; the purpose is one sentence of at most 72 characters; then there is an example.

    The library sets placeholders in brackets; ours within would be doubled.
    """
    todo: list[tuple[tuple[str, ...], Any]] = [((), get_command(app))]
    while todo:
        words, found = todo.pop()
        todo += [((*words, name), one) for name, one in getattr(found, "commands", {}).items()]
        shown = CliRunner().invoke(app, [*words, "--help"], env={"COLUMNS": "100", "TERMINAL_WIDTH": "100"}).stdout
        assert len(shown.splitlines()) <= 40, words
        purpose = found.help.strip().split("\n\n")[0]
        assert len(purpose) <= 72 and purpose.endswith(".") and "\n" not in purpose, words
        usage = next(line for line in shown.splitlines() if "Usage:" in line)
        assert " ".join(["stemcal", *words, "[OPTIONS]"]) in usage and "[[" not in usage
        assert not words or f"Example: {' '.join(['stemcal', *words])}" in shown, words


def test_version() -> None:
    assert command("--version").stdout == f"stemcal {__version__}\n"


def ending_with(error: BaseException) -> Result:
    """Run a command that ends with `error`."""
    app = typer.Typer()

    @app.command()
    def fails() -> None:
        with exit_codes():
            raise error

    return CliRunner().invoke(app, [])


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (StemcalError("named"), 1),
        (SimulationFailed("nan", "velocity is not a number at 0.1 s"), 1),
        (SpecError([SpecProblem("a.yaml", 3, 1, "x", "wrong", "mend it")]), 2),
        (UsageError("no sense"), 2),
        (RunsFailed("9 of 12 runs failed"), 3),
        (TargetUnreachable(500.0, 60.0, 180.0), 4),
        (FolderLocked("held by 42"), 5),
        (KeyboardInterrupt(), 130),
        (Terminated(), 143),
        (OSError(28, "No space left on device", "runs/a.json"), 1),
        (ZeroDivisionError("division by zero"), 1),
        (MemoryError(), 1),
    ],
)
def test_exit_code_of_each_error(error: BaseException, code: int) -> None:
    result = ending_with(error)
    assert result.exit_code == code
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    assert result.stderr.startswith("error: ")


def test_unforeseen_error_files_its_traceback(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    result = ending_with(ZeroDivisionError("division by zero"))
    (filed,) = tmp_path.glob("stemcal-traceback-*.txt")
    assert result.stderr == (f"error: internal error: ZeroDivisionError: division by zero (traceback in {filed})\n")
    assert "Traceback" in filed.read_text(encoding="utf-8")


def test_memory_that_has_run_out_is_no_internal_error() -> None:
    said = ending_with(MemoryError()).stderr
    assert "--workers" in said and "internal" not in said


def test_all_problems_of_a_spec_and_nothing_on_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("check", "run", "screen", "rsm", "invert", "validate", "report", "simulate"):
        done = command(name, BAD_SPEC)
        assert done.exit_code == 2
        assert done.stdout == ""
        assert "the spec has 5 problems" in done.stderr
        assert "many-at-once.yaml:21:9: blade.widht: unknown key 'widht'" in done.stderr  # codespell:ignore widht
    assert list(tmp_path.iterdir()) == []


def test_unknown_executors_leave_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, words in (
        ("dask://host", "write the address of your scheduler as `dask://HOST:PORT`"),
        ("slurm", "unknown"),
    ):
        done = command("run", REPLAY, "--executor", name)
        assert done.exit_code == 2 and words in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_typing_errors_are_usage_errors() -> None:
    assert command("scren", REPLAY).exit_code == 2  # codespell:ignore scren
    assert "screen" in command("scren", REPLAY).stderr  # codespell:ignore scren
    assert command("run", REPLAY, "--workers", 0).exit_code == 2
    assert command("run").exit_code == 2


def test_no_colour_in_pipes_and_with_no_color(tmp_path: Path) -> None:
    assert "31m" in process(tmp_path, "init", "con", FORCE_COLOR="1").stderr
    assert "31m" not in process(tmp_path, "init", "con", NO_COLOR="1", FORCE_COLOR="1").stderr
    assert "\x1b[" not in process(tmp_path, "init", "con").stderr


def test_output_that_the_terminal_cannot_encode(tmp_path: Path) -> None:
    done = process(tmp_path, "screen", REPLAY, PYTHONUTF8="0", PYTHONIOENCODING="ascii")
    assert done.returncode == 0
    assert "yield_stress" in done.stdout


SLOW = """
import signal, time
import typer
from stemcal.cli.exit_codes import exit_codes
from stemcal.cli.spec import _not_ready
from stemcal.study.reading import load_study
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs inherit that it is ignored
app = typer.Typer()
@app.command()
def wait():
    with exit_codes():
        print("ready", flush=True)
        time.sleep(30)
app()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_with_their_code_and_no_traceback(number: int, code: int) -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", SLOW],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "ready\n"
    begin = time.monotonic()
    child.send_signal(number)
    _, errors = child.communicate(timeout=20)
    assert child.returncode == code
    assert time.monotonic() - begin < 10
    assert "Traceback" not in errors
    assert "run the same command again to resume" in errors


def test_json_of_a_bad_spec() -> None:
    result = command("check", BAD_SPEC, "--json")
    found = json.loads(result.stdout)["result"]
    assert result.exit_code == 2
    assert json.loads(result.stdout)["status"] == "wrong" and found["ok"] is False
    assert [problem["line"] for problem in found["problems"]] == [6, 8, 12, 19, 21]


@pytest.mark.parametrize(("outputs", "counted"), [("200", ""), ("many", "the spec has 2 problems")])
def test_several_problems_are_counted(tmp_path: Path, outputs: str, counted: str) -> None:
    text = REPLAY.with_name("smoke.yaml").read_text(encoding="utf-8").replace("mass_scaling", "mas_scaling")
    (tmp_path / "spec.yaml").write_text(text.replace("outputs: 200", f"outputs: {outputs}"), encoding="utf-8")
    said = command("check", tmp_path / "spec.yaml")
    assert said.exit_code == 2 and "mas_scaling" in said.stderr
    assert ("the spec has" in said.stderr) == bool(counted) and counted in said.stderr


def test_a_program_that_can_start_is_no_warning(tmp_path: Path) -> None:
    case = shutil.copytree(ROOT / "tests" / "cases" / "repose", tmp_path / "case")
    text = (case / "angle.yaml").read_text(encoding="utf-8")
    for name, program in (("here", PYTHON), ("missing", "no-such-program")):
        (case / f"{name}.yaml").write_text(text.replace("[python,", f"[{program},"), encoding="utf-8")
    here, missing = (_not_ready(load_study(case / f"{name}.yaml")) for name in ("here", "missing"))
    assert here == [] and len(missing) == 1 and "no-such-program" in missing[0]
