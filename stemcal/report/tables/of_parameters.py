"""Tables of the parameters: as calibrated and how well they are known, the way to them, other meshes there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stemcal.files.rows import Column, Table
from stemcal.numbers import interval, significant
from stemcal.report.tables.columns import ERROR, factor, levels, simulated, to_decimals
from stemcal.stages.invert.result import Certainty, InvertResult
from stemcal.stages.invert.words import assumption, range_to_cite, source, valid_for
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.tables import line

if TYPE_CHECKING:
    from stemcal.stages.climb import ClimbResult


def calibration_table(stage: InvertResult, names: Names, refined: Mapping[str, float] | None = None) -> Table:
    """Return the calibrated parameters with the range of each that is to be cited, and what else was found.

    `refined` has the values after a refinement.
    """
    point, known, (head, ranges) = stage.point, stage.certainty, cited_ranges(stage)
    rows: list[dict[str, Any]] = [
        {"factor": name, "range": ranges[name], "coded": point.coded[name]}
        | {"solution": (refined or point.solution)[name], "share": known and share_of_range(known, name)}
        for name in point.solution
    ]
    columns = [
        factor(names),
        Column("solution", "Calibrated", form=significant),
        Column("range", head, form=str, claims=True),
        *([Column("share", "of its range", form=str, claims=True)] if known is not None else []),
        Column("coded", "Coded", form=to_decimals(3)),
    ]
    found = {"target": stage.target, "predicted": point.predicted, "radius": point.coded_radius, "rule": stage.rule}
    ends = line("intervals of the response", names, mean=point.mean_interval, one=point.prediction_interval)
    kind_of_point = "point" if stage.joint is None else "point of all"
    foot = (line(kind_of_point, names, **found), *valid_for(stage))
    return Table.of(columns, rows, line("calibration"), foot, claimed=(ends, *range_to_cite(stage, names)))


def cited_ranges(stage: InvertResult) -> tuple[str, dict[str, str]]:
    """Return what the range of each parameter to cite is called, and the ranges; ends of the search are marked."""
    known = stage.certainty
    ranges = {name: stage.cited.get(name) for name in stage.point.solution}
    if known is None:
        return "Exact solutions", {name: interval(found) for name, found in ranges.items()}
    bounded = {name: known.bounded.get(name, (True, True)) for name in ranges}
    return "95 % range", {name: interval(found, bounded=bounded[name]) for name, found in ranges.items()}


def share_of_range(part: Certainty, name: str) -> str:
    """Return how much of a factor's range its interval takes, or that it is free."""
    return say("free") if name in part.free else f"{100.0 * part.share[name]:.0f} %"


def interval_table(stage: InvertResult, names: Names) -> Table:
    """Return the interval of each parameter from one measured value and from all of them, side by side."""
    columns = [factor(names)]
    for part in stage.known:
        columns.append(Column(part.source, source(part, stage, names), form=str))
        columns.append(Column(f"share {part.source}", "of range", form=str))
    rows = [
        {"factor": name}
        | {part.source: interval(part.intervals[name], bounded=part.bounded[name]) for part in stage.known}
        | {f"share {part.source}": share_of_range(part, name) for part in stage.known}
        for name in stage.point.solution
    ]
    assumed = dict.fromkeys(sentence for part in stage.known for sentence in assumption(part))
    return Table.of(columns, rows, line("known"), (line("profile"), *assumed), claims=True)


def climb_table(stage: ClimbResult, names: Names) -> Table:
    """Return every step towards the target with its relative error."""
    columns = [Column("step", "Step", form=format), *levels(stage.names, names), simulated(names.response), ERROR]
    centres = ", ".join(
        f"{names.factor(name)} {significant(scale.center)} ± {significant(scale.half_step)}"
        for name, scale in stage.coding.items()
    )
    foot = _target(stage, names), line("error"), line("centre", levels=centres)
    return Table.of(columns, stage.rows, line("climb"), foot, strong=frozenset({stage.best_step}))


def _target(stage: ClimbResult, names: Names) -> str:
    at = "target" if names.naming.condition is None else "target at"
    return line(at, names, target=stage.target, at=stage.condition)
