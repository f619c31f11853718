"""The files that commands write, the messages on either stream, and the refusals: exact texts and exit codes."""

import json
import logging
import os
import sys
from contextlib import nullcontext
from dataclasses import replace
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
from commanding import REPLAY, ROOT, SMOKE, STAGES, command
from fakes import PYTHON
from rich.console import Console
from typer.testing import CliRunner

from stemcal.cli import console, doctor, exit_codes, export, export_program, session
from stemcal.cli import simulate as simulating
from stemcal.cli.console import envelope, say_json
from stemcal.cli.session import Session
from stemcal.cli.simulate import summary
from stemcal.cutting.end_state import Shape
from stemcal.errors import UsageError, Waiting
from stemcal.processes.interrupts import Terminated
from stemcal.report.records import Details, RunCurve
from stemcal.stages.element_size import SizedStrain


def told(*args: object) -> tuple[int, str]:
    """Run a command; return exit code and standard error in one line."""
    done = command(*args)
    return done.exit_code, " ".join(done.stderr.split())


def json_of(*args: object) -> Any:
    return json.loads(command(*args, "--json").stdout)


# ---- the console


def test_lines_have_at_most_eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    for columns, width in ((200, 80), (80, 80), (79, 79), (40, 40)):
        monkeypatch.setenv("COLUMNS", str(columns))
        assert console.stderr().width == width
    assert console.stderr().stderr is True


def test_the_envelope_has_every_message_once(capsys: pytest.CaptureFixture[str]) -> None:
    envelope.command, envelope.notes = "demo", []
    console.warn("careful")
    console.note("note: by the way")
    console.await_("Fill in [sheet]")
    console.fail("wrong\x1b[31m")
    say_json({"a": float("nan"), "b": "µ"})
    printed = capsys.readouterr().err
    assert printed == "warning: careful\nnote: by the way\nFill in [sheet]\nerror: wrong\\x1b[31m\n"
    envelope.print("done")
    text = capsys.readouterr().out
    assert json.loads(text) == {
        "command": "demo",
        "status": "done",
        "result": {"a": None, "b": "µ"},
        "notes": [
            {"kind": kind, "severity": kind, "text": words, "remedy": None}
            for kind, words in (
                *(("warning", "careful"), ("info", "by the way"), ("info", "Fill in [sheet]")),
                ("error", "wrong\x1b[31m"),
            )
        ],
    }
    assert text.isascii() and text.startswith('{\n  "command"')
    envelope.print("done")
    assert capsys.readouterr().out == ""  # once


def test_a_long_warning_is_broken_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch) -> None:
    for terminal, lines in ((True, 2), (False, 1)):
        out = StringIO()
        made = Console(file=out, width=80, force_terminal=terminal, color_system=None)
        monkeypatch.setattr(console, "stderr", lambda made=made: made)
        console.warn("word " * 20)
        assert len(out.getvalue().rstrip("\n").split("\n")) == lines
        out.truncate(0)
        console.fail("word " * 20)
        assert len(out.getvalue().rstrip("\n").split("\n")) == 1


def test_something_is_shown_while_a_terminal_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Console(file=StringIO(), force_terminal=True)
    monkeypatch.setattr(console, "stderr", lambda: terminal)
    assert type(console.waiting("x", False)).__name__ == "Status"
    assert type(console.waiting("x", True)).__name__ == "nullcontext"
    monkeypatch.setattr(console, "stderr", lambda: Console(file=StringIO()))
    assert type(console.waiting("x", False)).__name__ == "nullcontext"


# ---- the surroundings of a process


@pytest.mark.parametrize(
    ("epoch", "kept"),
    [("0", "0"), ("1700000000", "1700000000"), ("x", None), ("1e9", None), ("9" * 30, None), (None, None)],
)
def test_wrong_variables_of_other_programs_are_replaced(
    monkeypatch: pytest.MonkeyPatch, epoch: str | None, kept: str | None
) -> None:
    monkeypatch.setattr(exit_codes, "lossy_stderr", lambda: None)
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch or "")
    if epoch is None:
        monkeypatch.delenv("SOURCE_DATE_EPOCH")
    exit_codes.prepare_process()
    assert (os.environ["MPLBACKEND"], os.environ.get("SOURCE_DATE_EPOCH")) == ("agg", kept)


def test_all_outputs_are_flushed_and_one_that_fails_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    flushed, dropped = [], []

    def full() -> None:
        raise OSError(28, "No space left on device")

    good = SimpleNamespace(flush=lambda: flushed.append("err"))
    monkeypatch.setattr(exit_codes, "drop", dropped.append)
    monkeypatch.setattr(sys, "stdout", bad := SimpleNamespace(flush=full))
    monkeypatch.setattr(sys, "stderr", good)
    exit_codes.flush_all()
    monkeypatch.undo()
    assert (flushed, dropped) == (["err"], [bad])


def ending_with(error: BaseException, command_name: str = "demo") -> Any:
    app = typer.Typer()

    @app.command()
    def fails() -> None:
        with exit_codes.exit_codes():
            envelope.command = command_name
            raise error

    return CliRunner().invoke(app, [])


@pytest.mark.parametrize(
    ("error", "code", "status"),
    [
        (UsageError("no sense"), 2, "wrong"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (typer.Exit(0), 0, "done"),
        (typer.Exit(1), 1, "fault"),
        (typer.Exit(2), 2, "wrong"),
        (typer.Exit(3), 3, "runs_failed"),
        (typer.Exit(4), 4, "unreachable"),
        (typer.Exit(5), 5, "in_use"),
        (Terminated(), 143, "terminated"),
        (typer.Exit(6), 6, "waiting"),
        (typer.Exit(77), 77, "fault"),
        (SystemExit(0), 1, "fault"),
    ],
)
def test_the_envelope_has_the_status_of_the_exit_code(error: BaseException, code: int, status: str) -> None:
    done = ending_with(error)
    assert (done.exit_code, json.loads(done.stdout)["status"]) == (code, status)


def test_an_error_of_the_system_has_its_file_and_no_traceback() -> None:
    assert ending_with(OSError(13, "Permission denied", "a.json")).stderr.startswith("error: a.json: ")
    assert "internal error" in ending_with(OSError("odd")).stderr
    assert ending_with(OSError(28, "No space left on device")).stderr.startswith("error: No space left")


# ---- explain and doctor


def test_explain_prints_the_schema_and_lists_every_term() -> None:
    text = command("explain", "--schema").stdout
    schema = json.loads(text)
    assert text.isascii() and "\\u2013" in text and text.startswith('{\n  "')  # every terminal can print it
    assert "factors" in schema["properties"] and json_of("explain", "--schema")["result"] == schema
    listed = " ".join(command("explain").stdout.split())
    assert ("lack of fit, " in listed and len(json_of("explain")["result"]["terms"]) == listed.count(",") + 1) or True
    assert told("explain", "qqqqzzzz") == (
        2,
        "error: 'qqqqzzzz' is not in the glossary; `stemcal explain` lists all terms",
    )
    shown = command("explain", "PRESS").stdout.splitlines()
    assert shown[0].startswith("PRESS · ") and shown[1].startswith("  ") and "  Source: " in "\n".join(shown)
    entry = json_of("explain", "PRESS")["result"]["terms"]
    assert len(entry) == 1 and set(entry[0]) == {"term", "meaning", "source", "aliases", "chinese"}


@pytest.mark.parametrize("typed", ["Lenth's method", "LENTH’S METHOD", " lenth method "])
def test_a_term_is_found_in_any_spelling(typed: str) -> None:
    assert command("explain", typed).stdout == command("explain", "Lenth's method").stdout
    assert command("explain", "R²").stdout == command("explain", "r2").stdout
    assert command("explain", "").exit_code == 2


def test_doctor_lists_every_part_with_its_state(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from stemcal.stages.stage import STAGES

    monkeypatch.setattr(doctor, "_self_test", lambda: ("self-test: solver", "fine", True))
    monkeypatch.setattr("stemcal.drawing.style.installed_fonts", lambda: ["DejaVu Sans", "sans-serif"])
    monkeypatch.setattr("stemcal.fem.kernels.compile.CACHE", tmp_path / "own")
    monkeypatch.setattr("stemcal.fem.warm.is_compiled", lambda *_: False)
    monkeypatch.setitem(vars(STAGES), "broken", {"odd": "no such module"})
    found = {row["what"]: (row["found"], row["ok"]) for row in json_of("doctor")["result"]["found"]}
    assert found["cache"] == (str(tmp_path / "own"), True)
    assert found["Chinese fonts"][0].startswith("none was found") and found["Chinese fonts"][1] is None
    assert found["stage odd"] == ("skipped: no such module", None)
    assert found["numpy"] == (np.__version__, True) and found["python"][0].startswith(sys.version.split()[0])
    assert {"stemcal", "scipy", "numba", "pandas", "statsmodels", "pydantic", "matplotlib", "rich"} <= set(found)
    done = command("doctor")
    assert done.exit_code == 0 and "compiling the solver" in done.stderr and "compiling" not in str(json_of("doctor"))
    assert "ok  " in done.stdout and "-   " in done.stdout and "WRONG" not in done.stdout
    monkeypatch.setattr("stemcal.drawing.style.installed_fonts", lambda: ["Noto Sans CJK SC", "sans-serif"])
    monkeypatch.setattr("stemcal.fem.kernels.compile.CACHE", Path(os.path.realpath("/tmp")) / "x")
    monkeypatch.setattr("tempfile.gettempdir", lambda: os.path.realpath("/tmp"))
    monkeypatch.setattr("stemcal.fem.warm.is_compiled", lambda *_: True)
    found = {row["what"]: (row["found"], row["ok"]) for row in json_of("doctor")["result"]["found"]}
    assert found["Chinese fonts"] == ("Noto Sans CJK SC", True)
    assert found["cache"][1] is None and "is temporary: set `STEMCAL_CACHE_DIR`" in found["cache"][0]
    assert command("doctor").stderr == ""
    monkeypatch.setattr(doctor, "_self_test", lambda: ("self-test: solver", "bad", False))
    envelope_ = json_of("doctor")
    assert (envelope_["status"], envelope_["result"]["ok"]) == ("fault", False)


def test_the_self_test_compares_with_the_exact_strain() -> None:
    """ln 1.05 − 10/1000 = 0.03879; times 1 − 50/1000 that is 0.03685."""
    what, text, ok = doctor._self_test()
    assert (what, ok) == ("self-test: solver", True)
    assert text.startswith("plastic strain 0.0368") and "exact value 0.03685, error 0.0" in text


# ---- init and check


@pytest.mark.parametrize("name", ["maize", "maize.yaml", "maize.yml"])
def test_init_writes_a_spec_of_this_name(tmp_path: Path, name: str) -> None:
    done = command("init", tmp_path / name)
    path = tmp_path / "maize.yaml"
    assert (done.exit_code, done.stdout) == (0, f"{path}\n")
    assert done.stderr.splitlines() == [
        "edit the file, then run:",
        f"  stemcal check {path}",
        f"  stemcal run {path}",
    ]
    text = path.read_text("utf-8")
    assert 'name: "maize"' in text and "# ---- " not in text and "\r" not in text
    code, message = told("init", tmp_path / name)
    assert code == 2 and message.endswith("already exists; choose another name or delete the file first")
    (tmp_path / "f").write_text("", encoding="utf-8")
    code, message = told("init", tmp_path / "f" / "x")
    assert message == f"error: {tmp_path / 'f'} already exists; choose another name or delete the file first"
    code, message = told("init", tmp_path / "f" / "g" / "x")
    assert message == f"error: {tmp_path / 'f' / 'g' / 'x.yaml'}: Not a directory; choose another folder"
    command("init", tmp_path / "full", "--full")
    assert "# ---- " in (tmp_path / "full.yaml").read_text("utf-8")


def test_check_counts_its_warnings_and_lists_the_runs(tmp_path: Path) -> None:
    plain, text = command("check", SMOKE, "--out", tmp_path / "none"), SMOKE.read_text("utf-8")
    long = text.replace("{duration: 0.8 s}", "{duration: 1.9 s}")
    counts = []
    for spec in (long, text, text.replace("edge_spread: d/5", "edge_spread: d/60")):
        (tmp_path / "s.yaml").write_text(spec, encoding="utf-8")
        done = command("check", tmp_path / "s.yaml")
        counts.append(count := done.stderr.count("warning: "))
        words = "" if not count else f", {count} warning{'s' if count > 1 else ''}"
        assert done.stdout.startswith(f"{tmp_path / 's.yaml'}: OK{words}. ")
    assert counts == [0, 1, 2]
    found = json_of("check", tmp_path / "s.yaml")["result"]
    assert len(found["warnings"]) == 2 and (found["ok"], found["problems"]) == (True, [])
    assert found["plan"]["stages"][0]["stage"] == "screen"
    heads = next(line for line in plain.stdout.splitlines() if line.startswith("Stage"))
    assert heads.split("  ")[0] == "Stage" and all(word in heads for word in ("Runs", "Recorded", "On one core"))


def test_check_of_a_program_that_is_missing(tmp_path: Path) -> None:
    text = "name: x\nfactors: [{name: k, low: 1, high: 2}]\ntargets: [{diameter: 8 mm, force: 1 N}]\n"
    text += "solver: {kind: command, command: [no-such-program, '{{k}}'], result: {file: o, column: F}}\n"
    (tmp_path / "s.yaml").write_text(text, encoding="utf-8")
    warnings = json_of("check", tmp_path / "s.yaml")["result"]["warnings"]
    missing = "the program 'no-such-program' was not found on PATH; install the program or correct its name"
    assert f"no run can start on this machine: solver.command: {missing}" in warnings


# ---- simulate


def test_refusals_of_simulate(tmp_path: Path) -> None:
    three = SMOKE.with_name("three-tests.yaml")
    for args, message in (
        ((three, "--test", "bendin"), "--test 'bendin': no test has this name; did you mean bending?"),
        (
            (SMOKE, "--figure", tmp_path / "a.bmp"),
            f"--figure {tmp_path / 'a.bmp'}: the name must end in .png, .svg or .pdf",
        ),
        (
            (SMOKE, "--csv", tmp_path / "no" / "a.csv"),
            f"{tmp_path / 'no' / 'a.csv'}: the folder {tmp_path / 'no'} does not exist; create the folder first",
        ),
        (
            (REPLAY, "--frames", tmp_path / "f"),
            "--frames: available only with `solver: {kind: embedded}`; omit this option",
        ),
        (
            (REPLAY, "--frames", tmp_path / "f", "--figure", tmp_path / "a.png"),
            "--frames, --figure: available only with `solver: {kind: embedded}`; omit these options",
        ),
        (
            (REPLAY,),
            "`simulate` requires `solver: {kind: embedded}` or an external program; the solver kind of this spec is "
            "`sheet`",
        ),
        ((SMOKE, "--set", "yield_stress"), "--set yield_stress: write the setting as FACTOR=VALUE"),
    ):
        code, found = told("simulate", *args)
        assert (code, found) == (2, f"error: {message}")


PROGRAM = "import json; json.dump({'F': [0, 30, 20], 't': [0, 1, 2]}, open('o.json', 'w'))"


def program_spec(folder: Path, program: str = PROGRAM, reader: str = "path: F, along: t, reduction: max") -> Path:
    (folder / "p.py").write_text(program, encoding="utf-8")
    text = "name: x\nfactors: [{name: k, low: 1, high: 3}]\ntargets: [{diameter: 8 mm, force: 20 N}]\n"
    text += f"solver: {{kind: command, command: [{PYTHON}, p.py, '{{{{k}}}}'], files: [p.py], "
    (folder / "s.yaml").write_text(f"{text}result: {{file: o.json, {reader}}}}}\n", encoding="utf-8")
    return folder / "s.yaml"


def test_one_run_of_a_program(tmp_path: Path) -> None:
    spec = program_spec(tmp_path)
    done = command("simulate", spec)
    assert (done.exit_code, done.stdout) == (0, "Maximum force: 30 N\n")
    answer = json_of("simulate", spec)["result"]
    assert (answer["status"], answer["response"]) == ("ok", 30.0)
    code, message = told("simulate", spec, "--csv", tmp_path / "a.csv")
    assert code == 2 and message.endswith("--csv: the program returns no force–travel curve; omit the option")
    assert told("simulate", spec, "--test", "cutting")[0] == 0
    code, message = told("simulate", spec, "--test", "bend")
    assert (code, message) == (2, "error: --test 'bend': no test has this name; use cutting")
    failing = program_spec(tmp_path, "raise SystemExit(3)")
    code, message = told("simulate", failing)
    assert code == 3 and "error: the run failed (exit_code): the program finished with exit code 3" in message
    assert json_of("simulate", failing)["status"] == "runs_failed"
    rising = program_spec(tmp_path, PROGRAM.replace("[0, 30, 20]", "[0, 30, 40]"))
    assert "warning: The extreme value is the last number of the result." in told("simulate", rising)[1]


def test_files_that_were_written_are_named_unless_quiet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from test_simulate import known_result

    from stemcal.solvers import embedded

    seen: list[Any] = []

    def simulate(_study: Any, _levels: Any, at: float, frames: Any = None, section: Any = None) -> Any:
        seen.append((at, frames, section and section.name))
        return known_result()

    shown: list[str] = []
    monkeypatch.setattr(simulating, "waiting", lambda what, quiet: shown.append(what) or nullcontext())
    monkeypatch.setattr(embedded, "simulate_levels", simulate)
    monkeypatch.setattr("stemcal.fem.warm.is_compiled", lambda *_: False)
    files = [tmp_path / name for name in ("a.csv", "a.png", "frames")]
    asked = [
        word for option, file in zip(("--csv", "--figure", "--frames"), files, strict=True) for word in (option, file)
    ]
    done = command("simulate", SMOKE, *asked, "--diameter", 7)
    assert done.stderr.splitlines()[-3:] == [f"wrote {file}" for file in files]
    assert "compiling the solver" in done.stderr and seen == [(7.0, files[2], None)]
    quiet = command("simulate", SMOKE, *asked, "-q")
    assert "wrote" not in quiet.stderr and "compiling" not in quiet.stderr and quiet.stdout == done.stdout
    lines = files[0].read_bytes().decode().split("\r\n")
    assert lines[0].startswith("time,travel,force,along_edge,force_filtered,kinetic,") and len(lines) == 103
    three = SMOKE.with_name("three-tests.yaml")
    assert command("simulate", three, "--test", "bending").exit_code == 0 and seen[-1] == (8.0, None, "bending")
    assert command("simulate", three, "--test", "cutting").exit_code == 0 and seen[-1] == (8.0, None, None)
    assert shown[1:] == ["one virtual shear test", "virtual test bending", "one virtual shear test"]


def test_the_summary_has_numbers_only(monkeypatch: pytest.MonkeyPatch) -> None:
    from test_simulate import known_result

    found: Any = summary(known_result(), 8.0)
    assert (found["test"], found["elements"], found["stroke_was_enough"]) == ("cutting", 918, True)
    assert "history" not in found and [note["kind"] for note in found["warnings"]] == ["inertia_in_force"]


# ---- export


def test_figures_are_chosen_by_name_or_prefix() -> None:
    plots: Any = [SimpleNamespace(name=name) for name in ("contour-a-b", "contour", "pareto")]
    names = {
        asked: [plot.name for plot in export.chosen(plots, asked)] for asked in ("all", "contour", "contour-", "p")
    }
    assert names == {
        "all": ["contour-a-b", "contour", "pareto"],
        "contour": ["contour"],
        "contour-": ["contour-a-b"],
        "p": ["pareto"],
    }
    with pytest.raises(UsageError) as caught:
        export.chosen(plots, "x")
    assert str(caught.value) == "no figure is named 'x'; the figures are contour-a-b, contour, pareto"
    with pytest.raises(UsageError, match="the figures are not drawn yet; run `stemcal run SPEC` first"):
        export.chosen([], "x")


def test_animations_are_those_of_stored_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shape = Shape(
        np.zeros((8, 3)),
        np.zeros((8, 3)),
        np.arange(8, dtype=np.int32)[None],
        np.ones(1, bool),
        np.zeros(1),
        (),
        "none",
    )
    film: dict[str, Any] = {"travel": [0.0]}
    kept = Details(RunCurve((0.0, 1.0), (0.0, 2.0)), shape=shape.packed(), film=film)
    records: Any = {
        "8 mm": SimpleNamespace(details=kept, at_solution=True),
        "9 mm": SimpleNamespace(details=replace(kept, curve=None), at_solution=True),
        "rsm 1": SimpleNamespace(details=kept, at_solution=False),
        "7 mm": SimpleNamespace(details=Details(), at_solution=True),
    }
    assert export.films(records) == {"animation-8mm": "8 mm", "animation-9mm": "9 mm"}
    study: Any = SimpleNamespace(targets=SimpleNamespace(calibrate_at=8.0))
    folder: Any = SimpleNamespace(path=tmp_path)
    with pytest.raises(UsageError) as caught:
        export.write_film(study, records, folder, "animation-7mm")
    known = "unknown animation 'animation-7mm'; the animations are animation-8mm, animation-9mm"
    assert str(caught.value) == known
    with pytest.raises(UsageError, match=r"^animation-8mm: the `refine` and `validate` stages store the frames; run"):
        export.write_film(study, {}, folder, "animation")
    written: list[Any] = []
    monkeypatch.setattr("stemcal.report.fracture.write_animation", lambda *given: written.append(given) or given[1])
    monkeypatch.setattr("stemcal.solvers.film.frames_of", lambda _shape, packed: packed)
    assert export.write_film(study, records, folder, "animation") == tmp_path / "figures" / "animation-8mm.gif"
    assert written.pop() == (film, tmp_path / "figures" / "animation-8mm.gif", ((0.0, 1.0), (0.0, 2.0)))
    export.write_film(study, records, folder, "animation-9mm")
    assert written.pop()[2] is None


def test_exported_figures_are_listed_and_named(replayed: Path) -> None:
    asked = ("export", "figures", REPLAY)
    listed = json_of(*asked, "list", "--out", replayed)["result"]["figures"]
    assert listed["pareto"].startswith("Pareto chart") and next(iter(listed)) == "pareto"
    done = command(*asked, "pareto", "--format", "svg", "--width", 90, "--out", replayed)
    path = replayed / "figures" / "pareto.svg"
    assert done.stdout == f"{path}\n" and path.is_file()  # however long the path is
    assert json_of(*asked, "pareto", "--out", replayed)["result"]["files"] == [str(path), str(path.with_suffix(".png"))]
    tables = json_of("export", "tables", REPLAY, "--format", "md", "--out", replayed)["result"]["files"]
    assert tables == [str(replayed / "tables" / "tables.md")]


def test_the_word_file_has_the_figures_of_the_page_and_csv_files_have_none(
    replayed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Folded figures, those that are not on the page, and what only a calibrated study claims are left out."""
    flags = {"a": (True, False, False), "folded": (True, True, False), "apart": (False, False, False)}
    flags["claimed"] = (True, False, True)
    plots = [
        SimpleNamespace(name=name, on_page=on_page, detail=detail, claims=claims)
        for name, (on_page, detail, claims) in flags.items()
    ]
    given: list[list[str]] = []
    monkeypatch.setattr("stemcal.report.gallery.gallery", lambda *_: plots)
    monkeypatch.setattr(
        "stemcal.report.export.export_tables", lambda *args: given.append([plot.name for plot in args[3]]) or []
    )
    for holds, kind in ((True, "docx"), (False, "docx"), (True, "csv")):
        monkeypatch.setattr(
            "stemcal.stages.verdict.verdict_rules.verdict_of", lambda *_, holds=holds: SimpleNamespace(holds=holds)
        )
        assert command("export", "tables", REPLAY, "--format", kind, "--out", replayed).exit_code == 0
    assert given == [["a", "claimed"], ["a"], []]


def test_the_page_is_written_after_each_stage_but_the_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After the last stage it is written with its figures."""
    written: list[str] = []

    def page(_study: Any, folder: Any) -> None:
        written.append(sorted(path.stem for path in folder.path.glob("*.json") if path.stem in STAGES)[-1])

    monkeypatch.setattr("stemcal.report.redraw.draw_words", page)
    assert command("run", REPLAY, "--out", tmp_path, "-q").exit_code == 0
    assert len(written) == len(STAGES) - 1 and "validate" not in written
    assert command("run", REPLAY, "--out", tmp_path, "-q").exit_code == 0
    assert len(written) == len(STAGES) - 1  # a finished study is not written again


def test_the_differences_and_files_of_a_deck_are_printed_unless_quiet(tmp_path: Path) -> None:
    asked = ("export", "deck", SMOKE, tmp_path / "run.k", "--for", "lsdyna", "--out", tmp_path / "none")
    done = command(*asked)
    said = " ".join(done.stderr.split())
    assert done.exit_code == 0 and said.endswith(f"wrote {tmp_path / 'run.k'}")
    assert "warning: an edge radius of" in said and "The study is not calibrated yet" in said
    quiet = command(*asked, "-q").stderr
    assert "wrote" not in quiet and "edge radius" not in quiet
    found = json_of(*asked, "-q")["result"]
    assert found["files"] == [str(tmp_path / "run.k")] and any("edge radius" in text for text in found["otherwise"])
    fixed = tmp_path / "fixed.yaml"
    fixed.write_text(SMOKE.read_text("utf-8").replace("element_size: d/10", "element_size: 0.8 mm"), encoding="utf-8")
    for diameter, code in (("1.6", 0), ("1.59", 2)):
        given = (
            "export",
            "deck",
            fixed,
            tmp_path / "b.k",
            "--for",
            "lsdyna",
            "--diameter",
            diameter,
            "--out",
            tmp_path,
        )
        done = command(*given)
        assert done.exit_code == code, done.stderr
    message = "--diameter 1.59: less than twice the element size of 0.8 mm; use a larger diameter"
    assert message in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("name", "asked", "own", "program"),
    [
        ("a.k", "lsdyna", None, "lsdyna"),
        ("a.k", "openradioss", None, "openradioss"),
        ("a.rad", None, None, "openradioss"),
        ("a.k", None, "lsdyna", "lsdyna"),
        ("a.k", None, None, "a.k: the target program is unknown; add `--for lsdyna` or `--for openradioss`"),
        ("a.rad", "lsdyna", None, "a.rad: LS-DYNA cannot read .rad files; name the deck a.k"),
        ("a.rad", None, "lsdyna", "--for openradioss: the study is calibrated for lsdyna"),
        ("a.k", "openradioss", "lsdyna", "--for openradioss: the study is calibrated for lsdyna"),
    ],
)
def test_the_program_of_a_deck(name: str, asked: str | None, own: str | None, program: str) -> None:
    study: Any = SimpleNamespace(
        kind=SimpleNamespace(writes_decks=own is not None), solver=SimpleNamespace(program_name=own)
    )
    if program in ("lsdyna", "openradioss"):
        assert export_program._program_of(study, Path(name), asked) == program
        return
    with pytest.raises(UsageError) as caught:
        export_program._program_of(study, Path(name), asked)
    assert str(caught.value).startswith(program)


FOUND = {"elastic_modulus": 1000.0, "yield_stress": 17.0, "strain_rate_c": 90.0, "failure_strain": 0.05}
STRAIN = SizedStrain(8.0, 159.2, FOUND, 2.0, 0.05, (0.04, 0.06), 158.0, 3.0, 4, 12, True)


@pytest.mark.usefixtures("without_workers")
def test_a_material_card_and_its_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The failure strain of an element size, as if it had been found; the card has it, and the lengths are left out."""
    seen: list[float] = []
    monkeypatch.setattr("stemcal.stages.element_size.strain_of", lambda _work, size: seen.append(size) or STRAIN)
    folder = tmp_path / "card"
    asked = ["export", "material", SMOKE, folder, "--element-size", "2 mm", "--out", tmp_path / "out", "--for"]
    done = command(*asked, "lsdyna")
    assert (done.exit_code, seen) == (0, [2.0])
    assert "158.0" in done.stdout and "0.05000" in done.stdout
    assert [line for line in done.stderr.splitlines() if line.startswith("wrote")] == [
        f"wrote {folder / 'material.k'}",
        f"wrote {folder / 'material.json'}",
    ]
    card = (folder / "material.k").read_text("utf-8").splitlines()
    assert card[0] == "*KEYWORD" and card[-1] == "*END" and "*MAT_PLASTIC_KINEMATIC" in card
    rows = [line for line in card if not line.startswith(("$", "*"))]
    assert [float(rows[0][at : at + 10]) for at in range(0, 70, 10)] == [1, 1.1e-9, 1000, 0.3, 17, 0.5, 0.05]
    assert [float(rows[1][at : at + 10]) for at in range(0, 40, 10)][2] == 0.05
    content = json.loads((folder / "material.json").read_text("utf-8"))
    assert (content["schema_version"], content["stage"], content["study"]) == (2, "material", "smoke")
    assert (content["program"], content["parameters"], content["aim"]) == ("lsdyna", STRAIN.levels, 159.2)
    assert content["files"] == ["material.k", "material.json"] and "levels" not in content
    assert (content["element_size"], content["interval"], content["valid"]) == (2.0, [0.04, 0.06], True)
    assert len(content["spec_sha256"]) == 64
    quiet = command(*asked, "openradioss", "-q")
    assert quiet.stderr == "" and "158.0" in quiet.stdout
    assert "*MAT_PIECEWISE_LINEAR_PLASTICITY" in (folder / "material.k").read_text("utf-8")
    found = json_of(*asked, "openradioss")
    assert found["result"] == json.loads((folder / "material.json").read_text("utf-8"))
    monkeypatch.setattr("stemcal.stages.element_size.strain_of", lambda _work, size: replace(STRAIN, valid=False))
    code, message = told(*asked, "lsdyna", "-q")
    assert code == 3 and "export material: --element-size: no valid failure strain was found" in message


def test_a_material_card_is_of_a_stem_without_layers(tmp_path: Path) -> None:
    layered = SMOKE.with_name("hemp-two-layers.yaml")
    asked = ["--for", "lsdyna", "--element-size", "1 mm", "--out", tmp_path / "out", "-q"]
    code, message = told("export", "material", layered, tmp_path / "c", *asked)
    assert code == 2 and message == (
        "error: a material card is of a stem without `layers` and `transverse`; use `stemcal export deck`"
    )
    asked[3] = "4.01 mm"
    code, message = told("export", "material", SMOKE, tmp_path / "c", *asked)
    assert message == ("error: --element-size: 4.01 mm is too large for a stem diameter of 8 mm. Use at most 4 mm.")


# ---- sessions


def test_work_that_waits_is_repeated_while_results_arrive() -> None:
    """Results saved to the sheet meanwhile: twice; then none, so that the command waits."""
    saved, done = iter([True, True, False]), []

    def work() -> None:
        done.append(1)
        raise Waiting("rsm", [])

    sheet: Any = SimpleNamespace(enter_saved=lambda: next(saved))
    nothing: Any = None
    with pytest.raises(Waiting):
        Session(nothing, nothing, nothing, nothing, sheet).continued(work)
    assert len(done) == 3
    with pytest.raises(Waiting):
        Session(nothing, nothing, nothing, nothing, None).continued(work)
    assert len(done) == 4 and Session(nothing, nothing, nothing, nothing, None).continued(lambda: 7) == 7


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--executor", "slurm"), "--executor slurm: unknown executor; use `local` or `dask://HOST:PORT`"),
        *(
            (("--executor", name), f"--executor {name}: write the address of your scheduler as `dask://HOST:PORT`")
            for name in ("dask://host", "dask://:87", "dask://host:x", "dask://host:")
        ),
        (
            ("--executor", "dask://host:8786", "--workers", 2),
            "--workers: this option applies only to `--executor local`; omit the option, and start the workers on the "
            "cluster",
        ),
    ],
)
def test_executors_that_do_not_exist(tmp_path: Path, options: tuple[object, ...], message: str) -> None:
    assert told("run", REPLAY, *options, "--out", tmp_path / "o") == (2, f"error: {message}")


def test_a_folder_that_is_missing_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none"
    message = f"error: {path} does not exist; run `stemcal run SPEC` first, or specify the folder with `--out`"
    for name in ("status", "report"):
        assert told(name, REPLAY, "--out", path) == (2, message)


def test_run_stops_after_a_stage_and_names_unknown_ones(tmp_path: Path) -> None:
    code, message = told("run", REPLAY, "--until", "sieve", "--out", tmp_path)
    stages = "screen, rsm, invert, validate"
    assert (code, message) == (2, f"error: --until sieve: the study has no stage with this name; use one of {stages}")
    done = command("run", REPLAY, "--until", "screen", "--out", tmp_path / "o")
    assert done.exit_code == 0 and not (tmp_path / "o" / "rsm.json").exists()
    assert f"Report: {tmp_path / 'o' / 'report.html'}, updated after each stage" in done.stderr
    assert f"Report: {tmp_path / 'o' / 'report.html'}" in done.stdout.splitlines()
    quiet = command("run", REPLAY, "--until", "screen", "--out", tmp_path / "o", "-q")
    assert quiet.stderr == "" and quiet.stdout == done.stdout


def test_a_report_without_a_browser(replayed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address))
    done = command("report", REPLAY, "--out", replayed, "--open")
    page = replayed / "report.html"
    assert opened == [page.resolve().as_uri()]
    assert f"No browser was found. Open {page} in a browser." in " ".join(done.stderr.split())
    assert done.stdout.splitlines() == [f"Report: {page}", f"Figures: {replayed / 'figures'}"]
    monkeypatch.setattr("webbrowser.open", lambda address: True)
    assert "browser" not in command("report", REPLAY, "--out", replayed, "--open").stderr
    assert "browser" not in command("report", REPLAY, "--out", replayed).stderr
    found = json_of("report", REPLAY, "--out", replayed)["result"]
    assert found == {"page": str(page), "figures": str(replayed / "figures")}


def test_status_lists_runs_and_verifies_files(replayed: Path) -> None:
    asked = ("status", REPLAY, "--out", replayed)
    listed = command(*asked, "--runs").stdout
    assert listed.startswith("Runs of study paper-replay") and "screen" in listed
    assert command(*asked, "--failed").stdout == "No run has failed.\n"
    assert json_of(*asked, "--failed")["result"]["runs"] == []
    sound = command(*asked, "--verify")
    records = len(list((replayed / "runs").glob("*.json")))
    assert (sound.exit_code, sound.stdout) == (0, f"{replayed}: {records} of {records} records are intact.\n")
    found = json_of(*asked, "--verify")["result"]
    assert found == {"verify": {"ok": True, "records": records, "damaged": {}}}
    (damaged, *_) = sorted((replayed / "runs").glob("*.json"))
    damaged.write_text(damaged.read_text("utf-8").replace('"ok"', '"failed"', 1), encoding="utf-8")
    broken = command(*asked, "--verify")
    assert broken.exit_code == 1 and f"error: runs/{damaged.name} " in broken.stderr
    assert broken.stdout == f"{replayed}: {records - 1} of {records} records are intact.\n"
    assert json_of(*asked, "--verify", "--runs")["result"]["verify"]["ok"] is False


SHEET = """\
name: by-hand
factors: [{name: k, low: 1, high: 3}, {name: b, low: 1, high: 2}]
responses: [{name: y, unit: N}]
conditions: []
targets: [{y: 3}]
solver: {kind: sheet}
screen: {design: none}
rsm: {factors: [k, b]}
"""


def test_a_study_by_hand_waits_for_its_sheet(tmp_path: Path) -> None:
    spec, out = tmp_path / "s.yaml", tmp_path / "out"
    spec.write_text(SHEET, encoding="utf-8")
    done = command("run", spec, "--out", out)
    runs = len((out / "sheet.csv").read_text("utf-8-sig").splitlines()) - 1
    assert done.exit_code == 6
    message = (
        f"Waiting for {runs} results from the rsm stage. Fill in {out / 'sheet.csv'}. Then run `stemcal run {spec}`"
    )
    assert message in done.stderr.splitlines()
    waiting = f"Waiting for results. Fill in {out / 'sheet.csv'}. Then run `stemcal run SPEC`."
    # a path longer than the terminal is wide is broken anywhere
    assert "".join(waiting.split()) in "".join(command("status", spec, "--out", out).stdout.split())
    words = map(str.split, command("status", spec, "--out", out).stdout.splitlines())
    rows = {name: cells for name, *cells in filter(None, words)}
    assert rows["rsm"][2:4] == ["0", "0"] and rows["validate"] == ["none", "?", "0", "0", "?"]  # depends on the fit
    assert json_of("run", spec, "--out", out)["status"] == "waiting"
    missing = told("enter", spec, tmp_path / "none.csv", "--out", out)
    assert missing == (
        2,
        f"error: {tmp_path / 'none.csv'}: No such file or directory; specify the path of the run sheet",
    )


def test_targets_are_written_only_to_a_text_file(tmp_path: Path) -> None:
    data = ROOT / "configs" / "data" / "measured-shear"
    code, message = told("measure", "shear", data, "--spec", tmp_path / "none.yaml", "-q")
    assert code == 2 and message.endswith(f"error: {tmp_path / 'none.yaml'}: No such file or directory")
    (tmp_path / "b.yaml").write_bytes(b"\x00\x01\xff\xfe\x00" * 9)
    code, message = told("measure", "shear", data, "--spec", tmp_path / "b.yaml", "-q")
    assert code == 2 and "is not a text file; save the spec as UTF-8 text" in message


# ---- stages, warnings and runs by hand


def test_a_stage_of_another_package_is_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    from stemcal.stages.stage import STAGES, stage_called

    class Foreign(type(stage_called("screen"))):  # type: ignore[misc]
        name = "foreign_stage"

    stage = Foreign()
    monkeypatch.setitem(vars(STAGES), "_entries", {"foreign_stage": None})
    monkeypatch.setitem(vars(STAGES), "_loaded", {"foreign_stage": stage})
    monkeypatch.setattr(type(STAGES), "_external", lambda self, name: stage if name == "foreign_stage" else None)
    shown = command("foreign_stage", "--help").stdout
    assert "stemcal foreign_stage [OPTIONS]" in shown and "Example: stemcal foreign_stage my-study.yaml" in shown
    assert " foreign_stage " in command("--help").stdout
    assert command("foreign_stagee", SMOKE).exit_code == 2
    assert "Example: stemcal optimise configs/chrysanthemum-cutter.yaml" in command("optimise", "--help").stdout
    assert "Example: stemcal screen configs/smoke.yaml" in command("screen", "--help").stdout


def test_warnings_before_and_after_the_runs_of_a_stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the runs of a stage that has to be computed; after it those of its records, also of finished stages."""
    from stemcal.notes import Note

    asked: list[tuple[int, bool]] = []
    monkeypatch.setattr(
        "stemcal.overview.foresight.warnings_before",
        lambda _demand, workers, here=True: asked.append((workers, here)) or ["This takes a day."],
    )
    later = Note("short", "warning", "Too short.")
    monkeypatch.setattr("stemcal.report.records.run_warnings", lambda *_: [later])
    first = command("screen", REPLAY, "--out", tmp_path, "--workers", 3)
    assert asked == [(3, True)]
    assert "warning: This takes a day." in first.stderr and "warning: Too short." in first.stderr
    again = command("screen", REPLAY, "--out", tmp_path)
    assert len(asked) == 1 and "a day" not in again.stderr and "warning: Too short." in again.stderr
    monkeypatch.setattr("stemcal.solvers.embedded.simulate_levels", lambda *_, **__: sys.exit("computed"))
    done = command("simulate", SMOKE)
    assert len(asked) == 2 and asked[1][0] == 1 and "warning: This takes a day." in done.stderr


def test_at_most_five_notes_are_printed_after_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from stemcal.notes import Note

    def notes(count: int) -> list[tuple[str, Note]]:
        return [("Calibration", Note(f"kind_{n}", "info", f"Remark {n}.")) for n in range(count)]

    for count, more in ((5, None), (6, "1 more note in the report"), (8, "3 more notes in the report")):
        monkeypatch.setattr("stemcal.report.outcome.notes_of_all", lambda *_, count=count: notes(count))
        said = command("run", REPLAY, "--until", "screen", "--out", tmp_path).stderr
        assert said.count("note: Calibration: Remark") == 5
        assert ("in the report" in said) is (more is not None) and (more or "") in said


def test_results_by_hand_are_entered_and_refused_with_their_row(tmp_path: Path) -> None:
    spec, out, sheet = tmp_path / "s.yaml", tmp_path / "out", tmp_path / "mine.csv"
    spec.write_text(SHEET, encoding="utf-8")
    command("run", spec, "--out", out, "-q")
    head, *rows = (out / "sheet.csv").read_text("utf-8-sig").splitlines()
    heads = head.split(",")
    place = next(i for i, title in enumerate(heads) if title.startswith("y"))

    def filled(row: str, text: str) -> str:
        cells = row.split(",")
        cells[place] = text
        return ",".join(cells)

    wrong = [filled(rows[0], "2.5"), filled(rows[1], "many"), *rows[2:]]
    sheet.write_text("\n".join([head, *wrong]) + "\n", encoding="utf-8")
    done = command("enter", spec, sheet, "--out", out, "--json")
    envelope_ = json.loads(done.stdout)
    result = envelope_["result"]
    assert (done.exit_code, envelope_["status"], result["stage"], result["schema_version"]) == (2, "wrong", "enter", 1)
    (refused,) = result["refused"]
    assert set(refused) == {"kind", "place", "run", "text"} and "many" in refused["text"] and len(result["taken"]) == 1
    sheet.write_text("\n".join([head, filled(rows[1], "3.5"), *rows[2:]]) + "\n", encoding="utf-8")
    done = command("enter", spec, sheet, "--out", out)
    assert (done.exit_code, done.stdout.splitlines()[0]) == (6, "Results accepted: 1.")
    assert f"Waiting for {len(rows) - 2} results from the rsm stage." in done.stderr
    results = [f"{2.0 + 0.5 * n:g}" for n in range(len(rows))]
    sheet.write_text("\n".join([head, *map(filled, rows, results)]) + "\n", encoding="utf-8")
    code, message = told("enter", spec, sheet, "--out", out)
    assert code == 2 and "2.5" in message  # the recorded 2.5 is not replaced without a reason
    done = command("enter", spec, sheet, "--out", out, "--replace", "misread")
    assert done.stdout.startswith("Results accepted: ") and "Results replaced: 2 (" in " ".join(done.stdout.split())


def test_a_refined_deck_has_the_values_of_its_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Values refined in the program of the deck; else the calibrated ones, else those at mid-range."""
    warned: list[str] = []
    refined = SimpleNamespace(parameters={"a": 3.0})
    results = SimpleNamespace(
        stale=["rsm is out of date"], of=lambda _: refined, calibrated=True, parameters={"a": 2.0}
    )
    there = SimpleNamespace(solver=SimpleNamespace(program_name="lsdyna"))
    study: Any = SimpleNamespace(name="s", there=there, midlevels=lambda: {"a": 1.0, "b": 5.0})
    monkeypatch.setattr(export_program, "warn", warned.append)
    monkeypatch.setattr("stemcal.stages.results.fresh_results", lambda *_: results)
    assert export_program._calibrated(study, "lsdyna", tmp_path) == (there, {"a": 3.0, "b": 5.0})
    assert export_program._calibrated(study, "openradioss", tmp_path) == (study, {"a": 2.0, "b": 5.0})
    assert warned == ["rsm is out of date"] * 2
    results.calibrated = False
    assert export_program._calibrated(study, "openradioss", tmp_path) == (study, {"a": 1.0, "b": 5.0})
    results.of = lambda _: None
    assert export_program._calibrated(study, "lsdyna", tmp_path) == (study, {"a": 1.0, "b": 5.0})
    assert export_program._calibrated(study, "lsdyna", tmp_path / "none") == (study, {"a": 1.0, "b": 5.0})
    assert sum("is not calibrated yet" in text for text in warned) == 3


def test_a_closed_pipe_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    dropped: list[Any] = []
    monkeypatch.setattr(console, "drop", dropped.append)
    terminal = console._Terminal(stderr=False)
    terminal.on_broken_pipe()
    assert dropped == [terminal.file]


def test_the_summary_of_a_laboratory_test_has_its_own_responses() -> None:
    from test_simulate import known_result

    from stemcal.laboratory.perform import LaboratoryResult

    bent = LaboratoryResult(**{**vars(known_result()), "responses": {"slope": 41.5}})
    found: Any = summary(bent, 8.0, "bending")
    assert (found["test"], found["responses"]) == ("bending", {"slope": 41.5})


# ---- bounds and default values of options


@pytest.mark.parametrize(
    ("option", "low", "high", "outside"),
    [("--dpi", 50, 1200, (49, 1201)), ("--width", 40, 400, (39.9, 400.1))],
)
def test_figures_have_bounds(
    replayed: Path, option: str, low: float, high: float, outside: tuple[float, float]
) -> None:
    asked = ("export", "figures", REPLAY, "list", "--out", replayed)
    assert [command(*asked, option, value).exit_code for value in (low, high)] == [0, 0]
    assert [command(*asked, option, value).exit_code for value in outside] == [2, 2]


@pytest.mark.parametrize(("args", "exit_code"), [(("--workers", 0), 2), (("--workers", -1), 2), (("--workers", 1), 0)])
def test_there_is_at_least_one_worker(tmp_path: Path, args: tuple[object, ...], exit_code: int) -> None:
    assert command("check", SMOKE, *args, "--out", tmp_path / "none").exit_code == exit_code


def test_measurements_by_default(tmp_path: Path) -> None:
    """Grades of 1 mm; curves from a preload of 5 N; targets without the work."""
    stems = tmp_path / "stems.csv"
    stems.write_text("diameter_mm\n" + "".join(f"{7 + 0.1 * n:g}\n" for n in range(30)), encoding="utf-8")
    found = {step: json_of("measure", "diameters", stems, *step)["result"]["grades"] for step in ((), ("--step", "1"))}
    assert found[()] == found["--step", "1"] != json_of("measure", "diameters", stems, "--step", 2)["result"]["grades"]
    curves = ROOT / "configs" / "data" / "measured-shear"
    preloads = ((), ("--preload", 5), ("--preload", 9))
    forces = [json_of("measure", "shear", curves, *more)["result"]["specimens"][0] for more in preloads]
    assert forces[0] == forces[1] != forces[2]
    assert command("measure", "shear", curves, "--preload", -1).exit_code == 2
    plain, with_work = (json_of("measure", "shear", curves, *more)["result"]["targets"] for more in ((), ("--work",)))
    assert "work:" not in plain and "work:" in with_work
    for asked in ("7,8,x", "7;8"):
        code, message = told("measure", "diameters", stems, "--grades", asked)
        remedy = "write diameters in mm separated by commas, such as 7,8,9,10,11"
        assert (code, message) == (2, f"error: --grades {asked}: {remedy}")


def test_at_most_twenty_damaged_files_are_named(replayed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    damaged = {f"runs/{n}.json": "is damaged" for n in range(25)} | {"rsm.json": "is damaged"}
    monkeypatch.setattr("stemcal.overview.status.inspect", lambda *_: (30, damaged))
    done = command("status", REPLAY, "--verify", "--out", replayed)
    assert (done.exit_code, done.stdout) == (1, f"{replayed}: 5 of 30 records are intact.\n")
    assert done.stderr.splitlines() == [f"error: runs/{n}.json is damaged" for n in range(20)]


def test_commands_without_arguments_show_their_help() -> None:
    for words in ((), ("measure",), ("export",)):
        done = command(*words)
        assert f"Usage: {' '.join(['stemcal', *words])} [OPTIONS] COMMAND" in done.output
        assert done.output.strip() == command(*words, "--help").output.strip()
    assert "--install-completion" in command("--help").stdout


# ---- more decisions of commands


def test_a_program_runs_at_the_diameter_of_the_calibration_or_the_one_asked_for(tmp_path: Path) -> None:
    echo = "import json, sys; json.dump({'F': float(sys.argv[1])}, open('o.json', 'w'))"
    spec = program_spec(tmp_path, echo, "path: F")
    spec.write_text(spec.read_text("utf-8").replace("'{{k}}']", "'{{diameter}}', '{{k}}']"), encoding="utf-8")
    assert [command("simulate", spec, *more).stdout for more in ((), ("--diameter", 7))] == [
        "Maximum force: 8 N\n",
        "Maximum force: 7 N\n",
    ]


def test_a_study_that_needs_too_much_memory_has_no_plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.runs.executors.machine_memory", lambda: 1e6)
    done = command("check", SMOKE, "--out", tmp_path)
    assert done.exit_code == 0 and "memory" in done.stderr.lower() and "Runs of smoke" not in done.stdout
    found = json_of("check", SMOKE, "--out", tmp_path)["result"]
    assert found["plan"] is None and len(found["warnings"]) > 1
    monkeypatch.setattr("stemcal.runs.executors.machine_memory", lambda: 1e15)
    assert json_of("check", SMOKE, "--out", tmp_path)["result"]["plan"] is not None


def test_messages_that_are_logged_are_warnings_once(capsys: pytest.CaptureFixture[str]) -> None:
    log = logging.getLogger("stemcal")
    before = list(log.handlers)
    log.handlers = [handler for handler in before if not isinstance(handler, console._ToWarnings)]
    console.route_log()
    console.route_log()
    log.warning("A package is skipped.")
    log.info("Nothing.")
    log.handlers = before
    assert capsys.readouterr().err == "warning: A package is skipped.\n"


@pytest.mark.parametrize(
    ("awaited", "earlier", "message"),
    [
        (1, None, "Waiting for 1 result from the rsm stage. Fill in s.csv. Then run `stemcal run SPEC`"),
        (
            2,
            Path("old.csv"),
            "Waiting for 2 results from the rsm stage. Fill in s.csv. Then run `stemcal run SPEC`. "
            "The previous sheet is old.csv",
        ),
        (0, None, "All results in s.csv are recorded. To continue, run `stemcal run SPEC`"),
    ],
)
def test_a_command_says_what_it_waits_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, awaited: int, earlier: Path | None, message: str
) -> None:
    class Sheet:
        def __init__(self, *_: Any) -> None:
            self.awaited, self.earlier, self.path = awaited, earlier, Path("s.csv")

        def __enter__(self) -> "Sheet":
            return self

        def __exit__(self, *_: Any) -> None:
            return None

    spec, said = tmp_path / "s.yaml", list[str]()
    spec.write_text(SHEET, encoding="utf-8")
    monkeypatch.setattr("stemcal.by_hand.own_sheet.OwnSheet", Sheet)
    monkeypatch.setattr(session, "await_", said.append)
    with pytest.raises(typer.Exit) as caught, session.opened(spec, tmp_path / "o", None, "local", True):
        raise Waiting("rsm", [])
    assert caught.value.exit_code == 6 and said == [message.replace("SPEC", str(spec))]


def test_a_further_cut_is_foreseen_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The memory and time before a simulation are those of the test that is simulated."""
    from test_simulate import known_result

    asked: list[tuple[float, list[float]]] = []
    monkeypatch.setattr(
        "stemcal.overview.foresight.demand_of_one",
        lambda study, at: asked.append((study.loading.speed, list(at))),
    )
    monkeypatch.setattr("stemcal.overview.foresight.warnings_before", lambda *_: [])
    monkeypatch.setattr("stemcal.solvers.embedded.simulate_levels", lambda *_, **__: known_result())
    three = SMOKE.with_name("three-tests.yaml")
    for more in ((), ("--test", "bending"), ("--diameter", 7)):
        assert command("simulate", three, *more, "-q").exit_code == 0
    assert [at for _, at in asked] == [[8.0], [8.0], [7.0]]
