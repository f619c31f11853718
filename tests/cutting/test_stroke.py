"""Whether the stroke was enough: the stem broke, or the force ends below nine tenths of its maximum."""

import numpy as np
import pytest

from stemcal.cutting.checks import force_after_break
from stemcal.cutting.result import short_stroke
from stemcal.runs.record import Outcome, lower_bound_notes

TRAVEL = np.linspace(0.0, 1.0, 501)


@pytest.mark.parametrize(
    ("points", "enough"),
    [
        ([(0, 0), (1, 100)], False),
        ([(0, 0), (0.5, 100), (0.7, 70), (1, 95)], False),
        ([(0, 0), (0.5, 100), (1, 94)], False),
        ([(0, 0), (0.5, 100), (1, 60)], True),
        ([(0, 0), (0.5, 100), (0.7, 30), (1, 80)], True),
    ],
)
def test_whether_it_was_enough(points: list[tuple[float, float]], enough: bool) -> None:
    assert (short_stroke(TRAVEL, np.interp(TRAVEL, *np.array(points).T), None) == []) == enough


def test_a_later_larger_force_after_the_break_is_not_the_peak() -> None:
    force = np.interp(TRAVEL, [0.0, 0.4, 0.5, 1.0], [0.0, 100.0, 10.0, 150.0])
    assert short_stroke(TRAVEL, force, broken=245) == [] != short_stroke(TRAVEL, force, broken=None)


def test_the_warning_has_the_forces_that_were_passed() -> None:
    (warning,) = short_stroke(TRAVEL, np.interp(TRAVEL, [0.0, 0.5, 0.7, 1.0], [0.0, 100.0, 70.0, 95.0]), None)
    assert warning.kind == "stroke_too_short"
    assert warning.remedy is not None and "loading.duration" in warning.remedy.text
    for number in ("100.0 N at 0.5 mm", "95.0 N", "1 mm"):
        assert number in warning.text


def test_runs_that_are_bounds_are_named() -> None:
    bound, passed = Outcome(response=100.0, censored=True), Outcome(response=1.0)
    (note,) = lower_bound_notes([bound, passed, bound])
    assert note.kind == "lower_bound" and "runs 1 and 3" in note.text
    assert lower_bound_notes([passed]) == []


def test_the_released_stem() -> None:
    text = force_after_break(0.8321, 130.04, 120.0).text
    assert all(number in text for number in ("0.832 mm", "130.0 N", "120.0 N"))
