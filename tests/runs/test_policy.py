"""What the spec says about failed runs is what happens."""

import time
from pathlib import Path
from typing import Any

import pytest
import workflow
from fakes import FakeSolver, lines, make_study

from stemcal.errors import RunsFailed
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.executors.local import LocalExecutor
from stemcal.runs.study_folder import StudyFolder


@pytest.fixture
def folder(tmp_path: Path) -> StudyFolder:
    return StudyFolder(tmp_path / "out")


def screen(tmp_path: Path, folder: StudyFolder, solver: FakeSolver, runs: str = "", workers: int = 0) -> dict[str, Any]:
    study = make_study(tmp_path, f"solver: {{kind: embedded, {runs}}}\n" if runs else "")
    if not workers:
        return workflow.run_stage("screen", study, folder, InlineExecutor(), solver=solver).to_json()
    with LocalExecutor(workers, study.solver.run_limit) as executor:
        return workflow.run_stage("screen", study, folder, executor, solver=solver).to_json()


# ---- tries


def test_one_accident_is_forgiven_and_recorded(tmp_path: Path, folder: StudyFolder) -> None:
    solver = FakeSolver(trouble={5: "exit"}, accident=tmp_path / "accident")
    stage = screen(tmp_path, folder, solver, workers=2)
    run = stage["design"]["runs"][5]
    assert run["status"] == "ok"
    record = folder.load(run["key"])
    assert record is not None and record["provenance"]["tries"] == 2


# ---- time limit


def test_a_hung_run_times_out_and_the_others_go_on(tmp_path: Path, folder: StudyFolder) -> None:
    begun = time.monotonic()
    stage = screen(tmp_path, folder, FakeSolver(trouble={4: "hang"}), "time_limit: 3 s", workers=2)
    assert time.monotonic() - begun < 30.0
    statuses = [run["status"] for run in stage["design"]["runs"]]
    assert statuses.count("failed") == 1 and stage["design"]["runs"][4]["reason"] == "timeout"
    assert "time limit of 3 s" in stage["design"]["runs"][4]["message"]


def test_a_longer_limit_gives_a_timed_out_run_another_chance(tmp_path: Path, folder: StudyFolder) -> None:
    witness = tmp_path / "witness"
    solver = FakeSolver(witness, trouble={4: "hang"}, accident=tmp_path / "once")
    screen(tmp_path, folder, solver, "time_limit: 3 s", workers=2)
    screen(tmp_path, folder, solver, "time_limit: 3 s", workers=2)
    screen(tmp_path, folder, solver, "time_limit: 2 s", workers=2)
    assert lines(witness).count("screen 4") == 1  # no hope of another answer
    stage = screen(tmp_path, folder, solver, "time_limit: 1 h", workers=2)
    assert lines(witness).count("screen 4") == 2
    assert all(run["status"] == "ok" for run in stage["design"]["runs"])


# ---- quorum, stopping


def test_half_of_the_runs_must_succeed(tmp_path: Path, folder: StudyFolder) -> None:
    with pytest.raises(RunsFailed, match=r"7 of 12 runs failed[\s\S]*6 must succeed[\s\S]*run 7: nan"):
        screen(tmp_path, folder, FakeSolver(trouble=dict.fromkeys(range(7), "nan")))


def test_a_validation_without_a_single_force_is_no_validation(tmp_path: Path, folder: StudyFolder) -> None:
    class AtOtherDiameters(FakeSolver):
        def solve(self, request: Any) -> Any:
            if request.stage == "validate":
                raise ValueError("no licence")
            return super().solve(request)

    study = make_study(tmp_path, "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\n")
    with pytest.raises(RunsFailed, match="3 of 3"):
        workflow.calibrate(study, folder, InlineExecutor(), solver=AtOtherDiameters())
    assert not folder.has_stage("validate")


# ---- censored forces


def test_a_rising_force_is_marked_and_told_of(tmp_path: Path, folder: StudyFolder) -> None:
    stage = screen(tmp_path, folder, FakeSolver(trouble={0: "rising", 9: "rising"}))
    runs = stage["design"]["runs"]
    assert [run["run"] for run in runs if run["censored"]] == [1, 10]
    assert all(run["status"] == "ok" and run["response"] is not None for run in runs)
    (bound,) = (note for note in stage["notes"] if note["kind"] == "lower_bound")
    assert bound["severity"] == "warning" and "runs 1 and 10" in bound["text"]


def test_what_determines_no_answer_recomputes_nothing(tmp_path: Path, folder: StudyFolder) -> None:
    witness = tmp_path / "witness"
    screen(tmp_path, folder, FakeSolver(witness))
    screen(tmp_path, folder, FakeSolver(witness), "time_limit: 30 s")
    assert len(lines(witness)) == 12


def test_the_runs_that_are_counted_are_those_that_the_surface_is_fitted_to(tmp_path: Path, folder: StudyFolder) -> None:
    study, seen = make_study(tmp_path), []
    workflow.run_stage("screen", study, folder, InlineExecutor(), solver=FakeSolver())
    for _ in ("computed", "read"):
        surface = workflow.run_stage("rsm", study, folder, InlineExecutor(), watch=seen.append, solver=FakeSolver())
        counted = {(state.done, state.total, state.points) for state in seen[-1:]}
        assert counted == {(len(surface.runs_diagnostics),) * 2 + (len(surface.design.runs),)}
    assert len(surface.runs_diagnostics) < len(surface.design.runs)
