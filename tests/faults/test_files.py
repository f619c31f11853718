"""Files that are not what they were, clocks that jump, file systems without locks, specs changed in mid-study."""

import errno
import os
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import workflow
from fakes import FakeSolver, lines, make_study
from trying import CONFIGS, POINTS, POSIX, command, finished, results, trials

from stemcal.errors import StemcalError
from stemcal.overview.status import inspect, stage_states
from stemcal.report.export import study_tables
from stemcal.runs import study_folder as module_of_folders
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.fresh import changes_since
from stemcal.stages.results import fresh_results
from stemcal.storage.sealed import sealed
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

STAGES = ("screen", "rsm", "invert", "validate")


@trials(1, 15)
def test_the_clock_jumps(folder: Path, _number: int, rng: random.Random) -> None:
    """By years, back and forth, between any two looks at it: same tables, records whole."""

    class Jumping(module_of_folders.datetime):  # type: ignore[misc, valid-type]
        @classmethod
        def now(cls, tz: Any = None) -> Any:
            return cls.fromtimestamp(rng.uniform(0.0, 4e9), tz)

    whole = results(finished(folder, "whole").path)
    with (
        mock.patch.object(module_of_folders, "datetime", Jumping),
        mock.patch("time.time", lambda: rng.uniform(0.0, 4e9)),
    ):
        study = finished(folder)
        finished(folder)
    assert results(study.path) == whole
    assert all(map(study.peek, study.keys()))


@POSIX
@trials(1, 8)
def test_a_file_system_without_locks(folder: Path, number: int, _rng: random.Random) -> None:
    """A study is refused with place and remedy; what only reads still reads."""
    study = finished(folder).path
    code = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.ENOTSUP)[number % 4]
    with mock.patch("fcntl.flock", side_effect=OSError(code, os.strerror(code))):
        assert StudyFolder(study).holder() is None
        assert StudyFolder(study).read_stage("screen")["runs_used"] == 12
        refused = command("screen", CONFIGS / "paper-replay.yaml", "--out", folder / "new")
    assert refused.exit_code == 1 and "on a disk that supports file locks" in " ".join(refused.stderr.split())
    assert str(folder / "new") in refused.stderr and "--out" in refused.stderr
    assert not list((folder / "new").glob("screen.*"))


# ---- stage files sealed anew


@trials(1, 120)
def test_keys_left_out_or_of_another_type(folder: Path, number: int, rng: random.Random) -> None:
    """Four variants each: read, or refused with the path to the key and the command that mends it."""
    study, found = load_study(CONFIGS / "paper-replay.yaml"), StudyFolder(folder / "out")
    workflow.calibrate(study, found, InlineExecutor())
    contents = {name: found.examine_stage(name) for name in STAGES}
    everything = [(name, *variant) for name in STAGES for variant in variants(contents[name])]
    for name, what, content in rng.sample(everything, 4):
        file = found.path / f"{name}.json"
        whole = file.read_bytes()
        file.write_text(sealed(content), encoding="utf-8")
        try:
            inspect(study, found)
            stage_states(study, found)
            study_tables(study, fresh_results(study, found))
        except StemcalError as error:
            assert "SPEC" in str(error), f"{name} {what}: no remedy: {error}"
        file.write_bytes(whole)


def variants(content: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the content with one key missing, of another type, or null."""
    for key in content:
        yield f"{key}: missing", {name: value for name, value in content.items() if name != key}
        yield from ((f"{key}: {other!r}", {**content, key: other}) for other in ("text", 5, None))


# ---- specs and versions that change in mid-study

CHANGES: dict[str, tuple[str, str]] = {
    "a factor's range": ("low: 10, high: 20", "low: 11, high: 20"),
    "another factor's range": ("low: 0.01, high: 0.05", "low: 0.02, high: 0.05"),
    "the calibration target": ("force: 110 N", "force: 105 N"),
    "another diameter's force": ("force: 171.875 N", "force: 160 N"),
    "another diameter": ("diameter: 10 mm", "diameter: 9 mm"),
    "the level of significance": ("targets:", "screen: {alpha: 0.1}\ntargets:"),
    "the calibrated diameter": ("name: known", "name: known\nspecimen: {outer_diameter: 7 mm}"),
    "the number of centre points": ("centre_points: 3", "centre_points: 5"),
    "the rule of the inversion": ("targets:", "invert: {rule: others_at_centre}\ntargets:"),
    "the solver's version": ("", ""),
    "the title": ("name: known", "name: known\ntitle: another"),
}
UNTOUCHED = ("the title", "the level of significance", "another diameter's force", "the rule of the inversion")


@trials(1, 44)
def test_a_change_in_mid_study(folder: Path, number: int, rng: random.Random) -> None:
    """What comes out is what a new study gives, and the stale stages are named; no run is done again that fits."""
    what = list(CHANGES)[(9 + 4 * number) % len(CHANGES)]
    study, version = make_study(folder, POINTS), 2 if what == "the solver's version" else 1
    out, witness = StudyFolder(folder / "out"), folder / "witness"
    perhaps_half(study, out, rng)
    begun_before = set(out.keys())
    spec = folder / "known.yaml"
    spec.write_text(spec.read_text("utf-8").replace(*CHANGES[what], 1), "utf-8")
    other, solver = load_study(spec), FakeSolver(witness, version=version)
    if out.has_stage("validate") and what != "the title":
        assert any(changes_since(other, solver, out, name) for name in STAGES), f"{what}: no stage is stale"
    fresh = StudyFolder(folder / "fresh")
    expected = outcome(other, fresh, FakeSolver(version=version))
    assert outcome(other, out, solver) == expected, f"{what}: something stale was used"
    assert results(out.path) == results(fresh.path), f"{what}: the tables are not those of a new study"
    if what in UNTOUCHED and len(begun_before) > 20:
        assert len(lines(witness)) == len(set(out.keys()) - begun_before), f"{what}: runs done again"


def perhaps_half(study: Study, out: StudyFolder, rng: random.Random) -> None:
    """Take a study through all of its stages or some."""
    solver, executor = FakeSolver(), InlineExecutor()
    if rng.random() < 0.5:
        workflow.calibrate(study, out, executor, solver=solver)
        return
    workflow.run_stage("screen", study, out, executor, solver=solver)
    if rng.random() < 0.5:
        workflow.run_stage("rsm", study, out, executor, solver=solver)


def outcome(study: Study, folder: StudyFolder, solver: FakeSolver) -> Any:
    try:
        return workflow.calibrate(study, folder, InlineExecutor(), solver=solver).to_json()
    except StemcalError as error:
        return str(error)
