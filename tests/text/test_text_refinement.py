"""What the closed loop says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from stemcal.files.rows import Rows
from stemcal.naming import Named, Naming
from stemcal.notes import Weight
from stemcal.runs.outcome import Outcome
from stemcal.stages.refine.result import RefineResult, RefineRow
from stemcal.stages.result import Head
from stemcal.text import refinement
from stemcal.text.names import Names
from stemcal.text.results import remarks_of


def row(iteration: int, inside: bool | None, condition: float | None = None) -> RefineRow:
    return RefineRow(
        iteration=iteration,
        how="surface",
        condition=condition,
        levels={"a": 1.0},
        predicted=160.0,
        prediction_interval=(155.0, 165.0),
        inside_interval=inside,
        error_percent=1.2,
        outcome=Outcome(response=170.0),
    )


ONE = RefineResult(
    head=Head(2, "refine", "known"),
    target=159.2,
    condition=8.0,
    tolerance_percent=1.0,
    budget=6,
    converged=True,
    iteration=2,
    solution={"a": 1.0},
    coded={"a": 0.0},
    coded_radius=0.0,
    simulated=159.0,
    error_percent=-0.13,
    parameters={"a": 1.0},
    rows=Rows([row(1, False), row(2, True)]),
)
MANY = replace(
    ONE, at_conditions=(8.0, 10.0), max_abs_error_percent=3.456, rows=Rows([row(1, False, 8.0), row(1, True, 10.0)])
)


def said(stage: RefineResult) -> dict[str, tuple[str, Weight]]:
    return {remark.kind: (remark.sentence, remark.weight) for remark in remarks_of(stage)}


def test_the_outcome_counts_the_runs() -> None:
    assert refinement.outcome(ONE, Names()) == [
        "2 runs corrected the solution: the error is 0.13 %, within the tolerance of 1 %."
    ]
    first = replace(ONE, rows=Rows(ONE.rows[:1]), converged=False, error_percent=6.2)
    assert refinement.outcome(first, Names()) == [
        "1 run at the solution: the error is 6.20 %, not within the tolerance of 1 %."
    ]
    assert refinement.shortfall(first) == "refine: 6.20 % from the target after 1 run"


def test_a_first_run_outside_the_interval_tells_of_the_surface() -> None:
    assert said(ONE)["first_outside"][0] == (
        "At the surface's solution the simulated maximum force, 170 N, lies outside the prediction interval: the "
        "surface misses more there than its residuals show."
    )
    assert (
        "outside the prediction interval at 8 mm: the surfaces"
        in said(replace(MANY, stopped="budget"))["first_outside"][0]
    )
    assert "first_outside" not in said(replace(ONE, rows=Rows(ONE.rows[1:])))


def test_a_loop_that_did_not_converge_names_the_remedy() -> None:
    still, weight = said(replace(ONE, converged=False, error_percent=2.0))["not_converged"]
    assert weight is Weight.USE and "still 2.00 % from the target" in still and "or refine the mesh" in still
    angle = Naming(None, (Named("angle", "Angle of repose", "θ", "deg"),))
    other = replace(ONE, converged=False, head=replace(ONE.head, naming=angle))
    assert "the simulated angle of repose is still" in said(other)["not_converged"][0]
    assert "compute more finely" in said(other)["not_converged"][0]
    assert "not_converged" not in said(ONE) and said(ONE)["found_by_simulation"][1] is Weight.ASIDE


@pytest.mark.parametrize(
    ("stopped", "weight", "words"),
    [
        ("tolerance", Weight.ASIDE, "After 2 runs the largest error is 3.46 %, within the tolerance."),
        ("budget", Weight.USE, "refine.budget allows no further iteration."),
        ("settled", Weight.USE, "After 2 runs the joint fit no longer moves: the largest error is 3.46 %"),
    ],
)
def test_why_a_joint_loop_ended(stopped: Any, weight: Weight, words: str) -> None:
    sentence, found = said(replace(MANY, stopped=stopped))["stopped"]
    assert words in sentence and found is weight
