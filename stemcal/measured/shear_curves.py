"""One force–displacement file of one specimen: read, sign set right, preload trimmed, maximum found."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from stemcal.errors import UsageError
from stemcal.measured.channels import Channels, CurveOptions, channels_of
from stemcal.measured.headings import MILLIMETRES, NEWTONS, SECONDS, is_missing, millimetres_in, shown
from stemcal.measured.tables import TextTable, read_tables, scale_of
from stemcal.note import Note
from stemcal.words import counted

Array = NDArray[np.float64]
RISE = 0.2  # share of the maximum that settling never reaches


@dataclass(frozen=True)
class ShearCurve:
    """A specimen's force (N) over the blade's travel (mm) from where the preload was passed."""

    __pydantic_config__: ClassVar[dict[str, bool]] = {"arbitrary_types_allowed": True}  # arrays become lists

    source: str
    travel: Array
    force: Array
    trimmed: int
    diameter: float | None
    synthetic: bool
    notes: tuple[Note, ...] = ()
    label: str = ""  # of one among several specimens in a file
    over: float | None = None  # the diameter over its columns, mm
    of_file: tuple[Note, ...] = ()  # notes on the file as a whole, with its first curve

    @property
    def max_force(self) -> float:
        """The maximum shear force, N."""
        return float(self.force.max())

    @property
    def travel_at_max(self) -> float:
        """Travel of the blade at the maximum, mm."""
        return float(self.travel[int(np.argmax(self.force))])

    @property
    def work_to_max(self) -> float:
        """What the blade has done by the maximum, ∫F du, mJ."""
        end = int(np.argmax(self.force)) + 1
        force, travel = self.force[:end], self.travel[:end]
        return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(travel)))


def read_curves(path: Path, how: CurveOptions = CurveOptions()) -> list[ShearCurve]:
    """Return the curves of all specimens in a file, side by side or on separate sheets."""
    how.check()
    tables, skipped = _tables_of_curves(path, how)
    curves = [curve for table in tables for curve in _curves_of(table, how, several=len(tables) > 1)]
    return [replace(curves[0], of_file=(*curves[0].of_file, *skipped)), *curves[1:]]


def _tables_of_curves(path: Path, how: CurveOptions) -> tuple[list[TextTable], list[Note]]:
    """Return the sheets with curves, and a note on each other one; of a text its only table."""
    tables = read_tables(path, how.form)
    if len(tables) == 1:
        return tables, []
    found, first = [], None
    skipped: list[Note] = []
    for table in tables:
        try:
            channels_of(table, how)
            found.append(table)
        except UsageError as error:
            first = first or error
            text = f"Sheet {shown(table.sheet)} contains no curve and was skipped."
            skipped.append(Note("sheet_skipped", "info", text))
    if not found and first is not None:
        raise first
    return found, skipped


def _curves_of(table: TextTable, how: CurveOptions, several: bool) -> list[ShearCurve]:
    """Return the curves of one table; `several`: whether others are in the same file."""
    channels, notes = channels_of(table, how)
    if len(channels) > 1:
        notes.insert(0, Note("side_by_side", "info", f"The file contains {len(channels)} specimens side by side."))
    diameters = _stated_diameters(table, len(channels))
    sheet = table.sheet if several else ""
    curves = [
        _curve(table, one, how, diameter, " ".join(filter(None, (sheet, one.label))))
        for one, diameter in zip(channels, diameters, strict=True)
    ]
    return [replace(curves[0], of_file=tuple(notes)), *curves[1:]]


def _curve(table: TextTable, channels: Channels, how: CurveOptions, diameter: float | None, label: str) -> ShearCurve:
    """Return the curve of one specimen."""
    for column in (channels.across, channels.up):
        if all(table.number(row, column) is None for row in range(len(table.rows))):
            held = next((cells[column] for cells in table.rows if not is_missing(cells[column])), "empty cells")
            raise UsageError(
                f"{table.source}: {shown(table.columns[column])} contains {shown(held)} instead of numbers"
            )
    rows, notes = usable(table, channels.across, channels.up)
    if len(rows.rows) < 5:
        raise UsageError(f"{table.source}: only {counted(len(rows.rows), 'point')}; a curve needs at least 5")
    force = scale_of(table, channels.up, NEWTONS, "N", how.force_unit) * np.array(rows.numbers(channels.up))
    travel = _travel(rows, channels, how, notes)
    if -force.min() > force.max():
        force = -force
        notes.append(
            Note("pressing_is_positive", "info", "The sign of the force was reversed, so that compression is positive.")
        )
    begin = contact_begins(force, how.preload)
    if int(np.argmax(force)) == len(force) - 1:
        text = "The force is largest at the last point, so the test may have ended before the maximum."
        notes.append(Note("largest_at_end", "warning", text))
    return ShearCurve(
        source=table.source,
        travel=np.abs(travel[begin:] - travel[begin]),
        force=force[begin:],
        trimmed=begin,
        diameter=diameter,
        synthetic=table.synthetic,
        notes=tuple(notes),
        label=label,
        over=channels.diameter if channels.diameter is not None else millimetres_in(label),
    )


def _travel(table: TextTable, channels: Channels, how: CurveOptions, notes: list[Note]) -> Array:
    """Return the displacement, mm; from time where that is all there is."""
    column = channels.across
    values = np.array(table.numbers(column))
    if not channels.timed or how.speed is None:
        return scale_of(table, column, MILLIMETRES, "mm", how.displacement_unit) * values
    text = f"Displacement was computed as {shown(table.columns[column])} (time) times {how.speed:g} mm/s."
    notes.append(Note("displacement_from_time", "info", text))
    return how.speed * scale_of(table, column, SECONDS, "s", how.time_unit) * values


def usable(table: TextTable, *columns: int) -> tuple[TextTable, list[Note]]:
    """Return the table without rows that say nothing in the columns, and what was left out.

    Those are rows with an empty cell or NaN, and a machine's summary in words below the data; any other word among
    the numbers stays, to be complained about.
    """
    cells = [[row[column] for column in columns] for row in table.rows]
    last = max((i for i, row in enumerate(cells) if all(table.as_number(cell) is not None for cell in row)), default=-1)
    kept = [table.rows[i] for i, row in enumerate(cells[: last + 1]) if not any(is_missing(cell) for cell in row)]
    notes: list[Note] = []
    if len(kept) < len(table.rows):
        text = f"Omitted {counted(len(table.rows) - len(kept), 'row')} without a number for force or displacement."
        notes.append(Note("rows_left_out", "info", text))
    if table.unread:
        text = f"Skipped {counted(table.unread, 'row')} of numbers outside the table of the curve."
        notes.append(Note("rows_apart", "caution", text))
    return replace(table, rows=tuple(kept)), notes


def contact_begins(force: Array, preload: float) -> int:
    """Return the last point at or below the preload before the force rises for good; the first if there is none.

    It rises for good where it first passes a fifth of its maximum.

    >>> contact_begins(np.array([0.0, 6.0, 1.0, 3.0, 8.0, 90.0, 2.0]), 5.0)
    3
    """
    peak = int(np.argmax(force))
    if force[peak] <= preload:
        raise UsageError(f"no force above the preload of {preload:g} N; check the unit and the preload")
    rise = int(np.argmax(force > max(preload, RISE * force[peak])))
    below = np.flatnonzero(force[:rise] <= preload)
    return int(below[-1]) if len(below) else 0


_STATED = re.compile(r"(?:diameter|durchmesser|диаметр|çap|直径|직경)", re.IGNORECASE)
_MEASURE = re.compile(r"(\d+(?:[.,]\d+)?)\s*(mm|cm)?", re.IGNORECASE)
_AFTER = 20  # characters between the word and the number


def _stated_diameters(table: TextTable, count: int) -> list[float | None]:
    """Return the diameters in mm of `count` specimens that a line above the data states, None where it does not.

    Of several specimens a line states either each, in their order, or one for all.
    """
    for line in table.preamble:
        found = _STATED.search(line)
        if found is None:
            continue
        numbers = list(_MEASURE.finditer(line[found.end() : found.end() + _AFTER * (1 + count)]))
        if not numbers or numbers[0].start() > _AFTER:
            continue
        values = [float(m[1].replace(",", ".")) * (10.0 if m[2] == "cm" else 1.0) for m in numbers]
        if len(values) == count:
            return list(values)
        return [values[0] if count == 1 or len(values) == 1 else None] * count
    return [None] * count
