"""The sentences of a climb."""

from __future__ import annotations

from dataclasses import replace

from stemcal.files.rows import Rows
from stemcal.names import Names
from stemcal.naming import CUTTING
from stemcal.runs.outcome import Outcome
from stemcal.stages.climb.result import ClimbResult, ClimbRow
from stemcal.stages.climb.showing import ClimbShowing
from stemcal.stages.result import Head

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
    effects=Rows(),
    significant=(),
)


def test_a_climb_that_passed_the_target() -> None:
    assert ClimbShowing().outcome(CLIMB, Names(CUTTING, {"a": "Stress"})) == [
        "4 runs stepped Stress and b together towards the target.",
        "The target was passed; step 2 came nearest, 1.3 % from it.",
    ]


def test_a_climb_that_ended_at_the_edge() -> None:
    short = replace(CLIMB, passed=False)
    assert ClimbShowing().outcome(short, Names())[1].startswith("The target was not reached; step 2 came nearest")
