"""Replicates and lost terms, from the spec to the files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import workflow
from fakes import FakeSolver, force, make_study

from stemcal.errors import RunsFailed
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.rsm.profiler import profiler_data
from stemcal.stages.rsm.result import RsmResult

TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"
REPLICATES = "solver: {kind: embedded, replicates: 4}\n"


@dataclass(frozen=True)
class Scattered(FakeSolver):
    """The known force with a scatter over the replicates of a point; may fail in rows."""

    fails: frozenset[int] = frozenset()

    def identity(self, request: Request) -> dict[str, Any]:
        return {**super().identity(request), "replicate": request.replicate}

    def solve(self, request: Request) -> Answer:
        if request.stage == "rsm" and request.row in self.fails:
            return Answer("failed", reason="inverted", message="element 3 turned inside out")
        apart = np.random.default_rng([request.row, request.replicate]).standard_normal()
        return Answer("ok", response=force(dict(request.levels), request.condition) + 0.5 * apart)


def fitted(tmp_path: Path, solver: FakeSolver, more: str = "") -> dict[str, Any]:
    study = make_study(tmp_path, TWO + more)
    return workflow.run_stage("rsm", study, StudyFolder(tmp_path / "out"), InlineExecutor(), solver=solver).to_json()


def rows_of(stage: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {row["source"]: row for row in stage["anova"]}


def test_replicates_become_pure_error(tmp_path: Path) -> None:
    """Nine points of four replicates: 9·3 df of pure error, and a lack of fit that can be tested."""
    stage = fitted(tmp_path, Scattered(), REPLICATES)
    runs = stage["design"]["runs"]
    points = np.array([run["response"] for run in runs]).reshape(4, 9)  # the whole design once after the other
    pure = rows_of(stage)["Pure error"]
    assert pure["df"] == 27
    assert pure["sum_of_squares"] == pytest.approx(float(np.sum((points - points.mean(axis=0)) ** 2)))
    assert stage["lack_of_fit_testable"] and rows_of(stage)["Lack of fit"]["p"] is not None
    assert stage["pure_error"]["kind"] == "scatter" and "(27 degrees of freedom)" in stage["pure_error"]["text"]
    again = RsmResult.from_json(stage).fitted
    assert again.beta == pytest.approx([row["value"] for row in stage["coefficients"]])


def test_terms_that_failed_runs_made_inestimable_end_the_fit(tmp_path: Path) -> None:
    """The four axial runs fail."""
    solver = Scattered(fails=frozenset({4, 5, 6, 7}))
    with pytest.raises(RunsFailed, match=r"yield_stress\^2, failure_strain\^2 cannot be estimated"):
        fitted(tmp_path, solver)


@pytest.mark.parametrize(
    ("extra", "centres", "first"), [("", [100.0], 0), ("invert: {diameters: all}\n", [76.5625, 100.0, 156.25], 1)]
)
def test_the_profiler_begins_with_the_calibration_diameter(
    tmp_path: Path, extra: str, centres: list[float], first: int
) -> None:
    """At the centre F = 100·(d/8)² at 7, 8 and 10 mm."""
    study, folder = make_study(tmp_path, TWO + extra), StudyFolder(tmp_path / "out")
    workflow.run_stage("screen", study, folder, InlineExecutor(), solver=FakeSolver())
    found: Any = workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=FakeSolver())
    data = profiler_data(study, found, {}, True)
    assert [each["beta"][0] for each in data["surfaces"]] == pytest.approx(centres, rel=1e-3)
    assert (data["first"], data["more"], data["called"], data["holds"]) == (first, 0, "Centre", True)
    assert [one["at"] for one in data["factors"]] == pytest.approx([15.0, 0.03])
    assert [one["simulate"] for one in data["surfaces"]][first] == "stemcal simulate SPEC --diameter 8"
