"""Tables for the terminal, at most 80 columns wide."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from stemcal.files.rows import Table
from stemcal.report.tables.findings import spoken
from stemcal.report.tables.stages import tables_of, visible
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.result import StageResult
from stemcal.text.laboratory import response_text
from stemcal.text.language import say
from stemcal.text.numbers import duration, fixed, significant

if TYPE_CHECKING:
    from rich.console import RenderableType

    from stemcal.cutting import CuttingResult
    from stemcal.study.model import LaboratorySection


WIDTH = 80
CROWDED = 8  # columns from which the gaps shrink, so that names stay whole


def stage_tables(stage: StageResult, holds: bool = True) -> list[RenderableType]:
    """Return a stage's tables and what it says in sentences, ready to print one below the other.

    Intervals and statements of agreement are left out of a study that does not bear them (`holds` is false).
    """
    said = spoken(stage) if holds or not isinstance(stage, InvertResult | MeshResult) else []
    return [*(part for table in visible(tables_of(stage), holds) for part in drawn(table)), *said]


def drawn(table: Table) -> list[RenderableType]:
    """Return a table as rich draws it, its foot as lines below it."""
    from rich import table as rich
    from rich.box import SIMPLE_HEAD
    from rich.padding import Padding
    from rich.text import Text

    shown = rich.Table(
        title=Text(table.title, style="bold"),
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1 if len(table.columns) < CROWDED else 0, 0, 0),
        pad_edge=False,
        show_edge=False,
    )
    for column, head in zip(table.columns, _heads(table), strict=True):
        shown.add_column(
            Text(head), justify="left" if column.left else "right", overflow="fold", no_wrap=not column.left
        )
    for index, row in enumerate(table.cells):
        style = "bold" if index in table.strong else ""
        shown.add_row(*(Text(cell, style=style) for cell in row))
    foot = [Padding(Text(line, style="dim"), (0, 0, 0, 2), expand=False) for line in (*table.foot, *table.claimed)]
    return [shown, *foot, Text("")]


def _heads(table: Table) -> list[str]:
    """Return the headings, on several lines where one is too wide for a terminal."""
    from rich.cells import cell_len

    columns = [[head, *cells] for head, *cells in zip(table.heads, *table.cells, strict=True)]
    if sum(max(map(cell_len, texts)) + 2 for texts in columns) <= WIDTH:
        return list(table.heads)
    return [_wrapped(head, max(map(cell_len, cells), default=0)) for head, *cells in columns]


def _wrapped(head: str, width: int) -> str:
    """Return a heading on as many lines as a column so wide needs; no word is broken."""
    return "\n".join(textwrap.wrap(head, max(width, *map(len, head.split()), 1), break_long_words=False))


def simulation_table(
    result: CuttingResult, section: LaboratorySection | None = None, diameter: float = 0.0
) -> RenderableType:
    """Return the numbers of one virtual test, names and values in two columns.

    That of a laboratory test (`section`) begins with its responses, beside each what was measured at the diameter.
    """
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    first = _maximum(result) if section is None else _responses(result, section, diameter)
    for name, value in (*first, *_simulation_rows(result)):
        table.add_row(Text(name), Text(value))
    return table


def _maximum(result: CuttingResult) -> list[tuple[str, str]]:
    return [
        ("Maximum force", f"{significant(result.peak_force)} N"),
        ("  before the filter", f"{significant(result.peak_force_raw)} N"),
        ("  at", f"{result.peak_time:.4f} s, {result.peak_travel:.3f} mm of travel"),
    ]


def _responses(result: CuttingResult, section: LaboratorySection, diameter: float) -> list[tuple[str, str]]:
    from stemcal.laboratory import LaboratoryResult
    from stemcal.study.model.laboratory_tests import BEFORE_MAXIMUM, RESPONSES

    found = result.responses if isinstance(result, LaboratoryResult) else {}
    measured = section.means_at(diameter)
    rows = []
    for name, (_, unit, words) in RESPONSES.items():
        if name in found or name in measured:
            bound = name not in BEFORE_MAXIMUM and not result.stroke_was_enough
            text = response_text(found.get(name), unit, measured.get(name), at_least=bound)
            rows.append((words[:1].upper() + words[1:], text))
    return rows


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
        *([("Stem broke at", f"{result.break_travel:.3f} mm of travel")] if result.break_travel is not None else []),
        *_cut(result),
        ("Elements", say("{elements}, {deleted_elements} of them eroded by then", **vars(result))),
        ("Steps", f"{result.steps} in {duration(result.wall_seconds)}, {rate:.1f} M element-steps/s"),
        ("Energy drift", f"{fixed(result.energy_drift_percent, 3)} %"),
        ("Contact energy", f"{fixed(result.contact_energy_percent, 3)} % of the work, at least"),
        ("Kinetic energy", f"{fixed(result.kinetic_ratio_percent, 3)} % of internal, at most"),
    ]
