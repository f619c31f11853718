"""Studies whose results have no number where others have one: they are reported, with what there is."""

from dataclasses import dataclass
from pathlib import Path

import pytest
import workflow
from fakes import SpecSolver, make_study

from stemcal.report.page.page import page_content, render
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.model.study import Study
from stemcal.study.types.solver_kind import SOLVERS


@dataclass(frozen=True)
class LevelSolver(SpecSolver):
    """Every run gives the same force."""

    def solve(self, request: Request) -> Answer:
        """Answer 100 N."""
        return Answer("ok", response=100.0)


def reported(study: Study, solver: SpecSolver, folder: StudyFolder, monkeypatch: pytest.MonkeyPatch) -> str:
    """Take a study through all stages, draw every figure and return the page."""
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _: solver)
    workflow.calibrate(study, folder, InlineExecutor(), solver=solver)
    what = page_content(study, folder)
    assert not what.results.stale and len(list(what.results.done)) == 4
    assert all(plot.figure for plot in what.plots if not plot.on_page)
    return render(what)


def test_two_diameters_have_a_power_law_without_an_interval(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = make_study(tmp_path)
    targets = study.targets.model_copy(update={"means": study.targets.means[:2]})
    two = study.model_copy(update={"targets": targets})
    page = reported(two, SpecSolver(), StudyFolder(tmp_path / "s"), monkeypatch)
    assert "The measured force increases with diameter d as d^2.00, and the simulated force as d^2.00." in page


def test_a_saturated_surface_has_no_standard_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    extra = "rsm: {design: latin-hypercube, runs: 6, factors: [yield_stress, failure_strain]}\n"
    page = reported(make_study(tmp_path, extra), SpecSolver(), StudyFolder(tmp_path / "s"), monkeypatch)
    assert "so its error cannot be estimated" in page and "Infinity" not in page


def test_equal_forces_leave_nothing_to_explain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = make_study(tmp_path)
    forces = tuple(target.model_copy(update={"response": 100.0}) for target in study.targets.means)
    level = study.model_copy(update={"targets": study.targets.model_copy(update={"means": forces})})
    page = reported(level, LevelSolver(), StudyFolder(tmp_path / "s"), monkeypatch)
    assert "All runs have the same response" in page
