"""Figures and tables of what surrounds the solution."""

from typing import Any
from xml.etree import ElementTree

from stemcal.drawing.style import svg
from stemcal.report.outcome import tables_of
from stemcal.stages.climb.result import ClimbResult
from stemcal.stages.invert.showing import profiles

CLIMB: dict[str, Any] = {
    "schema_version": 3,
    "stage": "climb",
    "study": "known",
    "names": ["a"],
    "rows": [{"step": 0, "levels": {"a": 1.0}, "coded": {"a": 0.0}, "response": 90.0, "error_percent": 10.0}],
    "coding": {"a": {"center": 1.0, "half_step": 0.5}},
    "target": 100.0,
    "condition": 8.0,
    "best_step": 0,
    "passed": False,
    "solution": {"a": 1.0},
    "error_percent": 10.0,
}


def test_figures_are_svg_and_the_same_each_time(stages: dict[str, Any]) -> None:
    invert = stages["invert"]
    text = svg(profiles(invert))
    assert ElementTree.fromstring(text).tag.endswith("svg") and text == svg(profiles(invert))


def test_climb_table() -> None:
    (table,) = tables_of(ClimbResult.from_json(CLIMB))
    assert table.cells == (("0", "1.000", "90.00", "10.00 too low"),)
    assert "a 1.000 ± 0.5000" in table.foot[2]
