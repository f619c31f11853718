"""The climb towards the target, and the design centred on its best step."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import workflow
from fakes import FakeSolver, make_study

from stemcal.errors import UsageError, Waiting
from stemcal.report.export import study_tables
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import Outcome
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Request
from stemcal.stages.climb.analysis import ascent_path, later
from stemcal.stages.climb.result import ClimbResult, ClimbRow
from stemcal.stages.climb.showing import ClimbShowing
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import Head, read_result
from stemcal.stages.results import Results
from stemcal.storage.rows import Rows
from stemcal.study.reading import load_study
from stemcal.vocabulary import CUTTING, Wording

CONFIGS = Path(__file__).parents[2] / "configs"
TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\n"


def climbed(tmp_path: Path, options: str) -> tuple[dict[str, Any], StudyFolder]:
    study, folder = make_study(tmp_path, TWO + options), StudyFolder(tmp_path / "out")
    workflow.run_stage("screen", study, folder, InlineExecutor(), solver=FakeSolver())
    return workflow.run_stage("climb", study, folder, InlineExecutor(), solver=FakeSolver()).to_json(), folder


def test_path_goes_along_the_slope_either_way() -> None:
    up, down = (ascent_path([40.0, 16.0, -8.0], 4, rise) for rise in (True, False))
    assert up[-1] == pytest.approx([1.0, 0.4, -0.2]) and np.allclose(down, -up)
    assert np.allclose(np.diff(up, axis=0), up[1])
    with pytest.raises(UsageError, match="the direction is undefined"):
        ascent_path([0.0, 0.0], 3, True)


def test_stops_once_the_target_is_passed(tmp_path: Path) -> None:
    """F = 100 + 20a + 8b + 3b² + ab/2 with b = 0.4·a (effects 40 and 16): a of 0, 0.2, 0.4, 0.6 gives
    100, 104.68, 109.48, 114.4; the target is 110.
    """
    stage, _ = climbed(tmp_path, "climb: {steps: 5}\n")
    forces = [row["response"] for row in stage["rows"]]
    expected = [100 + 20 * a + 3.2 * a + 0.48 * a * a + 0.2 * a * a for a in (0.0, 0.2, 0.4, 0.6)]
    assert forces == pytest.approx(expected, abs=1e-6)
    assert stage["best_step"] == 2 and stage["passed"]
    nearest = stage["notes"][0]
    assert nearest["kind"] == "nearest_step" and f"{stage['error_percent']:.1f} % too low)" in nearest["text"]
    assert stage["error_percent"] == pytest.approx(100 * (110 - expected[2]) / 110)
    assert stage["solution"]["yield_stress"] == pytest.approx(17.0)


def test_the_design_is_centred_on_the_best_step_and_stays_in_the_ranges(tmp_path: Path) -> None:
    """Half of the range of 10 MPa about 17 MPa: 14.5 to 19.5 MPa."""
    stage, folder = climbed(tmp_path, "climb: {steps: 5}\n")
    study = make_study(tmp_path, TWO + "climb: {steps: 5}\n")
    surface = workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=FakeSolver()).to_json()
    levels = [run["levels"]["yield_stress"] for run in surface["design"]["runs"]]
    assert (min(levels), max(levels)) == pytest.approx((14.5, 19.5))
    assert surface["coding"]["yield_stress"]["center"] == pytest.approx(stage["coding"]["yield_stress"]["center"])
    solution = workflow.run_stage("invert", study, folder, solver=FakeSolver()).to_json()
    assert solution["coded_radius"] < 0.1 and solution["predicted"] == pytest.approx(110.0)


def test_out_of_reach_keeps_the_design_inside(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO + "climb: {steps: 2}\n")
    forces = tuple(t.model_copy(update={"response": 300.0}) for t in study.targets.means)
    study = study.model_copy(update={"targets": study.targets.model_copy(update={"means": forces})})
    folder = StudyFolder(tmp_path / "out")
    workflow.run_stage("screen", study, folder, InlineExecutor(), solver=FakeSolver())
    stage = workflow.run_stage("climb", study, folder, InlineExecutor(), solver=FakeSolver()).to_json()
    assert not stage["passed"] and stage["best_step"] == 2
    assert "target_not_passed" in [note["kind"] for note in stage["notes"]]
    entry = stage["coding"]["yield_stress"]
    assert entry["center"] + 2**0.5 * entry["half_step"] == pytest.approx(20.0)


def test_part_of_a_whole_study(tmp_path: Path) -> None:
    study, folder = make_study(tmp_path, TWO + "climb: {steps: 5}\nrefine: {}\n"), StudyFolder(tmp_path / "out")
    workflow.calibrate(study, folder, InlineExecutor(), solver=FakeSolver())
    assert folder.read_stage("refine")["converged"] and folder.has_stage("climb")
    steps, loop = read_result(folder, ClimbResult), read_result(folder, RefineResult)
    published = study_tables(study, Results((steps, loop)))
    assert [table.title for table in published][:2] == ["Factors", "Steps towards the target"]
    assert len(published[1].rows) == len(steps.rows) == 4  # until the target is passed
    assert loop.trial_runs[-1].outcome.response in published[-1].rows[-1]


def test_a_sheet_is_asked_for_the_path(tmp_path: Path) -> None:
    study, folder = load_study(CONFIGS / "paper-replay.yaml"), StudyFolder(tmp_path / "out")
    workflow.run_stage("screen", study, folder, InlineExecutor())
    with pytest.raises(Waiting, match="waiting for 1 result from the climb stage"):
        workflow.run_stage("climb", study, folder, InlineExecutor())


CLIMB = ClimbResult(
    head=Head(2, "climb", "known"),
    target=159.2,
    condition=8.0,
    names=("a", "b"),
    rows=Rows(ClimbRow(step, {"a": 1.0}, {"a": 0.0}, 10.0 - step, Outcome(response=150.0)) for step in range(4)),
    best_step=2,
    passed=True,
    solution={"a": 1.0},
    error_percent=-1.26,
    coding={},
)


def test_a_climb_that_passed_the_target() -> None:
    assert ClimbShowing().outcome(CLIMB, Wording(CUTTING, {"a": "Stress"})) == [
        "During steepest ascent, stress and b were changed together in 4 runs.",
        "The response passed the target. The smallest error (1.3 %) was obtained at step 2.",
    ]


def test_a_climb_that_ended_at_the_edge() -> None:
    short = replace(CLIMB, passed=False)
    assert ClimbShowing().outcome(short, Wording())[1].startswith("The response did not reach the target. ")


def test_half_of_the_steps_are_usual_and_the_centre_is_a_run_more(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO + "climb: {steps: 5}\n")
    found = later(study)
    assert found is not None and later(make_study(tmp_path, TWO)) is None
    assert found.rounds == [[Request("climb", 0, study.midlevels(), 8.0)]] * 2
    assert "at most 6 additional runs" in found.note.text
