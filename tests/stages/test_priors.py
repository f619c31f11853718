"""Priors from the spec to files, verdict and sentences."""

from pathlib import Path

import pytest
import workflow
from fakes import TWO_FACTORS, FakeSolver

from stemcal.report.outcome import shown_notes
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.invert import words
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.vocabulary import Wording

FORCES = """\
targets:
  - {diameter: 8 mm, force: 110 N, sd: 2 N, n: 6}
  - {diameter: 9 mm, force: 140 N, sd: 2 N, n: 6}
rsm: {factors: [yield_stress, failure_strain], centre_points: 2}
"""
STRAIN = "{name: failure_strain, low: 0.01, high: 0.05"


def inverted(folder: Path, prior: str = "", invert: str = "") -> tuple[Study, InvertResult, StudyFolder]:
    """F = (100 + 20a + 8b + 3b² + ab/2)·(d/8)²; both diameters tell the same combination of a and b."""
    text = TWO_FACTORS.replace(STRAIN, f"{STRAIN}{prior}") + FORCES + invert
    path, place = folder / "study.yaml", StudyFolder(folder / "out")
    path.write_text(text, encoding="utf-8")
    study = load_study(path)
    workflow.run_stage("rsm", study, place, InlineExecutor(), solver=OfTwo())
    return study, workflow.run_stage("invert", study, place, solver=OfTwo()), place


class OfTwo(FakeSolver):
    """Answers the known force of two factors."""

    def solve(self, request):  # type: ignore[no-untyped-def]
        levels = {"strain_rate_c": 90.0, "elastic_modulus": 1000.0, **request.levels}
        return super().solve(type(request)(**{**vars(request), "levels": levels}))


PRIOR = ', prior: {mean: 0.04, sd: 0.002, source: "axial tension, n = 12"}'


def test_one_force_and_a_prior_fix_both_parameters(tmp_path: Path) -> None:
    """b = 0.5 by its prior, so 110 = 100 + 20a + 4 + 0.75 + a/4: a = 0.2593, 16.30 MPa."""
    study, free, _ = inverted(tmp_path)
    assert free.certainty is not None and "failure_strain" in free.certainty.free and not free.priors
    study, found, _ = inverted(tmp_path, PRIOR)
    assert found.rule == "joint_least_squares"
    assert list(found.point.solution.values()) == pytest.approx([15 + 5 * 0.2593, 0.04], rel=5e-3)
    known = found.certainty
    assert known is not None and known.free == () and known.not_identified == ()
    assert known.intervals["failure_strain"] == pytest.approx((0.04 - 0.00392, 0.04 + 0.00392), abs=2e-4)
    said = words.uncertainty(known, found, Wording(study.naming))
    assert said[0] == "The prior for failure_strain is 0.04 with a standard deviation of 0.002 (axial tension, n = 12)."


def test_a_prior_that_the_force_contradicts_is_a_reason(tmp_path: Path) -> None:
    """One force and two priors have a degree of freedom: the priors ask for 88 N, measured are 110 ± 0.8 N."""
    weak = "{name: yield_stress, unit: MPa, low: 10, high: 20"
    path = tmp_path / "study.yaml"
    prior = 'prior: {mean: 11, sd: 0.2, source: "compression, Li 2019"}'
    text = (TWO_FACTORS.replace(weak, f"{weak}, {prior}") + FORCES).replace(f"{STRAIN}}}", f"{STRAIN}{PRIOR}}}")
    path.write_text(text, encoding="utf-8")
    study, place = load_study(path), StudyFolder(tmp_path / "out")
    workflow.run_stage("rsm", study, place, InlineExecutor(), solver=OfTwo())
    found = workflow.run_stage("invert", study, place, solver=OfTwo())
    assert found.joint is not None and found.joint.df == 1 and found.joint.p is not None and found.joint.p < 0.001
    assert [row.factor for row in found.priors] == ["yield_stress", "failure_strain"]
    verdict = verdict_of(study, place, Results((found,)))
    (reason,) = (reason for reason in verdict.reasons if reason.kind == "misfit")
    assert reason.severity == "error" and verdict.verdict == "not_calibrated"
    assert "prior for yield_stress" in reason.remedy.text and "compression, Li 2019" in reason.remedy.text


def test_forces_without_scatter_and_a_prior(tmp_path: Path) -> None:
    """Three forces whose misfit tells the scatter, F = 110 N·(d/8)² ± 1 %; the failure strain is the prior's."""
    forces = "".join(
        f"  - {{diameter: {d} mm, force: {110 * (d / 8) ** 2 * off:.4f} N}}\n"
        for d, off in ((7, 1.01), (8, 1.0), (9, 0.99))
    )
    head, tail = "targets:\n", FORCES[FORCES.index("rsm:") :]
    text = TWO_FACTORS.replace(STRAIN, f"{STRAIN}{PRIOR}") + head + forces + tail + "invert: {diameters: all}\n"
    path, place = tmp_path / "study.yaml", StudyFolder(tmp_path / "out")
    path.write_text(text, encoding="utf-8")
    study = load_study(path)
    workflow.run_stage("rsm", study, place, InlineExecutor(), solver=OfTwo())
    found = workflow.run_stage("invert", study, place, solver=OfTwo())
    assert found.joint is not None and found.joint.scatter == "misfit" and (found.joint.p or 0.0) > 0.05
    assert found.point.solution["failure_strain"] == pytest.approx(0.04, abs=5e-4)
    assert found.certainty is not None and found.certainty.free == ()
    assert any(note.kind == "weights" for note in shown_notes(found, True))


def test_a_prior_of_a_factor_that_the_surface_holds_is_told_of(tmp_path: Path) -> None:
    held = "\n  - {name: density, unit: kg/m3, low: 1000, high: 1200, prior: {mean: 1150, sd: 20, source: weighed}}"
    text = (TWO_FACTORS + FORCES).replace("{density: 1100 kg/m3, ", "{").replace("high: 0.05}", f"high: 0.05}}{held}")
    path, place = tmp_path / "study.yaml", StudyFolder(tmp_path / "out")
    path.write_text(text, encoding="utf-8")
    study = load_study(path)
    workflow.run_stage("rsm", study, place, InlineExecutor(), solver=OfTwo())
    found = workflow.run_stage("invert", study, place, solver=OfTwo())
    assert "prior_unused" in [note.kind for note in found.notes] and found.parameters["density"] == 1100.0
