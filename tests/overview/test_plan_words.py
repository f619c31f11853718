"""The plan as rows and sentences, the terms that a design cannot estimate, and where the times are from."""

import socket
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from fakes import FakeSolver, make_study
from test_demand import TWO, Priced, record

from stemcal.doe.coding import Coding
from stemcal.overview.plan import Plan, _Costs, costs_of, design_notes, elapsed, overhead, plan, total
from stemcal.runs.record import Run
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.design import Design
from stemcal.stages.ledger import required_runs
from stemcal.storage.rows import Rows


def test_the_rows_of_a_plan(tmp_path: Path) -> None:
    """12 + 9 + 3 runs of 10 s at 8 mm; two of the screening are recorded; the centre is in the screening, too."""
    study = make_study(tmp_path, f"screen: {{centre_points: 2}}\n{TWO}")
    folder, solver = StudyFolder(tmp_path), Priced()
    with folder:
        for request in required_runs(study, solver, folder)[0].requests[:2]:
            record(folder, solver, request)
    found = plan(study, folder, solver, 4)
    rows = [(s.stage, s.rows, s.distinct_runs, s.recorded, s.to_run, s.seconds, s.memory) for s in found.stages]
    of_validation = 10.0 * 213.0 / 64.0
    assert rows == [
        ("screen", 14, 13, 2, 11, 110.0, 2e9),  # both centre runs are one
        ("rsm", 9, 9, 0, 9, 90.0, 2e9),
        ("validate", 3, 3, 0, 3, pytest.approx(of_validation), 3.125e9),
    ]
    assert (found.to_run, found.seconds, found.memory) == (23, pytest.approx(200.0 + of_validation), 3.125e9)
    assert (found.schema_version, found.stage, found.study, found.workers) == (1, "plan", "known", 4)
    # three rounds of four, three of four (at most), one of three
    assert found.elapsed == pytest.approx(9.0 + 3 * 10.0 + 3 * 10.0 + of_validation / 3)
    assert found.source == "guess"


PLAN = Plan(1, "plan", "known", Rows(()), 24, 7200.0, (), 2.5e9, "guess", 0, 4, 1800.0)
WHOLE = "The whole study takes about 30 min with 4 workers."
MEMORY = "One run needs about 2.5 GB of memory."


@pytest.mark.parametrize(
    ("changes", "lines"),
    [
        ({}, ["24 runs must be computed.", "On one core, the runs take 2 h 0 min (rough estimate).", WHOLE, MEMORY]),
        (
            {"source": "recorded", "recorded_runs": 1, "workers": 1, "memory": None},
            [
                "24 runs must be computed.",
                "On one core, the runs take 2 h 0 min (estimated from 1 recorded run on this machine).",
                "The whole study takes about 30 min with 1 worker.",
            ],
        ),
        (
            {"tests": {"cutting": 1800.0, "bending": 5400.0}, "elapsed": None},
            [
                "24 runs must be computed.",
                "On one core, the runs take 2 h 0 min (rough estimate): cutting 30 min (25 %), "
                "bending 1 h 30 min (75 %).",
                MEMORY,
            ],
        ),
        (
            {"tests": {"cutting": 7200.0}, "memory": None},
            ["24 runs must be computed.", "On one core, the runs take 2 h 0 min (rough estimate).", WHOLE],
        ),
        ({"tests": {"cutting": 1800.0}, "seconds": None, "memory": 0.0}, ["24 runs must be computed.", WHOLE]),
        ({"to_run": 1, "seconds": None, "memory": None, "elapsed": None}, ["1 run must be computed."]),
        ({"to_run": 0, "seconds": 0.0, "memory": None}, ["0 runs must be computed.",
                                                         "On one core, the runs take under 1 s (rough estimate)."]),
    ],
)  # fmt: skip
def test_the_plan_in_sentences(changes: dict[str, object], lines: list[str]) -> None:
    assert total(replace(PLAN, **changes)) == lines


def test_runs_by_hand_are_counted_by_stage(tmp_path: Path) -> None:
    found = plan(make_study(tmp_path, f"solver: {{kind: sheet}}\n{TWO}"))
    assert (found.source, found.seconds, found.elapsed) == ("by_hand", None, None)
    assert total(found) == ["12 + 9 + 3 runs must be done by hand, 24 in total."]
    one = replace(found, to_run=1, stages=Rows([replace(found.stages[0], to_run=1)]))
    assert total(one) == ["1 run must be done by hand, 1 in total."]


@dataclass(frozen=True)
class Unpriced(FakeSolver):
    """Does not know what a run takes."""

    def cost_estimate(self, request: Request) -> float | None:  # type: ignore[override]
        return None


@dataclass(frozen=True)
class Slow(FakeSolver):
    def preparing(self) -> bool:
        return True


class Immediate(FakeSolver):
    immediate = True


def asked_at(row: int, condition: float = 8.0) -> Request:
    return Request("screen", row, {"yield_stress": 10.0 + row}, condition)


def saved(folder: StudyFolder, solver: FakeSolver, row: int, status: str, seconds: float) -> None:
    run = Run.of(solver, asked_at(row))
    answer = asdict(Answer(status, 100.0 if status == "ok" else None, reason="" if status == "ok" else "inverted"))
    where = {"wall_seconds": seconds, "host": socket.gethostname()}
    request = asdict(run.request)
    folder.save({"key": run.key, "identity": run.identity, "request": request, **answer, "provenance": where})


def test_where_the_times_are_from(tmp_path: Path) -> None:
    """Failed runs do not count; without any estimate a run counts as one second, times the pace of the records."""
    assert costs_of(Unpriced(), None, asked_at(0)) == costs_of(Unpriced(), StudyFolder(tmp_path / "a"), asked_at(0))
    assert costs_of(Unpriced(), None, asked_at(0)) == _Costs(None, "none", 0)
    with StudyFolder(tmp_path / "b") as folder:
        saved(folder, Unpriced(), 0, "ok", 6.0)
        saved(folder, Unpriced(), 1, "ok", 8.0)
        saved(folder, Unpriced(), 2, "failed", 1000.0)
        saved(folder, Unpriced(), 3, "ok", 0.0)  # read from somewhere
        found = costs_of(Unpriced(), folder, asked_at(0))
    assert found.of is not None and found.of(asked_at(9, 16.0)) == pytest.approx(7.0)
    assert (found.source, found.recorded) == ("recorded", 2)


def test_fifty_records_are_enough(tmp_path: Path) -> None:
    with StudyFolder(tmp_path / "many") as folder:
        for row in range(52):
            saved(folder, FakeSolver(), row, "ok", 20.0)
        found = costs_of(FakeSolver(), folder, asked_at(0))
    assert found.recorded == 50 and found.of is not None and found.of(asked_at(3)) == pytest.approx(20.0)


def test_time_beside_the_runs() -> None:
    assert [overhead(solver) for solver in (Immediate(), FakeSolver(), Slow())] == [7.5, 9.0, 39.0]
    assert elapsed([[4.0] * 5, [], [2.0, 4.0]], 3) == 2 * 4.0 + 3.0


def design(coded: list[list[float]], order: int) -> Design:
    points = np.array(coded)
    names = ("a", "b")[: points.shape[1]]
    coding = Coding(names, (0.0,) * len(names), (1.0,) * len(names))
    return Design("rsm", "given", coding, points, tuple({} for _ in coded), order=order)


def test_terms_that_a_design_cannot_estimate() -> None:
    """Four corners do not separate the squares from the constant; nor, with the centre, a² from b²."""
    corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
    (note,) = design_notes(design(corners, 2))
    assert (note.kind, note.severity) == ("cannot_estimate", "caution")
    assert note.text == "rsm: the design (given, 4 runs) is not sufficient to estimate 1, a^2 and b^2."
    assert note.remedy is not None and note.remedy.text == "Add runs or factor levels."
    assert [n.text for n in design_notes(design([*corners, [0.0, 0.0]], 2))] == [
        "rsm: the design (given, 5 runs) is not sufficient to estimate a^2 and b^2."
    ]
    assert list(design_notes(design([*corners, [0.0, 0.0], [1.5, 0.0]], 2))) == []
    (aliases,) = design_notes(design(corners, 1))
    assert aliases.kind != "cannot_estimate"
    (lost,) = design_notes(design([[-1.0, -1.0], [1.0, 1.0]], 1))
    assert lost.text == "rsm: the design (given, 2 runs) is not sufficient to estimate a and b."
