"""The closed loop over three diameters, on forces that no quadratic fits."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import workflow
from fakes import TWO_FACTORS, FakeSolver

from stemcal.errors import RunsFailed
from stemcal.report.outcome import tables_of
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.refine.steps import SHRINK, SurfaceSteps, Trial
from stemcal.stages.result import read_result
from stemcal.stages.rsm.result import RsmResult
from stemcal.study.reading import load_study

SPEC = (
    TWO_FACTORS
    + """\
rsm: {factors: [yield_stress, failure_strain], centre_points: 1}
invert: {diameters: all}
"""
)


def force(a: float, b: float, diameter: float) -> float:
    """F = 100·exp(0.6a)·(d/8)^(2 + 0.5b): b is the growth with the diameter."""
    return 100.0 * math.exp(0.6 * a) * (diameter / 8.0) ** (2.0 + 0.5 * b)


@dataclass(frozen=True)
class Curved(FakeSolver):
    """Answers `force`; with `travels` also a travel of exp(0.3b) mm; fails in these rows of the refining."""

    fails: frozenset[int] = field(default_factory=frozenset)
    travels: bool = False

    def solve(self, request: Request) -> Answer:
        if request.stage == "refine" and request.row in self.fails and request.condition > 9.0:
            return Answer("failed", reason="inverted", message="element 3 turned inside out")
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        details = {"peak_travel": math.exp(0.3 * b)} if self.travels else {}
        return Answer("ok", response=force(a, b, request.condition), details=details)


def refined(
    tmp_path: Path,
    refine: str,
    truth: tuple[float, float] = (0.5, -0.4),
    bias: tuple[float, ...] = (1.0, 1.0, 1.0),
    solver: FakeSolver | None = None,
    spec: str = SPEC,
    travel: bool = False,
) -> tuple[dict[str, Any], StudyFolder]:
    """Close the loop on forces measured at `truth`, times `bias`."""
    path, folder, solver = tmp_path / "closing.yaml", StudyFolder(tmp_path / "out"), solver or Curved()
    more = (
        f", travel: {math.exp(0.3 * truth[1]):.9f} mm, sd: {{force: 3 N, travel: 0.01 mm}}" if travel else ", sd: 3 N"
    )
    forces = "".join(
        f"    - {{diameter: {d} mm, force: {part * force(*truth, d):.9f} N, n: 6{more}}}\n"
        for d, part in zip((7, 8, 10), bias, strict=True)
    )
    path.write_text(f"{spec}refine: {refine}\ntargets:\n{forces}", encoding="utf-8")
    study = load_study(path)
    workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=solver)
    workflow.run_stage("invert", study, folder, solver=solver)
    return workflow.run_stage("refine", study, folder, InlineExecutor(), solver=solver).to_json(), folder


def test_ends_when_every_diameter_is_within_the_tolerance(tmp_path: Path) -> None:
    """The surfaces alone were off; at the end a = 0.5, b = −0.4 again: 17.5 MPa, 0.022."""
    stage, folder = refined(tmp_path, "{tolerance_percent: 0.01, budget: 60}")
    assert max(abs(row["measured"] / row["before"] - 1.0) for row in stage["rows"]) > 0.003
    assert stage["converged"] and stage["stopped"] == "tolerance" and stage["max_abs_error_percent"] <= 0.01
    assert stage["parameters"]["yield_stress"] == pytest.approx(17.5, rel=2e-3)
    assert stage["parameters"]["failure_strain"] == pytest.approx(0.022, rel=2e-3)
    assert len(stage["runs"]) <= 24 and [row["condition"] for row in stage["rows"]] == [7.0, 8.0, 10.0]
    header, *lines = (folder.path / "refine.csv").read_text("utf-8").splitlines()
    assert "diameter" in header.split(",") and len(lines) == 3
    assert "Diameter, mm" in tables_of(RefineResult.from_json(stage))[0].heads
    keys, study = folder.keys(), load_study(tmp_path / "closing.yaml")
    again = workflow.run_stage("refine", study, folder, InlineExecutor(), solver=Curved()).to_json()
    assert again == stage and folder.keys() == keys


def test_settles_where_no_parameters_do_better(tmp_path: Path) -> None:
    """7 and 10 mm measured 5 % high, 8 mm 5 % low: no a, b fit; the end is the weighted least-squares fit.

    Its gradient vanishes: moving a or b by a little either way raises the misfit of the fit.
    """
    stage, folder = refined(tmp_path, "{tolerance_percent: 0.1, budget: 90}", bias=(1.05, 0.95, 1.05))
    assert stage["stopped"] == "settled" and not stage["converged"] and stage["notes"][0]["kind"] == "not_reached"
    measured = (7, 8, 10)
    study = load_study(tmp_path / "closing.yaml")
    steps = SurfaceSteps(study, read_result(folder, RsmResult), read_result(folder, InvertResult))
    assert set(steps.first().predicted) == {7.0, 8.0, 10.0}

    def misfit(a: float, b: float) -> float:
        point = np.array([a, b])
        return steps._missed(Trial(point, np.array([force(a, b, d) for d in measured])))

    at = stage["parameters"]
    a, b = (at["yield_stress"] - 15.0) / 5.0, (at["failure_strain"] - 0.03) / 0.02
    for da, db in ((0.02, 0.0), (-0.02, 0.0), (0.0, 0.05), (0.0, -0.05)):
        assert misfit(a + da, b + db) > misfit(a, b)


def test_a_spent_budget_ends_it(tmp_path: Path) -> None:
    """Seven runs are two rounds of three."""
    stage, _ = refined(tmp_path, "{tolerance_percent: 1e-9, budget: 7}")
    assert stage["stopped"] == "budget" and len(stage["runs"]) == 6


def test_the_first_point_is_the_joint_solution_with_its_intervals(tmp_path: Path) -> None:
    stage, folder = refined(tmp_path, "{budget: 3}")
    invert = folder.read_stage("invert")
    predicted = [run["predicted"] for run in stage["runs"]]
    assert predicted == pytest.approx([row["predicted"] for row in invert["joint"]["rows"]])
    assert {run["condition"] for run in stage["runs"]} == {7.0, 8.0, 10.0}
    result = RefineResult.from_json(stage)
    for run, made in zip(stage["runs"], result.trial_runs, strict=True):
        low, high = run["prediction_interval"]
        assert made.inside_interval == (low <= run["response"] <= high)
    outside = [run.condition for run in result.trial_runs if not run.inside_interval]
    assert bool(outside) == ("first_outside" in [note["kind"] for note in stage["notes"]])


def test_a_failed_run_at_one_diameter_is_stepped_back_from(tmp_path: Path) -> None:
    stage, _ = refined(tmp_path, "{tolerance_percent: 0.01, budget: 60}", solver=Curved(fails=frozenset({1})))
    assert [run["status"] for run in stage["runs"][3:6]] == ["ok", "ok", "failed"]
    assert stage["runs"][6]["how"] == "back" and stage["converged"]


def test_only_failures_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(RunsFailed, match=r"failed at every simulated point \(6 runs"):
        refined(tmp_path, "{budget: 6}", solver=Curved(fails=frozenset(range(9))))


def test_responses_are_met_too(tmp_path: Path) -> None:
    spec = SPEC.replace("diameters: all", "diameters: all, responses: [force, travel]")
    stage, _ = refined(
        tmp_path, "{tolerance_percent: 0.01, budget: 60}", solver=Curved(travels=True), spec=spec, travel=True
    )
    travels = [row for row in stage["rows"] if row["response"] == "travel"]
    assert travels[-1]["after"] == pytest.approx(math.exp(-0.12), rel=2e-3) and stage["converged"]


@dataclass(frozen=True)
class Forgetful(Curved):
    """Gives no travel in the runs of the refinement, as records of another version."""

    def solve(self, request: Request) -> Answer:
        answer = super().solve(request)
        return replace(answer, details={}) if request.stage == "refine" else answer


def test_records_without_the_travel_are_reported(tmp_path: Path) -> None:
    spec = SPEC.replace("diameters: all", "diameters: all, responses: [force, travel]")
    with pytest.raises(RunsFailed, match="the records do not contain all fitted responses"):
        refined(tmp_path, "{budget: 6}", solver=Forgetful(travels=True), spec=spec, travel=True)


@pytest.mark.parametrize(
    ("misfits", "reach"),
    [([10.0], 1.0), ([10.0, 4.9], 1.0), ([10.0, 9.0], 0.5), ([10.0, 12.0], 0.5), ([10.0, 4.0, 3.0], 0.5)],
)
def test_the_box_shrinks_unless_the_last_step_halved_the_misfit(misfits: list[float], reach: float) -> None:
    steps: Any = SimpleNamespace(trials=misfits, best=min(misfits), _missed=lambda misfit: misfit)
    assert SurfaceSteps.shrunk(steps, 1.0) == reach and SHRINK == 0.5
