"""Numbers, file systems, results and options that nobody expects: each a clear message, none an internal error."""

from __future__ import annotations

import errno
import os
import random
import time
from contextlib import suppress
from pathlib import Path
from typing import Any
from unittest import mock

import test_command
from fakes import FakeSolver, lines, make_study
from of_disks import finished
from of_processes import posix, results
from of_specs import CONFIGS, SPECS
from tally import Fault, each
from typer.testing import CliRunner

from stemcal import workflow
from stemcal.cli.app import app
from stemcal.errors import RunsFailed, SpecError
from stemcal.executors.inline import InlineExecutor
from stemcal.files.durable import sealed
from stemcal.folder.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.reading import read_study

HUGE = (1e300, -1e300, 1.7e308, 1e200, -1e155, 1e31)


class Huge(FakeSolver):
    """Gives huge forces in some runs of the screening."""

    def __init__(self, rows: dict[int, float]) -> None:
        super().__init__()
        object.__setattr__(self, "rows", rows)

    def solve(self, request: Request) -> Answer:
        """Answer, or give the huge force."""
        rows: dict[int, float] = getattr(self, "rows")  # noqa: B009
        if request.stage == "screen" and request.row in rows:
            return Answer("ok", response=rows[request.row])
        return super().solve(request)


def huge_number(folder: Path, number: int, rng: random.Random) -> None:
    """From a program the run is failed and the study goes on; in a table or a spec the place is named."""
    folder.mkdir(parents=True, exist_ok=True)
    value = rng.choice(HUGE)
    match number % 3:
        case 0:
            rows = {row: rng.choice(HUGE) for row in rng.sample(range(12), rng.randint(1, 3))}
            found = StudyFolder(folder / "out")
            with suppress(RunsFailed):  # with so few runs left that nothing can be tested
                workflow.run_stage("screen", make_study(folder), found, InlineExecutor(), solver=Huge(rows))
            records = [r for r in map(found.peek, found.keys()) if r and r["status"] == "failed"]
            assert len(records) == len(rows) and {r["reason"] for r in records} == {"bad_result"}
            assert len(rows) > 1 or found.read_stage("screen")["runs_used"] == 11
        case 1:
            key = rng.choice(["low: 10", "high: 20", "force: 110 N", "diameter: 10 mm"])
            make_study(folder)
            name, _, unit = key.partition(": ")[2].partition(" ")
            text = (folder / "known.yaml").read_text("utf-8")
            text = text.replace(key, f"{key.partition(':')[0]}: {abs(value):g} {unit}".rstrip(), 1)
            _refused(text.encode(), folder / "known.yaml", "1e+30", "beyond", "finite", name)
        case _:
            from shutil import copytree

            copytree(CONFIGS / "data", folder / "data")
            table = folder / "data" / "paper-forces.csv"
            rows_ = table.read_text("utf-8").splitlines()
            cells = rows_[3].split(",")
            cells[rng.randrange(1, len(cells))] = f"{value:g}"
            table.write_text("\n".join([*rows_[:3], ",".join(cells), *rows_[4:]]), encoding="utf-8")
            (folder / "replay.yaml").write_bytes(SPECS["paper-replay.yaml"])
            result = CliRunner().invoke(app, ["screen", str(folder / "replay.yaml"), "--out", str(folder / "out")])
            assert result.exit_code == 2 and "beyond 1e30" in result.stderr, result.stderr
            assert f"{table.name}:4" in result.stderr, result.stderr


def _refused(text: bytes, place: Path, *words: str) -> None:
    try:
        read_study(text, place)
    except SpecError as refused:
        assert any(word in str(refused) for word in words), str(refused)
    else:
        raise AssertionError("it was taken")


NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.ENOTSUP)


def no_flock(folder: Path, number: int, _rng: random.Random) -> None:
    """On a file system without locks a study is refused with place and remedy; what only reads still reads."""
    posix()
    import fcntl

    study = finished(folder).path if number % 2 else None

    def missing(_fd: int, _operation: int) -> None:
        raise OSError(code, os.strerror(code))

    code = NO_LOCKS[number // 2 % len(NO_LOCKS)]
    replay = str(CONFIGS / "paper-replay.yaml")
    with mock.patch.object(fcntl, "flock", missing):
        if study is not None:
            assert StudyFolder(study).holder() is None
            assert StudyFolder(study).read_stage("screen")["runs_used"] == 12
        result = CliRunner().invoke(app, ["screen", replay, "--out", str(folder / "new")])
        assert result.exit_code == 1 and "cannot lock files" in result.stderr, result.stderr
        assert str(folder / "new") in result.stderr and "--out" in result.stderr, result.stderr
        assert not list((folder / "new").glob("screen.*"))


SLOW = {
    "a nested pattern": ("regex", r"(?P<y>(a+)+)$", "a" * 40 + "!"),
    "alternatives": ("regex", r"^(?P<y>(a|a)*)b", "a" * 40),
    "five stars": ("regex", r"(?P<y>a*a*a*a*a*a*)b", "a" * 3000),
    "130 MB of JSON": ("json", "out", None),
}
WRITE = "open('out.txt', 'w').write({text!r})"
WRITE_MUCH = "open('out.txt', 'w').write('{\"out\": [' + ','.join(['[[[{}]]]'] * 14_000_000) + ']}')"


def slow_result(folder: Path, number: int, _rng: random.Random) -> None:
    """A result that takes for ever to read is a time-out, soon after the limit; the next one is read."""
    kind, what, text = list(SLOW.values())[number % len(SLOW)]
    result = f"{{file: out.txt, pattern: '{what}'}}" if kind == "regex" else ""
    result = result or f"{{file: out.txt, path: {what}}}"
    program = WRITE_MUCH if text is None else WRITE.format(text=text)
    began = time.monotonic()
    answer = test_command.solved(folder, program, result=result, limit="6 s" if text is None else "2 s")
    assert time.monotonic() - began < 30.0, f"{time.monotonic() - began:.0f} s"
    assert answer.reason in ("timeout", "bad_result"), f"{answer.reason}: {answer.message}"
    assert answer.reason == "timeout" or text is None, answer.message
    again = test_command.solved(
        folder / "again",
        "open('out.txt', 'w').write('F = 12.5')",
        result="{file: out.txt, pattern: 'F = (.*)'}",
    )
    assert again.ok and again.response == 12.5, again


SETTINGS = (
    *("yield_stress=-5", "yield_stress=0", "failure_strain=-0.1", "elastic_modulus=-1e3", "strain_rate_c=-90"),
    *("elastic_modulus=1e300", "yield_stress=nan", "yield_stress=inf", "yield_stress=-inf", "elastic_modulus=0.1"),
    *("yield_stress=1e999", "yield_stress=", "yield_stress", "=5", "yield_stress=-", "yield_stress=18 mm"),
)


def set_value(_folder: Path, number: int, _rng: random.Random) -> None:
    """A value that no material has is refused before anything is simulated, and named."""
    setting = SETTINGS[number % len(SETTINGS)]
    began = time.monotonic()
    result = CliRunner().invoke(app, ["simulate", str(CONFIGS / "smoke.yaml"), "--set", setting])
    assert result.exit_code == 2 and "internal" not in result.stderr, result.stderr
    assert setting.partition("=")[0] in result.stderr, result.stderr
    assert time.monotonic() - began < 10.0


def many_factors(_folder: Path, number: int, rng: random.Random) -> None:
    """A hundred factors are screened; one more is told, in a line."""
    count = (101, 100, 102, 150, 1000, 48)[number % 6]
    factors = "\n".join(f"  - {{name: p{i}, low: 1, high: {rng.uniform(1.5, 3):g}}}" for i in range(count))
    text = f"name: many\nfactors:\n{factors}\ntargets: [{{diameter: 8 mm, force: 9 N}}]\n"
    text += "solver: {kind: sheet, file: many.csv}\n"
    _folder.mkdir(parents=True, exist_ok=True)
    (_folder / "many.csv").write_text("run,p0,force\nscreen,1,2\n", encoding="utf-8")
    if count <= 100:
        assert len(read_study(text.encode(), _folder / "many.yaml").factors) == count
        return
    try:
        read_study(text.encode(), _folder / "many.yaml")
    except SpecError as refused:
        assert f"there are {count} factors, at most 100 can be" in str(refused) and len(refused.problems) == 1
    else:
        raise AssertionError("they were taken")


def not_a_file(folder: Path, number: int, rng: random.Random) -> None:
    """A folder, a sealed file of something else or an empty file in the place of a record: that run alone again."""
    witness = folder / "witness"
    folder.mkdir(parents=True, exist_ok=True)
    study = finished(folder, "out", witness)
    whole, begun = results(study.path), len(lines(witness))
    key = rng.choice(study.keys())
    path, content = study.record_path(key), study.peek(key)
    path.unlink()
    match number % 4:
        case 0:
            path.mkdir()
            (path / "mine").write_text("kept", encoding="utf-8")
        case 1:
            path.write_text(sealed({**(content or {}), "record_version": 99}), encoding="utf-8")
        case 2:
            path.write_bytes(b"")
        case _:
            path.write_text(sealed({"key": key}), encoding="utf-8")
    assert study.peek(key) is None and study.examine(key)[1]
    finished(folder, "out", witness)
    assert results(study.path) == whole and len(lines(witness)) == begun + 1
    assert number % 4 or list(study.runs.glob("damaged/*/mine")), "what was in the folder is lost"


def _fault(name: str, cause: str, must: str, trial: Any, quick: int, long: int) -> Fault:
    return Fault(name, cause, must, each(trial), quick, long)


FAULTS = (
    _fault(
        "numbers beyond all measure",
        "1e31 to 1.7e308 from a program, in a table, as range, force or diameter in a spec",
        "the run is failed and the rest analysed, or the place is named",
        huge_number,
        6,
        90,
    ),
    _fault(
        "a file system without locks",
        "flock answers ENOLCK, EOPNOTSUPP, ENOSYS or ENOTSUP",
        "refused with the place and a remedy that helps; what only reads still reads",
        no_flock,
        4,
        16,
    ),
    _fault(
        "results that take for ever to read",
        "three patterns whose effort explodes, 130 MB of nested JSON",
        "a time-out soon after the limit; the next result is read",
        slow_result,
        1,
        12,
    ),
    _fault(
        "levels that no material has",
        "sixteen values by `--set`: negative, zero, 1e300, NaN, empty, with another unit",
        "refused at once, the factor named",
        set_value,
        len(SETTINGS),
        2 * len(SETTINGS),
    ),
    _fault(
        "more factors than can be screened",
        "48 to 1000 factors",
        "up to 100 are taken, more are told in one line",
        many_factors,
        6,
        30,
    ),
    _fault(
        "something else in the place of a record",
        "a folder, an empty file, a sealed file of another version or content",
        "seen, set aside whole, its run alone computed again, same tables",
        not_a_file,
        4,
        16,
    ),
)
