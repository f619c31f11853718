"""The tables of each stage."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from stemcal.files.rows import MOST_ROWS, Table
from stemcal.files.typed import to_json
from stemcal.names import Names
from stemcal.numbers import significant
from stemcal.report.tables.of_designs import effects_table, surface_tables
from stemcal.report.tables.of_parameters import (
    calibration_table,
    climb_table,
    interval_table,
)
from stemcal.report.tables.of_responses import further_table, joint_table, refine_tables, validation_tables
from stemcal.stages.result import StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult

if TYPE_CHECKING:
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
