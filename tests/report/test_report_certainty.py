"""Figures and tables of what surrounds the solution."""

from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

from stemcal.drawing.style import svg
from stemcal.report.outcome import tables_of
from stemcal.stages.climb.result import ClimbResult
from stemcal.stages.invert.showing import calibration_table, profiles
from stemcal.vocabulary import Wording

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


def test_an_interval_that_mean_and_run_share_is_given_once_with_the_reason(stages: dict[str, Any]) -> None:
    invert = stages["invert"]
    apart = calibration_table(invert, Wording()).claimed[0]
    assert "153.9 to 164.5 N" in apart and "147.1 to 171.3 N" in apart
    point = replace(invert.point, prediction_interval=invert.point.mean_interval)
    once = calibration_table(replace(invert, point=point), Wording()).claimed[0]
    assert once.count("153.9 to 164.5 N") == 1 and "deterministic" in once
    unknown = calibration_table(
        replace(invert, point=replace(point, mean_interval=None, prediction_interval=None)), Wording()
    )
    assert "deterministic" not in unknown.claimed[0]
