"""Tables of the parameters: as calibrated and how well they are known, the way to them, other meshes there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stemcal.files.rows import Column, Table
from stemcal.names import Names
from stemcal.numbers import MISSING, interval, significant
from stemcal.report.tables.columns import ERROR, factor, levels, simulated, to_decimals
from stemcal.stages.invert.result import Certainty, InvertResult
from stemcal.stages.invert.words import assumption, range_to_cite, source, valid_for

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
    rule = f"rule {stage.rule}" if stage.joint is None else "least squares over all that is fitted together"
    where = (
        f"Target {names.quantity(stage.target, '.6g')}; predicted {names.quantity(point.predicted)}; coded radius "
        f"{point.coded_radius:.3f}; {rule}."
    )
    response = names.response.long
    ends = (
        f"95 % interval of the mean {response} {_ends(point.mean_interval, names)}, of one simulated {response} "
        f"{_ends(point.prediction_interval, names)}."
    )
    claimed = (ends, *range_to_cite(stage, names))
    return Table.of(columns, rows, "Calibrated parameters", (where, *valid_for(stage)), claimed=claimed)


def _ends(bounds: tuple[float, float] | None, names: Names) -> str:
    return MISSING if bounds is None else names.quantities(bounds)


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
    return "free" if name in part.free else f"{100.0 * part.share[name]:.0f} %"


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
    profile = "95 % intervals by profile likelihood; free: half of the range or more remains possible."
    return Table.of(columns, rows, "How well the measurements fix the parameters", (profile, *assumed), claims=True)


def climb_table(stage: ClimbResult, names: Names) -> Table:
    """Return every step towards the target with its relative error."""
    columns = [Column("step", "Step", form=format), *levels(stage.names, names), simulated(names.response), ERROR]
    centres = ", ".join(
        f"{names.factor(name)} {significant(scale.center)} ± {significant(scale.half_step)}"
        for name, scale in stage.coding.items()
    )
    foot = (
        f"Target {names.quantity(stage.target, '.6g')}{names.at(stage.condition)}.",
        "Error = 100·(measured − simulated)/measured.",
        f"The design of the surface: {centres} (coded 0 ± 1).",
    )
    return Table.of(columns, stage.rows, "Steps towards the target", foot, strong=frozenset({stage.best_step}))
