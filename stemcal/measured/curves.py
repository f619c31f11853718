"""One force–displacement file of one specimen: read, sign set right, preload trimmed, maximum found."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stemcal.errors import UsageError
from stemcal.measured.columns import FORCE, TRAVEL, find_column, matching, scale_of
from stemcal.measured.headings import MILLIMETRES, NEWTONS
from stemcal.measured.numerals import is_missing
from stemcal.measured.reading import Form, Table, read_table

Array = NDArray[np.float64]
PRELOAD = 5.0  # N
RISE = 0.2  # share of the maximum that settling never reaches


@dataclass(frozen=True)
class CurveOptions:
    """How the files of a machine are to be taken; what is None is found out.

    Parameters
    ----------
    preload : float
        Force in N below which the blade only settles; the curve begins where it is last reached before the rise.
    """

    form: Form = field(default_factory=Form)
    force_column: str | None = None
    displacement_column: str | None = None
    force_unit: str | None = None
    displacement_unit: str | None = None
    preload: float = PRELOAD


@dataclass(frozen=True)
class Curve:
    """A specimen's force (N) over the blade's travel (mm) from where the preload was passed."""

    source: str
    travel: Array
    force: Array
    trimmed: int
    diameter: float | None
    synthetic: bool
    remarks: tuple[str, ...] = ()

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


def read_curve(path: Path, how: CurveOptions = CurveOptions()) -> Curve:
    """Return the curve of one specimen."""
    table = read_table(path, how.form)
    across, up = _columns(table, how)
    table, remarks = usable(table, across, up)
    force = np.array(table.numbers(up)) * scale_of(table, up, NEWTONS, "N", how.force_unit)
    travel = np.array(table.numbers(across)) * scale_of(table, across, MILLIMETRES, "mm", how.displacement_unit)
    if len(force) < 5:
        raise UsageError(f"{path}: {len(force)} points are no curve; is this the file of one specimen?")
    if -force.min() > force.max():
        force = -force
        remarks.append("force counted positive in pressing")
    begin = contact_begins(force, how.preload)
    if int(np.argmax(force)) == len(force) - 1:
        remarks.append("the force is largest at the last point: the test may have ended before the maximum")
    return Curve(
        source=str(path),
        travel=np.abs(travel[begin:] - travel[begin]),
        force=force[begin:],
        trimmed=begin,
        diameter=stated_diameter(table),
        synthetic=table.synthetic,
        remarks=tuple(remarks),
    )


def _columns(table: Table, how: CurveOptions) -> tuple[int, int]:
    """Return the columns of displacement and force; two without names are taken in that order."""
    unnamed = not matching(table, FORCE + TRAVEL) and table.columns[0] == "column 1" and len(table.columns) == 2
    across, up = ("1", "2") if unnamed else (None, None)
    return (
        find_column(table, TRAVEL, "displacement", how.displacement_column or across, MILLIMETRES),
        find_column(table, FORCE, "force", how.force_column or up, NEWTONS),
    )


def usable(table: Table, *columns: int) -> tuple[Table, list[str]]:
    """Return the table without rows that say nothing in the columns, and what was left out.

    Those are rows with an empty cell or NaN, and a machine's summary in words below the data; any other word among
    the numbers stays, to be complained about.
    """
    cells = [[row[column] for column in columns] for row in table.rows]
    last = max((i for i, row in enumerate(cells) if all(table.is_number(cell) for cell in row)), default=-1)
    kept = [table.rows[i] for i, row in enumerate(cells[: last + 1]) if not any(is_missing(cell) for cell in row)]
    remarks = []
    if len(kept) < len(table.rows):
        remarks.append(f"{len(table.rows) - len(kept)} rows without numbers for force or displacement are left out")
    if table.unread:
        remarks.append(f"{table.unread} more rows of numbers lie apart from the curve in the file and are not read")
    return replace(table, rows=tuple(kept)), remarks


def contact_begins(force: Array, preload: float) -> int:
    """Return the last point at or below the preload before the force rises for good; the first if there is none.

    It rises for good where it first passes a fifth of its maximum.

    >>> contact_begins(np.array([0.0, 6.0, 1.0, 3.0, 8.0, 90.0, 2.0]), 5.0)
    3
    """
    peak = int(np.argmax(force))
    if force[peak] <= preload:
        raise UsageError(f"no force above the preload of {preload:g} N; check the unit or give another --preload")
    rise = int(np.argmax(force > max(preload, RISE * force[peak])))
    below = np.flatnonzero(force[:rise] <= preload)
    return int(below[-1]) if len(below) else 0


_STATED = re.compile(r"(?:diameter|durchmesser|直径)[^0-9]{0,20}?(\d+(?:[.,]\d+)?)\s*(mm|cm)?", re.IGNORECASE)


def stated_diameter(table: Table) -> float | None:
    """Return the diameter in mm that the lines above the data state, None if they do not."""
    for line in table.preamble:
        match = _STATED.search(line)
        if match:
            return float(match[1].replace(",", ".")) * (10.0 if match[2] == "cm" else 1.0)
    return None
