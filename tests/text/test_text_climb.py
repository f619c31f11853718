"""What the climb says."""

from __future__ import annotations

from dataclasses import replace

from stemcal.files.rows import Rows
from stemcal.naming import CUTTING
from stemcal.runs.outcome import Outcome
from stemcal.stages.climb import ClimbResult, ClimbRow
from stemcal.stages.result import Head
from stemcal.text import climb
from stemcal.text.names import Names
from stemcal.text.results import remarks_of

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
    assert climb.outcome(CLIMB, Names(CUTTING, {"a": "Stress"})) == [
        "4 runs stepped Stress and b together towards the target.",
        "The target was passed; step 2 came nearest, 1.3 % from it.",
    ]
    assert [remark.sentence for remark in remarks_of(CLIMB)] == [
        "Of 4 steps along the slope of the screening, step 2 is nearest to the target (−1.3 %): the surface is centred "
        "there."
    ]


def test_a_climb_that_ended_at_the_edge() -> None:
    short = replace(CLIMB, passed=False)
    assert climb.outcome(short, Names())[1].startswith("The target was not reached; step 2 came nearest")
    edge = remarks_of(short)[1].sentence
    assert "before the maximum force passed the target" in edge and "widen the ranges" in edge
