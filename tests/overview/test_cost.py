"""What runs take is known from those that are recorded, else by a guess."""

import socket
from dataclasses import asdict
from pathlib import Path

import pytest
from fakes import FakeSolver, make_study

from stemcal.overview.plan import costs_of, elapsed, overhead, plan
from stemcal.runs.record import Run
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request


def asked(row: int, diameter: float = 8.0) -> Request:
    return Request("screen", row, {"yield_stress": 10.0 + row, "failure_strain": 0.03}, diameter)


def recorded(folder: StudyFolder, solver: FakeSolver, request: Request, seconds: float, host: str) -> None:
    answer, told = asdict(Answer("ok", 100.0)), {"wall_seconds": seconds, "host": host}
    run = Run.of(solver, request)
    folder.save({"key": run.key, "identity": run.identity, "request": asdict(request), **answer, "provenance": told})


def test_records_of_this_machine_and_this_solver_tell_the_pace(tmp_path: Path) -> None:
    """Guessed 10 s at 8 mm and 40 s at 16 mm, taken 15 and 60: one and a half times as long."""
    solver, here = FakeSolver(), socket.gethostname()
    with StudyFolder(tmp_path / "out") as folder:
        recorded(folder, solver, asked(0), 15.0, here)
        recorded(folder, solver, asked(1, 16.0), 60.0, here)
        recorded(folder, solver, asked(2), 500.0, f"not-{here}")
        recorded(folder, FakeSolver(version=2), asked(3), 500.0, here)
        found = costs_of(solver, folder, asked(9))
    assert found.of is not None
    assert found.of(asked(5)) == pytest.approx(15.0)
    assert (found.source, found.recorded) == ("recorded", 2)


def test_without_records_the_solver_guesses(tmp_path: Path) -> None:
    guessed = costs_of(FakeSolver(), None, asked(0))
    assert guessed.of is not None
    assert (guessed.of(asked(0)), guessed.source) == (10.0, "guess")


def test_a_stage_waits_for_the_one_before(tmp_path: Path) -> None:
    assert elapsed([[1.0] * 5, [2.0]], 2) == 5.0
    assert elapsed([[], [2.0]], 8) == 2.0


def test_a_plan_shares_out_its_runs(tmp_path: Path) -> None:
    study = make_study(tmp_path)
    one, two = (plan(study, None, FakeSolver(), workers) for workers in (1, 2))
    assert one.elapsed is not None and two.elapsed is not None and one.seconds is not None
    assert one.elapsed - overhead(FakeSolver()) == pytest.approx(one.seconds)
    assert two.elapsed - overhead(FakeSolver()) < 0.6 * one.seconds


def test_the_runs_of_a_refinement_elsewhere_are_counted(tmp_path: Path) -> None:
    section = "refine: {in: {kind: sheet}, budget: 6}\n"
    found = plan(make_study(tmp_path, section), None, FakeSolver(), 1)
    (note,) = (note for note in found.notes if note.kind == "decided_later")
    alone = plan(make_study(tmp_path), None, FakeSolver(), 1)
    assert "at most 6 runs in" in note.text and found.elapsed == alone.elapsed
