"""Read a force–displacement file: find its columns of force and displacement, and return the curve of each specimen.

Several specimens may be side by side (力, 位移, 力, 位移, …) or share one displacement column. A column whose heading
does not state its content is never used by guess, and a choice among several columns is reported in a note.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from stemcal.arrays import Array
from stemcal.errors import UsageError
from stemcal.formats import counted
from stemcal.measured.cells import quoted
from stemcal.measured.headings import FORCE, MILLIMETRES, NEWTONS, TRAVEL, folded
from stemcal.measured.tables import Form, TextTable, read_tables
from stemcal.notes import Note, Remedy

PRELOAD = 5.0  # usual preload, N
_FEWEST = 5  # least number of points of a curve
_OFFSET = 0.1  # a first force above this share of the maximum may be an offset of the load cell
RISE = 0.2  # share of the maximum force; while the blade settles on the stem, the force remains below it
_NAME_THEM = "specify both columns by name or number with `--force-column` and `--displacement-column`"


@dataclass(frozen=True)
class CurveOptions:
    """Options for reading the files of a testing machine; options that are None are detected in each file.

    Columns are specified by name or number, several of them (specimens side by side) separated by commas. Below the
    `preload` (N) the blade only settles on the stem: a curve begins at the last point at or below it before the rise.
    """

    form: Form = field(default_factory=Form)
    force_column: str | None = None
    displacement_column: str | None = None
    force_unit: str | None = None
    displacement_unit: str | None = None
    preload: float = PRELOAD

    def __post_init__(self) -> None:
        if not 0.0 <= self.preload < math.inf:
            raise UsageError(f"--preload {self.preload:g}: write a force of at least 0 N")


@dataclass(frozen=True)
class ShearCurve:
    """Force (N) over the travel of the blade (mm) of one specimen, from the point where the force passes the preload.

    trimmed    number of points before that point, which are left out
    diameter   diameter stated above the data of the file, mm
    label      sheet and number of the specimen if the file contains several
    titles     text above the columns, heading of the force, title of the sheet: one may state the diameter
    """

    __pydantic_config__: ClassVar[dict[str, bool]] = {"arbitrary_types_allowed": True}  # allows numpy arrays as fields

    source: str
    travel: Array
    force: Array
    trimmed: int
    diameter: float | None
    synthetic: bool
    notes: tuple[Note, ...] = ()
    label: str = ""
    titles: tuple[str, ...] = ()

    @property
    def max_force(self) -> float:
        """Maximum shear force, N."""
        return float(self.force.max())

    @property
    def travel_at_max(self) -> float:
        """Travel of the blade at the maximum force, mm."""
        return float(self.travel[int(np.argmax(self.force))])

    @property
    def work_to_max(self) -> float:
        """Work of the blade up to the maximum force, ∫F du, mJ."""
        end = int(np.argmax(self.force)) + 1
        force, travel = self.force[:end], self.travel[:end]
        return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(travel)))


def read_curves(path: Path, how: CurveOptions = CurveOptions()) -> list[ShearCurve]:
    """Return the curves of all specimens in a file; they are side by side, or on separate sheets."""
    tables = read_tables(path, how.form)
    curves, skipped, failure = list[ShearCurve](), list[Note](), None
    for table in tables:
        try:
            pairs, notes = _pairs(table, how)
        except UsageError as error:
            failure = failure or error
            skipped.append(
                Note("sheet_skipped", "info", f"Sheet {quoted(table.sheet)} contains no curve and was skipped.")
            )
            continue
        curves += _curves_of(table, pairs, how, notes, several=len(tables) > 1)
    if failure is not None and not curves:
        raise failure
    return [replace(curves[0], notes=(*skipped, *curves[0].notes)), *curves[1:]]


def _pairs(table: TextTable, how: CurveOptions) -> tuple[list[tuple[int, int]], list[Note]]:
    """Return the displacement and the force column of each specimen, and notes; raise `UsageError` if in doubt."""
    if not table.headed and (how.force_column is None or how.displacement_column is None):
        raise UsageError(f"{table.source}: the columns have no headings ({table.listed_columns()}); {_NAME_THEM}")
    notes: list[Note] = []
    forces = _columns(table, "force", how.force_column, FORCE, NEWTONS)
    travels = _columns(table, "displacement", how.displacement_column, TRAVEL, MILLIMETRES)
    choices = ((how.force_column, forces), (how.displacement_column, travels))
    # detected columns with different names are not the same quantity of several specimens
    differ = [option is None and not _are_alike(table, columns) for option, columns in choices]
    if differ[0] and len(travels) == 1:
        forces = _first(table, "force", forces, notes)
    if differ[1] and len(forces) == 1:
        travels = _first(table, "displacement", travels, notes)
    if len(travels) == 1 < len(forces):
        text = f"{len(forces)} specimens share one displacement column ({quoted(table.columns[travels[0]])})."
        remedy = Remedy("If the force columns are from one specimen, select one of them with `--force-column`.")
        if how.force_column is None:
            notes.append(Note("shared_displacement", "caution", text, remedy))
        travels = travels * len(forces)
    if len(travels) != len(forces) or (len(forces) > 1 and any(differ)):
        counts = f"{counted(len(forces), 'force column')} and {counted(len(travels), 'displacement column')} found"
        equal = "specify an equal number of each, as in `--force-column 2,4 --displacement-column 1,3`"
        raise UsageError(f"{table.source}: {counts} among {table.listed_columns()}; {equal}")
    pairs = list(zip(travels, forces, strict=True))
    if any(travel == force for travel, force in pairs):
        raise UsageError(f"{table.source}: the same column was given for force and displacement; {_NAME_THEM}")
    return pairs, notes


def _columns(
    table: TextTable, what: str, option: str | None, words: Sequence[str], units: dict[str, float]
) -> list[int]:
    columns = table.chosen(option, what) if option is not None else table.matching(words, units)
    if not columns:
        raise UsageError(
            f"{table.source}: no {what} column found among {table.listed_columns()}; specify the column with "
            f"`--{what}-column`, or the encoding of the file with `--encoding`"
        )
    return columns


def _first(table: TextTable, what: str, columns: Sequence[int], notes: list[Note]) -> list[int]:
    others = ", ".join(quoted(table.columns[column]) for column in columns[1:4])
    text = f"The {what} is read from column {quoted(table.columns[columns[0]])}, not from {others}."
    notes.append(Note("column_chosen", "caution", text, Remedy(f"Use `--{what}-column` to select another column.")))
    return [columns[0]]


def _are_alike(table: TextTable, columns: Sequence[int]) -> bool:
    names = (re.split(r"[\W\d_]+", folded(table.columns[i])) for i in columns)
    roots = {tuple(part for part in name if len(part) > 1 or not part.isascii()) for name in names}
    return len(roots) == 1 and len({table.units[i] for i in columns}) == 1


_STATED = re.compile(
    r"(?:diameter|durchmesser|диаметр|çap|直径|직경)\D{0,20}?(\d+(?:[.,]\d+)?)\s*(mm|cm)?", re.IGNORECASE
)


def _curves_of(
    table: TextTable, pairs: Sequence[tuple[int, int]], how: CurveOptions, notes: Sequence[Note], several: bool
) -> list[ShearCurve]:
    """Return the curves of one table; `several` means that the file has other tables with curves."""
    sheet, stated = table.sheet if several else "", None
    if len(pairs) == 1 and (match := next(filter(None, map(_STATED.search, table.preamble)), None)) is not None:
        stated = float(match[1].replace(",", ".")) * (10.0 if match[2] == "cm" else 1.0)
    curves, begin = list[ShearCurve](), 0
    for number, pair in enumerate(pairs, 1):
        curve = _curve(table, *pair, how, [] if curves else list(notes))
        label = " ".join(filter(None, (sheet, str(number) if len(pairs) > 1 else "")))
        above = [text for text in table.labels[begin : max(pair) + 1] if text]
        begin = max(pair) + 1
        titles = (*above[-1:], *([table.columns[pair[1]]] if len(pairs) > 1 else []), sheet)
        curves.append(replace(curve, diameter=stated, label=label, titles=titles))
    return curves


def _curve(table: TextTable, across: int, up: int, how: CurveOptions, notes: list[Note]) -> ShearCurve:
    rows, omitted = table.with_numbers(across, up)
    if len(rows.rows) < _FEWEST:
        few = f"the curve has only {counted(len(rows.rows), 'point')}"
        raise UsageError(f"{table.source}: {few}; use a file with at least {_FEWEST} points")
    quantities = {
        "force": (up, NEWTONS, "N", how.force_unit),
        "displacement": (across, MILLIMETRES, "mm", how.displacement_unit),
    }
    scaled = []
    for what, (column, known, unit, option) in quantities.items():
        scaled.append(np.array(rows.numbers(column)) * table.scale_of(column, known, unit, option, f"--{what}-unit"))
        if not (option or table.units[column]):
            text = f"The file states no unit for the {what}; {unit} is assumed."
            notes.append(Note("unit_assumed", "caution", text, Remedy(f"If the unit differs, use `--{what}-unit`.")))
    force, travel = scaled
    notes += omitted
    _require_one_curve(rows, travel, force)
    if -force.min() > force.max():
        force = -force
        text = "The sign of the force was reversed so that compression is positive."
        notes.append(Note("pressing_is_positive", "info", text))
    begin = contact_begins(force, how.preload)
    if force[0] > max(how.preload, _OFFSET * force.max()):
        text = f"The force is {force[0]:.3g} N at the first point and may contain an offset of the load cell."
        notes.append(Note("force_at_start", "caution", text, Remedy("Subtract the force before contact in the file.")))
    if int(np.argmax(force)) == len(force) - 1:
        text = "The force is largest at the last point. The test may have ended before the peak force was reached."
        notes.append(Note("largest_at_end", "warning", text))
    travel = np.abs(travel[begin:] - travel[begin])
    return ShearCurve(table.source, travel, force[begin:], begin, None, table.synthetic, tuple(notes))


def _require_one_curve(table: TextTable, travel: Array, force: Array) -> None:
    """Raise `UsageError` if the displacement jumps back and the force rises again, as between two curves in a file."""
    steps = np.diff(travel) * np.sign(travel[np.argmax(np.abs(travel - travel[0]))] - travel[0])
    back = int(np.argmin(steps)) + 1  # first point after the largest step backwards
    stroke = np.ptp(travel)
    again = np.abs(force[back:]).max() > 0.5 * np.abs(force[:back]).max() and np.ptp(travel[back:]) > 0.2 * stroke
    if -steps[back - 1] > 0.5 * stroke and again and len(force) - back >= _FEWEST:
        raise UsageError(
            f"{table.source}: the displacement jumps from {travel[back - 1]:.4g} to {travel[back]:.4g} mm at row "
            f"{back + 1} of the numbers, and the force rises again: the file contains several curves; save each curve "
            "in a separate file"
        )


def contact_begins(force: Array, preload: float) -> int:
    """Return the index of the last point at or below the preload (N) before the force rises; 0 if there is none.

    The force has risen where it first exceeds a fifth of its maximum.

    >>> contact_begins(np.array([0.0, 6.0, 1.0, 3.0, 8.0, 90.0, 2.0]), 5.0)
    3
    """
    peak = int(np.argmax(force))
    if force[peak] <= preload:
        raise UsageError(f"no force exceeds the preload of {preload:g} N; check the unit of the force and the preload")
    rise = int(np.argmax(force > max(preload, RISE * force[peak])))
    below = np.flatnonzero(force[:rise] <= preload)
    return int(below[-1]) if len(below) else 0
