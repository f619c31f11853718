"""Specs and versions that change in mid-study."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

from fakes import FakeSolver, lines, make_study
from of_processes import POINTS, results
from tally import Fault, each

from stemcal import workflow
from stemcal.errors import StemcalError
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.stages.fresh import changes_since
from stemcal.study.model import Study
from stemcal.study.reading import load_study

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


def changed(folder: Path, number: int, rng: random.Random) -> None:
    """A spec or version changed in mid-study: what comes out is what a new study gives, and the change is named."""
    what = list(CHANGES)[(9 + 4 * number) % len(CHANGES)]
    old, new = CHANGES[what]
    study, version = make_study(folder, POINTS), 2 if what == "the solver's version" else 1
    out, witness = StudyFolder(folder / "out"), folder / "witness"
    _perhaps_half(study, out, rng)
    begun_before = set(out.keys())
    (folder / "known.yaml").write_text(
        (folder / "known.yaml").read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8"
    )
    other = load_study(folder / "known.yaml")
    solver = FakeSolver(witness, version=version)
    if out.has_stage("validate") and what not in ("the title",):
        stages = [name for name in ("screen", "rsm", "invert", "validate") if changes_since(other, solver, out, name)]
        assert stages, f"{what} changed and no stage is stale"
    fresh = StudyFolder(folder / "fresh")
    expected = _outcome(other, fresh, FakeSolver(version=version))
    assert _outcome(other, out, solver) == expected, f"{what} changed: something stale was used"
    assert results(out.path) == results(fresh.path), f"{what} changed: the tables are not those of a new study"
    if what in UNTOUCHED and len(begun_before) > 20:
        assert len(lines(witness)) == len(set(out.keys()) - begun_before), f"{what} changed: runs done again"


def _perhaps_half(study: Study, out: StudyFolder, rng: random.Random) -> None:
    """Take a study through all of its stages or some."""
    solver, executor = FakeSolver(), InlineExecutor()
    if rng.random() < 0.5:
        workflow.calibrate(study, out, executor, solver=solver)
        return
    workflow.run_stage("screen", study, out, executor, solver=solver)
    if rng.random() < 0.5:
        workflow.run_stage("rsm", study, out, executor, solver=solver)


def _outcome(study: Study, folder: StudyFolder, solver: FakeSolver) -> Any:
    try:
        return workflow.calibrate(study, folder, InlineExecutor(), solver=solver).to_json()
    except StemcalError as error:
        return str(error)


FAULTS = (
    Fault(
        "spec or version changed in mid-study",
        "one of eleven changes, after a part or the whole of a study",
        "the tables of a new study, byte for byte; the stale stages named; no run done again that still fits",
        each(changed),
        3,
        44,
    ),
)
