"""Phases and lost terms, from the spec to the files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fakes import FakeSolver, force, make_study

from stemcal import workflow
from stemcal.errors import RunsFailed
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.surface.result import SurfaceResult

TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1OPTIONS}\n"
PHASES = "solver: {kind: embedded, phases: 4, symmetry: half}\n"


@dataclass(frozen=True)
class Phased(FakeSolver):
    """The known force as the mean of four phases, their scatter growing with the yield stress; may fail in rows."""

    fails: frozenset[int] = frozenset()

    def solve(self, request: Request) -> Answer:
        if request.stage == "rsm" and request.row in self.fails:
            return Answer("failed", reason="inverted", message="element 3 turned inside out")
        mean = force(dict(request.levels), request.condition)
        random = np.random.default_rng(request.row)
        peaks = mean + (0.5 + 0.1 * (request.levels["yield_stress"] - 10.0)) * random.standard_normal(4)
        sd = float(peaks.std(ddof=1))
        return Answer("ok", response=float(peaks.mean()), details={"phase_peaks": peaks.tolist(), "peak_sd": sd})


def fitted(tmp_path: Path, options: str, solver: FakeSolver, more: str = PHASES) -> dict[str, Any]:
    study = make_study(tmp_path, TWO.replace("OPTIONS", options) + more)
    return workflow.fit_surface(study, StudyFolder(tmp_path / "out"), InlineExecutor(), solver=solver).to_json()


def rows_of(stage: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {row["source"]: row for row in stage["anova"]}


def test_phases_become_pure_error(tmp_path: Path) -> None:
    """Nine runs of four phases: (9 − 1)·(4 − 1) df of pure error, and a lack of fit that can be tested."""
    stage = fitted(tmp_path, "", Phased())
    runs = stage["design"]["runs"]
    assert all(run["phases"] == 4 and run["sd"] > 0.0 for run in runs)
    pure = rows_of(stage)["Pure error"]
    apart = np.array([run["phase_responses"] for run in runs]) - np.array([[run["response"]] for run in runs])
    left = float(np.sum((apart - apart.mean(axis=0)) ** 2)) / 4.0
    assert pure["df"] == 24 and pure["sum_of_squares"] == pytest.approx(left)
    assert stage["lack_of_fit_testable"] and rows_of(stage)["Lack of fit"]["p"] is not None
    assert stage["pure_error"] == {"kind": "scatter_of_places", "weight": "trust", "places": 4}
    again = SurfaceResult.from_json(stage).fitted
    assert again.df in (3, 24) and again.beta == pytest.approx([row["value"] for row in stage["coefficients"]])


def test_terms_that_failed_runs_made_inestimable_end_the_fit(tmp_path: Path) -> None:
    """The four axial runs fail."""
    solver = Phased(fails=frozenset({4, 5, 6, 7}))
    with pytest.raises(RunsFailed, match=r"cannot estimate yield_stress\^2, failure_strain\^2; repair those runs"):
        fitted(tmp_path, "", solver)
