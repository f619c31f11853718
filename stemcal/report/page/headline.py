"""The page's headline: each calibrated parameter with its value, unit and the range to cite."""

from collections.abc import Mapping
from dataclasses import dataclass

from stemcal.numbers import significant, unit_written
from stemcal.report.tables.of_parameters import cited_ranges
from stemcal.stages.invert.result import InvertResult
from stemcal.study.model import Study


@dataclass(frozen=True)
class Card:
    """A parameter with its value, unit and the range to cite."""

    name: str
    value: str
    unit: str
    head: str
    range: str


def headline(
    invert: InvertResult | None, study: Study, holds: bool = True, values: Mapping[str, float] | None = None
) -> list[Card]:
    """Return a card per calibrated parameter; without its range where the study is not calibrated.

    `values` are those of a refinement.
    """
    if invert is None:
        return []
    head, ranges = cited_ranges(invert)
    return [
        Card(
            study.factor(name).label or name,
            significant(value),
            unit_written(study.factor(name).unit),
            head,
            f"{ranges[name]} {unit_written(study.factor(name).unit)}".rstrip() if holds else "",
        )
        for name, value in (invert.point.solution if values is None else values).items()
        if name in invert.point.solution
    ]
