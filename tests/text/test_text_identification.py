"""Sentences on what combinations of tests would tell."""

from __future__ import annotations

from stemcal.files.rows import Rows
from stemcal.overview.identify import (
    Allotted,
    Combination,
    Expected,
    Identified,
    MaximumOutOfReach,
    ScatterAssumed,
    Step,
)
from stemcal.text.identification import expected, foot, place, sentences
from stemcal.text.names import Names

FREE = Expected("failure_strain", 0.018, 0.042, 1.0, free=True)
KNOWN = Expected("yield_stress", 14.512, 15.488, 0.12, free=False)


def found(*combinations: Combination) -> Identified:
    steps = Rows([Step("yield_stress", "MPa", 12.62, 15.0, 17.38), Step("failure_strain", "1", 0.0229, 0.03, 0.0371)])
    division = Rows([Allotted("cutting", 8.0, 0.0012), Allotted("pull", 8.0, 0.9988)])
    return Identified(1, "identify", "stems", 5, steps, Rows(combinations), division, 38.2, ())


def test_an_interval_or_none() -> None:
    assert expected(KNOWN) == "14.5 to 15.5"
    assert expected(FREE) == "free"


def test_a_combination_goes_by_its_tests_or_its_diameters() -> None:
    assert place(("cutting", "pull"), (8.0,), Names()) == "cutting and pull"
    assert place(("cutting",), (7.0, 8.0), Names()) == "cutting at 7 and 8 mm"


def test_the_foot_tells_runs_division_and_what_is_left_free() -> None:
    few, many = (
        Combination(("cutting",), (8.0,), n, Rows([KNOWN, FREE]), {"yield_stress": -0.36, "failure_strain": 0.00714})
        for n in (5, 20)
    )
    assert foot(found(few, many), Names()) == [
        "5 runs: mid-levels, and one factor at a time at yield_stress 12.62 and 17.38 MPa and failure_strain 0.02290 "
        "and 0.03710.",
        "D-optimal division of the specimens: 100 % pull at 8 mm; an even one is worth 38 % of it.",
        "Left free by cutting at 8 mm: yield_stress −0.36 MPa and failure_strain +0.00714 together.",
    ]


def test_one_parameter_is_left_free_by_itself() -> None:
    alone = Combination(("cutting",), (8.0,), 20, Rows([KNOWN, FREE]), {"failure_strain": 0.00714})
    assert foot(found(alone), Names())[-1] == "Left free by cutting at 8 mm: failure_strain."


def test_what_was_assumed() -> None:
    assumed = ScatterAssumed(("response", "pull_work"), 10.0)
    assert sentences([assumed, MaximumOutOfReach(("squeeze_work",))], Names()) == [
        "No scatter is given for force and pull_work; a coefficient of variation of 10 % is assumed.",
        "squeeze_work does not count: the stroke ends before the maximum is passed. Lengthen the stroke to count it.",
    ]
    (said,) = sentences([MaximumOutOfReach(("squeeze_maximum_force", "squeeze_work"))], Names())
    assert said.startswith("squeeze_maximum_force and squeeze_work do not count")
