"""The tables of each stage, and of the parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from stemcal.files.rows import MOST_ROWS, Column, Table
from stemcal.files.typed import to_json
from stemcal.names import Names
from stemcal.numbers import MISSING, interval, significant
from stemcal.report.tables.columns import ERROR, factor, levels, simulated, to_decimals
from stemcal.report.tables.of_designs import effects_table, surface_tables
from stemcal.report.tables.of_responses import further_table, joint_table, refine_tables, validation_tables
from stemcal.stages.invert.result import Certainty, InvertResult
from stemcal.stages.invert.words import assumption, range_to_cite, source, valid_for
from stemcal.stages.result import StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult

if TYPE_CHECKING:
    from stemcal.stages.climb import ClimbResult
    from stemcal.stages.invert.result import InvertResult


MOST_FITS = 6  # further responses whose tables are shown


def tables_of(stage: StageResult, labels: Mapping[str, str] | None = None, judged: bool = False) -> list[Table]:
    """Return the tables of a stage, factors by their `labels` where they have any, long ones shortened.

    A `judged` table of effects says in words what each of them means.
    """
    return [shortened(stage, table) for table in _whole(stage, labels, judged)]


def shortened(stage: StageResult, table: Table, most: int = MOST_ROWS) -> Table:
    """Return a table of a stage with at most so many rows, and the file that has all of them."""
    keys = {column.key for column in table.columns}
    many = {"invert": "measured", "validate": "response"}.get(stage.name) in keys
    return table.shortened(f"`{stage.name}_responses.csv`" if many else f"`{stage.name}.csv`", most)


def _whole(stage: StageResult, labels: Mapping[str, str] | None, judged: bool) -> list[Table]:
    names = Names(stage.naming, labels or {})
    if isinstance(stage, ScreenResult):
        return [effects_table(one, names.of(one.naming), judged) for one in stage.all_responses]
    if isinstance(stage, SurfaceResult):
        return [*surface_tables(stage, names), *_of_others(stage, labels)]
    return _TABLES[stage.name](stage, names)


def joint_tables(stage: InvertResult, names: Names) -> list[Table]:
    """Return what was measured beside the surfaces, what it leaves of each parameter; nothing of a single response."""
    tables = [joint_table(stage.joint, names)] if stage.joint is not None else []
    tables += [interval_table(stage, names)] if len(stage.known) > 1 else []
    if stage.joint is not None and stage.joint.further:
        predicted = "predicted", "Predicted", significant
        tables.append(further_table(map(to_json, stage.joint.further), predicted, names))
    return [shortened(stage, table) for table in tables]


def visible(tables: Iterable[Table], holds: bool) -> list[Table]:
    """Return the tables as a study bears them: whole, or without what holds for a calibrated one only."""
    return [left for table in tables if (left := table if holds else table.unclaimed()) is not None]


def _of_others(stage: SurfaceResult, labels: Mapping[str, str] | None) -> list[Table]:
    """Return the tables of the further responses that a study itself has named."""
    own = {response.name for response in stage.naming.others}
    fitted = [(part.condition, name) for part in stage.conditions for name in part.responses or {} if name in own]
    tables: list[Table] = []
    for place, name in fitted[:MOST_FITS]:
        seen = stage.seen_by(name, place)
        for table in tables_of(seen, labels):
            naming = seen.naming
            title = f"{table.title}: {naming.response.long}{Names(naming).at(place)}"
            tables.append(replace(table, title=title))
    if len(fitted) > MOST_FITS:
        more = f"{len(fitted) - MOST_FITS} more fitted responses are in `rsm.json`."
        tables[-1] = replace(tables[-1], foot=(*tables[-1].foot, more))
    return tables


_TABLES: dict[str, Callable[[Any, Names], list[Table]]] = {
    "climb": lambda stage, names: [climb_table(stage, names)],
    "invert": lambda stage, names: [calibration_table(stage, names), *joint_tables(stage, names)],
    "refine": refine_tables,
    "validate": validation_tables,
}


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
