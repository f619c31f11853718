"""How a curve ends: still rising, regained, falling, fallen, broken."""

import numpy as np
import pytest

from stemcal.cutting.end_state import stroke_end
from stemcal.cutting.result import moving_mean
from stemcal.runs.record import lower_bound_notes
from stemcal.solvers.protocol import Answer

TRAVEL = np.linspace(0.0, 1.0, 501)


def ended(points: list[tuple[float, float]], noise: float = 0.0, broken: int | None = None) -> str:
    smooth = np.interp(TRAVEL, *np.array(points).T)
    raw = smooth + noise * np.random.default_rng(1).standard_normal(len(TRAVEL))
    return stroke_end(TRAVEL, raw, moving_mean(raw, 11), 11, broken).kind


@pytest.mark.parametrize(
    ("points", "noise", "kind"),
    [
        ([(0, 0), (1, 100)], 0.0, "rising"),
        ([(0, 0), (0.8, 100), (1, 100)], 4.0, "rising"),  # level within the noise
        ([(0, 0), (0.9, 100), (1, 99.5)], 0.0, "rising"),  # a dip of half a per cent is noise
        ([(0, 0), (0.5, 100), (0.7, 70), (1, 95)], 0.0, "regained"),
        ([(0, 0), (0.5, 100), (0.7, 70), (1, 95)], 4.0, "regained"),
        ([(0, 0), (0.5, 100), (1, 94)], 0.0, "falling"),
        ([(0, 0), (0.5, 100), (1, 60)], 4.0, "fallen"),
        ([(0, 0), (0.5, 100), (0.7, 30), (1, 80)], 0.0, "fallen"),
    ],
)
def test_how_it_ends(points: list[tuple[float, float]], noise: float, kind: str) -> None:
    assert ended(points, noise) == kind


def test_a_later_larger_force_after_the_break_is_not_the_peak() -> None:
    points = [(0.0, 0.0), (0.4, 100.0), (0.5, 10.0), (1.0, 150.0)]
    smooth = np.interp(TRAVEL, *np.array(points).T)
    end = stroke_end(TRAVEL, smooth, smooth, 1, broken=245)
    assert (end.kind, end.peak, end.was_enough, end.warnings) == ("broken", pytest.approx(100.0, rel=0.01), True, [])


def test_the_warning_has_the_forces_that_were_passed() -> None:
    smooth = np.interp(TRAVEL, [0.0, 0.5, 0.7, 1.0], [0.0, 100.0, 70.0, 95.0])
    (warning,) = stroke_end(TRAVEL, smooth, smooth, 1).warnings
    assert warning.kind == "stroke_too_short"
    for number in ("100.0 N at 0.5 mm", "70.0 N", "95.0 N", "1 mm stroke"):
        assert number in warning.text


def answer(end: str | None) -> Answer:
    details = {"stroke_was_enough": False} | ({"stroke_end": end} if end else {})
    return Answer("ok", 100.0, details=details)


def test_only_what_rose_is_said_to_have_risen() -> None:
    answers = [answer("rising"), answer("regained"), answer("rising"), answer(None), Answer("ok", 1.0)]
    starts = (
        "In runs 1 and 3, the response was still rising",
        "In run 2, the response had",
        "In run 4, the response had not fallen",
    )
    for note, start in zip(lower_bound_notes(answers), starts, strict=True):
        assert note.kind == "lower_bound" and note.text.startswith(start)
