"""Advice on doubtful physics tried with the embedded solver: two coarse studies, before and after the advice."""

from pathlib import Path

import pytest
from edits import merged

import stemcal
from stemcal import workflow
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.note import Note
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.rules import verdict_of
from stemcal.study.reading import load_study

SPEC = """\
name: tried
factors:
  - {name: yield_stress, unit: MPa, low: 10, high: 24}
  - {name: failure_strain, low: 0.02, high: 0.05}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05, strain_rate_c: 90 1/s, strain_rate_p: 8, internal_length: d/4.5}
blade: {edge_spread: d/6}
specimen: {length: 30 mm}
loading: {duration: 1 s}
solver: {kind: embedded, SOLVER, outputs: 200}
targets:
  - {diameter: 7 mm, force: SEVEN N}
  - {diameter: 8 mm, force: EIGHT N}
rsm: {factors: [yield_stress, failure_strain], centre_points: 1}
refine: {tolerance_percent: 2, budget: 3}
"""
TRUTH = {"yield_stress": 16.0, "failure_strain": 0.035}


def spec_of(path: Path, solver: str, forces: tuple[float, float] = (100.0, 130.0)) -> Path:
    text = SPEC.replace("SOLVER", solver)
    path.write_text(text.replace("SEVEN", f"{forces[0]:.2f}").replace("EIGHT", f"{forces[1]:.2f}"), encoding="utf-8")
    return path


def measured_by(path: Path, solver: str) -> tuple[float, float]:
    """Return the forces at 7 and 8 mm that these settings give at a known truth."""
    study = load_study(spec_of(path, solver))
    seven, eight = (stemcal.simulate(study, diameter=d, **TRUTH).peak_force for d in (7.0, 8.0))
    return seven, eight


def judged(folder: Path, solver: str, forces: tuple[float, float]) -> Verdict:
    folder.mkdir()
    study, place = load_study(spec_of(folder / "tried.yaml", solver, forces)), StudyFolder(folder / "out")
    workflow.calibrate(study, place, InlineExecutor())
    return verdict_of(study, place)


def doubtful(verdict: Verdict, about: str) -> Note | None:
    """Return the reason about the runs' physics whose text has some words."""
    found = [reason for reason in verdict.reasons if reason.kind == "physics" and about in reason.text]
    return found[0] if found else None


def advised(folder: Path, before: Note | None, forces: tuple[float, float], solver: str) -> Verdict:
    """Return the verdict of the study with the remedy's edit."""
    assert before is not None and before.remedy is not None
    folder.mkdir()
    path = spec_of(folder / "tried.yaml", solver, forces)
    path.write_text(merged(path.read_text(encoding="utf-8"), before.remedy.edit), encoding="utf-8")
    study, place = load_study(path), StudyFolder(folder / "out")
    workflow.calibrate(study, place, InlineExecutor())
    return verdict_of(study, place)


@pytest.mark.slow
def test_a_stem_too_heavy_and_after_the_advice(tmp_path: Path) -> None:
    """Kinetic energy above its limit in every run; with the mass and the time step advised in one at most."""
    forces = measured_by(tmp_path / "light.yaml", "element_size: d/12, mass_scaling: 1e4, time_step: 20 us")
    heavy = "element_size: d/12, mass_scaling: 4e5, time_step: 160 us"
    before = judged(tmp_path / "before", heavy, forces)
    assert before.verdict == "not_calibrated"
    after = advised(tmp_path / "after", doubtful(before, "inertia"), forces, heavy)
    assert after.verdict != "not_calibrated"
    left = doubtful(after, "inertia")
    assert left is None or left.text.startswith("The physics of 1 of")


@pytest.mark.slow
def test_a_mesh_that_folds_and_after_the_advice(tmp_path: Path) -> None:
    """Hourglass energy above its limit in most runs of a coarse mesh; the finer one of the advice has less of it."""
    coarse = "element_size: d/10, mass_scaling: 1e4, time_step: 30 us"
    forces = measured_by(tmp_path / "fine.yaml", "element_size: d/16, mass_scaling: 1e4, time_step: 20 us")
    before = judged(tmp_path / "before", coarse, forces)
    reason = doubtful(before, "hourglass")
    assert before.verdict == "not_calibrated" and reason is not None
    after = advised(tmp_path / "after", reason, forces, coarse)
    assert after.verdict != "not_calibrated"
