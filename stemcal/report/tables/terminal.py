"""Tables for the terminal, at most 80 columns wide."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.report.numbers import duration, fixed, significant
from stemcal.report.tables.appendix import shape_sheets
from stemcal.report.tables.findings import spoken
from stemcal.report.tables.sheet import Sheet, borne
from stemcal.report.tables.stages import sheets_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.result import StageResult

if TYPE_CHECKING:
    from rich.console import RenderableType

    from stemcal.cutting import CuttingResult


CROWDED = 8  # columns from which the gaps shrink, so that names stay whole in 80 columns


def stage_tables(stage: StageResult, holds: bool = True) -> list[RenderableType]:
    """Return a stage's tables and what it says in sentences, ready to print one below the other.

    Intervals and statements of agreement are left out of a study that does not bear them (`holds` is false).
    """
    sheets = borne([*sheets_of(stage), *shape_sheets(stage)], holds)
    said = spoken(stage) if holds or not isinstance(stage, InvertResult | MeshResult) else []
    return [*(part for sheet in sheets for part in drawn(sheet)), *said]


def drawn(sheet: Sheet) -> list[RenderableType]:
    """Return a sheet as a table, its foot as lines below it."""
    from rich.box import SIMPLE_HEAD
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=Text(sheet.title, style="bold"),
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1 if len(sheet.columns) < CROWDED else 0, 0, 0),
        pad_edge=False,
        show_edge=False,
    )
    for index, column in enumerate(sheet.columns):
        words = index < sheet.texts
        table.add_column(Text(column), justify="left" if words else "right", overflow="fold", no_wrap=not words)
    for index, row in enumerate(sheet.rows):
        style = "bold" if index in sheet.strong else ""
        table.add_row(*(Text(cell, style=style) for cell in row))
    foot = [Padding(Text(line, style="dim"), (0, 0, 0, 2), expand=False) for line in sheet.foot]
    return [table, *foot, Text("")]


def simulation_table(result: CuttingResult) -> RenderableType:
    """Return the numbers of one virtual shear test, names and values in two columns."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for name, value in _simulation_rows(result):
        table.add_row(Text(name), Text(value))
    return table


def _cut(result: CuttingResult) -> list[tuple[str, str]]:
    if result.work_of_cutting is None or result.cut_area_percent is None:
        return []
    return [
        ("Work of cutting", f"{significant(result.work_of_cutting)} mJ"),
        ("Cut", f"{fixed(result.cut_area_percent, 1)} % of the section"),
    ]


def _simulation_rows(result: CuttingResult) -> list[tuple[str, str]]:
    rate = result.element_steps_per_second / 1e6
    return [
        ("Maximum force", f"{significant(result.peak_force)} N"),
        ("  before the filter", f"{significant(result.peak_force_raw)} N"),
        ("  at", f"{result.peak_time:.4f} s, {result.peak_travel:.3f} mm of travel"),
        *([("Stem broke at", f"{result.break_travel:.3f} mm of travel")] if result.break_travel is not None else []),
        *_cut(result),
        ("Elements", f"{result.elements}, {result.deleted_elements} of them eroded by then"),
        ("Steps", f"{result.steps} in {duration(result.wall_seconds)}, {rate:.1f} M element-steps/s"),
        ("Energy drift", f"{fixed(result.energy_drift_percent, 3)} %"),
        ("Contact energy", f"{fixed(result.contact_energy_percent, 3)} % of the work, at least"),
        ("Kinetic energy", f"{fixed(result.kinetic_ratio_percent, 3)} % of internal, at most"),
    ]
