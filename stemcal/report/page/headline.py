"""The calibrated parameters at the top of the page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stemcal.report.numbers import interval, significant
from stemcal.stages.invert.result import InvertResult

if TYPE_CHECKING:
    from stemcal.study.model import Study


@dataclass(frozen=True)
class Card:
    """A parameter with its value, unit and the range over all solutions."""

    name: str
    value: str
    unit: str
    range: str


def headline(invert: InvertResult | None, study: Study, holds: bool = True) -> list[Card]:
    """Return a card per calibrated parameter; without its range where the study is not calibrated."""
    if invert is None:
        return []
    return [
        Card(
            study.factor(name).label or name,
            significant(value),
            "" if study.factor(name).unit == "1" else study.factor(name).unit,
            interval(invert.ranges.get(name)) if holds else "",
        )
        for name, value in invert.point.solution.items()
    ]
