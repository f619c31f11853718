"""Warnings of single runs."""

import pytest

from stemcal.note import force_after_break, stroke_too_short


@pytest.mark.parametrize(
    ("ending", "numbers"),
    [("rising", ["stroke (1 mm)"]), ("regained", ["100.0 N at 0.5 mm", "70.0 N", "95.0 N"]), ("falling", ["95.0 N"])],
)
def test_a_stroke_that_is_too_short(ending: str, numbers: list[str]) -> None:
    warning = stroke_too_short(ending, 100.0, 0.5, 70.0, 95.0, 1.0)
    assert warning.kind == "stroke_too_short" and all(number in warning.text for number in numbers)
    assert warning.remedy is not None and "loading.duration" in warning.remedy.text


def test_the_released_stem() -> None:
    text = force_after_break(0.8321, 130.04, 120.0).text
    assert all(number in text for number in ("0.832 mm", "130.0 N", "120.0 N"))
