"""Figures and tables of what surrounds the solution."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import pytest

from stemcal.report.certainty import corner, profiles
from stemcal.report.sheets import sheets_of
from stemcal.report.style import svg

PART: dict[str, Any] = {
    "source": "8 mm alone",
    "intervals": {"a": [1.0, 2.0], "b": [3.0, 9.0]},
    "share": {"a": 0.2, "b": 0.9},
    "free": ["b"],
    "profiles": {name: {"values": [1, 2, 3], "rise": [4.0, 0.0, 4.0], "allowed": 3.84} for name in "ab"},
    "posterior": {"samples": {"a": [1.0, 1.5, 2.0], "b": [3.0, 5.0, 9.0]}, "intervals": {"a": [1, 2], "b": [3, 9]}},
}
CLIMB: dict[str, Any] = {
    "stage": "climb",
    "names": ["a"],
    "rows": [{"step": 0, "levels": {"a": 1.0}, "force": 90.0, "error_percent": 10.0}],
    "coding": {"a": {"center": 1.0, "half_step": 0.5}},
    "target": 100.0,
    "diameter": 8.0,
    "best_step": 0,
}


@pytest.mark.parametrize("draw", [profiles, corner])
def test_figures_are_svg_and_the_same_each_time(draw: Any) -> None:
    invert = {"solution": {"a": 1.5, "b": 4.0}, "certainty": PART, "certainty_alone": PART}
    text = svg(draw(invert))
    assert ElementTree.fromstring(text).tag.endswith("svg") and text == svg(draw(invert))


def test_climb_sheet() -> None:
    (sheet,) = sheets_of(CLIMB)
    assert sheet.rows == (("0", "1.000", "90.00", "10.00"),)
    assert "a 1.000 ± 0.5000" in sheet.foot[1]
