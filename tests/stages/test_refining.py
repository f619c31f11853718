"""The closed loop on a force that no quadratic fits."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import workflow
from fakes import FakeSolver, make_study

from stemcal.doe.calibration.search_region import Region
from stemcal.errors import Waiting
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.refine.steps import toward
from stemcal.study.reading import load_study

TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\n"
CONFIGS = Path(__file__).parents[2] / "configs"


@dataclass(frozen=True)
class Curved(FakeSolver):
    """F = 100·exp(0.6a + 0.2b)·(d/8)², a and b coded by the range; fails where told to."""

    fails: frozenset[int] = field(default_factory=frozenset)

    def solve(self, request: Request) -> Answer:
        """Answer, or fail in a row of the refining."""
        if request.stage == "refine" and request.row in self.fails:
            return Answer("failed", reason="inverted", message="element 3 turned inside out")
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        return Answer("ok", response=100.0 * math.exp(0.6 * a + 0.2 * b) * (request.condition / 8.0) ** 2)


def refined(tmp_path: Path, options: str, solver: FakeSolver) -> tuple[dict[str, Any], StudyFolder]:
    study, folder = make_study(tmp_path, TWO + options), StudyFolder(tmp_path / "out")
    workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=solver)
    workflow.run_stage("invert", study, folder, solver=solver)
    return workflow.run_stage("refine", study, folder, InlineExecutor(), solver=solver).to_json(), folder


def test_ends_within_the_tolerance(tmp_path: Path) -> None:
    """110 = 100·exp(0.6a + 0.2b) exactly at the end; the surface alone was off by more."""
    stage, folder = refined(tmp_path, "refine: {tolerance_percent: 0.001}\n", Curved())
    first, last = stage["runs"][0], stage["runs"][-1]
    assert abs(first["response"] / 110.0 - 1.0) > 1e-3 and stage["converged"] and len(stage["runs"]) <= 4
    assert last["response"] == pytest.approx(110.0, rel=1e-5)
    a = (stage["parameters"]["yield_stress"] - 15.0) / 5.0
    b = (stage["parameters"]["failure_strain"] - 0.03) / 0.02
    assert 0.6 * a + 0.2 * b == pytest.approx(math.log(1.1), abs=1e-5)
    (row,) = stage["rows"]
    assert row == {
        "condition": 8.0, "response": "force", "measured": 110.0, "before": first["response"],
        "after": last["response"], "error_percent": pytest.approx(100.0 * (1.0 - last["response"] / 110.0)),
    }  # fmt: skip
    assert not stage["elsewhere"] and stage["in"]["kind"] == make_study(tmp_path, TWO).solver.kind
    assert (folder.path / "refine_runs.csv").read_text("utf-8").count("\n") == len(stage["runs"]) + 1


def test_the_first_point_is_the_solution_of_the_surface(tmp_path: Path) -> None:
    stage, folder = refined(tmp_path, "refine: {budget: 1}\n", Curved())
    invert, first = folder.read_stage("invert"), stage["runs"][0]
    assert [first["levels"][name] for name in invert["parameters"]] == pytest.approx(
        list(invert["parameters"].values())
    )
    assert first["predicted"] == pytest.approx(110.0)
    assert first["prediction_interval"] == pytest.approx(invert["prediction_interval"])


def test_a_failed_run_is_stepped_back_from(tmp_path: Path) -> None:
    stage, _ = refined(tmp_path, "refine: {tolerance_percent: 0.001}\n", Curved(fails=frozenset({0})))
    assert stage["runs"][0]["reason"] == "inverted" and stage["rows"][0]["before"] is None
    assert stage["runs"][1]["how"] == "back" and stage["converged"]


def test_validation_takes_the_refined_parameters(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO + "refine: {tolerance_percent: 0.001}\n")
    folder = StudyFolder(tmp_path / "out")
    stage = workflow.calibrate(study, folder, InlineExecutor(), solver=Curved()).to_json()
    assert stage["parameters"] == folder.read_stage("refine")["parameters"]
    assert [row["error_percent"] for row in stage["rows"]] == pytest.approx([0.0, 0.0, 0.0], abs=2e-3)


def test_a_sheet_is_asked_for_the_solution(tmp_path: Path) -> None:
    study, folder = load_study(CONFIGS / "paper-replay.yaml"), StudyFolder(tmp_path / "out")
    workflow.run_stage("rsm", study, folder, InlineExecutor())
    workflow.run_stage("invert", study, folder)
    with pytest.raises(Waiting, match="waiting for 1 result from the refine stage"):
        workflow.run_stage("refine", study, folder, InlineExecutor())


def test_steps_lead_to_a_level_and_stay_where_a_surface_is_flat() -> None:
    """y = 100 + 20a + 10b: from the centre 110 is nearest at (0.4, 0.2); half of the way in half of the radius."""
    region, start = Region(-np.ones(2), np.ones(2), None), np.zeros(2)

    def surface(slope: list[float]) -> Any:
        rising = np.array(slope)
        return SimpleNamespace(predict=lambda x: np.array([100.0 + rising @ x]), gradient=lambda x: rising)

    assert toward(surface([20.0, 10.0]), 110.0, region, start, 1.0) == pytest.approx([0.4, 0.2])
    # from (0.1, −0.1), where y is 101, by 9/500 of the slope
    beside = toward(surface([20.0, 10.0]), 110.0, region, np.array([0.1, -0.1]), 1.0)
    assert beside == pytest.approx([0.46, 0.08])
    near = toward(surface([20.0, 10.0]), 110.0, region, start, 0.05 * 20**0.5)
    assert near == pytest.approx([0.2, 0.1])
    assert toward(surface([0.0, 0.0]), 110.0, region, np.array([0.3, -0.2]), 1.0).tolist() == [0.3, -0.2]
