"""Stem diameters: repeats averaged per stem, a normal distribution fitted, grades proposed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from stemcal.errors import UsageError
from stemcal.formats import counted
from stemcal.measured.headings import DIAMETER, LABEL, MILLIMETRES, is_called, is_missing, quoted
from stemcal.measured.statistics import ShapiroWilk, Summary, shapiro_wilk, summarise
from stemcal.measured.tables import Form, TextTable, columns_of, given_columns, matching, read_table, scale_of
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, inline

SHARE = 0.95  # of the stems that proposed grades must hold
WIDEST = 1000.0  # mm; no stem is thicker
MOST_GRADES = 100


@dataclass(frozen=True)
class Grade:
    """Stems from `low` up to, not including, `high` (mm) count as `diameter`."""

    diameter: float
    low: float
    high: float
    count: int
    share_percent: float
    fitted_percent: float


@dataclass(frozen=True)
class _MeasuredStem:
    """A stem and the mean of its readings, mm."""

    stem: str
    diameter: float


@dataclass(frozen=True, kw_only=True)
class Diameters(Spread):
    """The stems of a field in numbers; `share_percent` of them lie in a grade."""

    source: str
    stems: Rows[_MeasuredStem]
    readings: int
    summary: Summary = inline()
    normality: ShapiroWilk
    grades: Rows[Grade]
    share_percent: float
    synthetic: bool


def measure_diameters(
    path: Path, form: Form = Form(), grades: Sequence[float] = (), step: float = 1.0, column: str | None = None
) -> Diameters:
    """Read a file of diameters and describe them.

    Parameters
    ----------
    grades : sequence of float
        Diameters of the grades, mm; proposed if none are given.
    step : float
        Width of a grade, mm.
    column : str, optional
        Name or number of the column of diameters, by its name if None; several between commas.
    """
    _check_grades(grades, step)
    table = read_table(path, form)
    stems = _stems_of(table, column)
    values = [sum(readings) / len(readings) for readings in stems.values()]
    if len(values) < 3 or max(values) == min(values):
        there = f"{counted(len(values), 'stem')}, {counted(len(set(values)), 'diameter')}"
        raise UsageError(f"{path}: {there}; a distribution requires at least three stems of different diameters")
    summary = summarise(values)
    shared = graded(values, summary, sorted(grades) or proposed_grades(values, step), step)
    return Diameters(
        source=path.name,
        stems=Rows(map(_MeasuredStem, stems, values)),
        readings=sum(map(len, stems.values())),
        summary=summary,
        normality=shapiro_wilk(values),
        grades=shared,
        share_percent=sum(grade.share_percent for grade in shared),
        synthetic=table.synthetic,
    )


def _check_grades(grades: Sequence[float], step: float) -> None:
    """Raise `UsageError` for grades that are no diameters, too many, or overlap."""
    if not 0.0 < step < WIDEST:
        raise UsageError(f"--step {step:g}: the grade width must be above 0 mm and below {WIDEST:g} mm")
    for grade in grades:
        if not 0.0 < grade < WIDEST:
            raise UsageError(f"--grades: {grade:g} mm is not a plausible stem diameter; write diameters in mm")
    if len(grades) > MOST_GRADES:
        raise UsageError(f"--grades: too many grades ({len(grades)}); list at most {MOST_GRADES} grades")
    for low, high in pairwise(sorted(grades)):
        if high - low < step * (1.0 - 1e-9):
            raise UsageError(
                f"--grades: the grades of {low:g} and {high:g} mm overlap (width {step:g} mm); reduce `--step`"
            )


def _stems_of(table: TextTable, given: str | None = None) -> dict[str, list[float]]:
    """Return the readings (mm) of every stem: those of its row, and of all rows that carry its label."""
    label = _label_column(table)
    named = given_columns(table, given, "diameters") if given else None
    columns = named or [i for i in _reading_columns(table, label) if i != label]
    label = None if label in columns else label
    stems: dict[str, list[float]] = {}
    for row, cells in enumerate(table.rows):
        name = cells[label] if label is not None else str(row + 1)
        for column in columns:
            value = table.number(row, column)
            if value is None:
                if not is_missing(cells[column]):
                    raise UsageError(
                        f"{table.source}: stem {quoted(name)[1:-1]}: {quoted(cells[column])} is not a number"
                    )
                continue
            place = f"{table.source}: stem {quoted(name)[1:-1]}"
            millimetres = value * scale_of(table, column, MILLIMETRES, "mm")
            stems.setdefault(name, []).append(checked_diameter(millimetres, place))
    return stems


def checked_diameter(value: float, place: str) -> float:
    """Return a diameter (mm) that a stem may have; raise `UsageError` for another, naming the place."""
    if not 0.0 < value < WIDEST:
        raise UsageError(f"{place}: {value:g} mm is not a plausible diameter; correct the value or add its unit")
    return value


def _label_column(table: TextTable) -> int | None:
    """Return the column that names the stems: by its name, or because it counts them or holds words."""
    names = table.columns if table.headed else ()
    named = [index for index, name in enumerate(names) if is_called(name, LABEL)]
    if named:
        return named[0]
    first = [table.number(row, 0) for row in range(len(table.rows))]
    counts = first == [float(number + 1) for number in range(len(first))]
    words = all(value is None for value in first)
    return 0 if len(table.columns) > 1 and (counts or words) else None


def _reading_columns(table: TextTable, label: int | None) -> list[int]:
    """Return the columns called diameters, or the only one of numbers next to the labels if none has a heading."""
    named = matching(table, DIAMETER, MILLIMETRES)
    if named:
        return named
    numeric = [
        i
        for i in range(len(table.columns))
        if i != label and any(table.number(row, i) is not None for row in range(len(table.rows)))
    ]
    if len(numeric) == 1 and not table.headed:
        return numeric
    raise UsageError(
        f"{table.source}: no diameter column found among {columns_of(table)}; specify the column with "
        "`--diameter-column`"
    )


def proposed_grades(values: Sequence[float], step: float = 1.0) -> list[float]:
    """Return the fewest neighbouring grades, whole multiples of `step`, that hold 95 % of the stems.

    >>> proposed_grades([7.2, 8.1, 8.3, 9.0, 9.4, 10.8, 6.9, 8.8, 7.9, 9.9])
    [7.0, 8.0, 9.0, 10.0, 11.0]
    """
    numbers = sorted(
        math.floor(value / step + 0.5) for value in values
    )  # half up, so that limits fall alike everywhere
    needed = math.ceil(SHARE * len(numbers))
    spans = [(numbers[i + needed - 1] - numbers[i], numbers[i]) for i in range(len(numbers) - needed + 1)]
    centre = float(np.mean(numbers))
    width, first = min(spans, key=lambda span: (span[0], abs(span[1] + span[0] / 2 - centre)))
    if width >= MOST_GRADES:
        raise UsageError(f"--step {step:g}: {width + 1} grades are needed (limit {MOST_GRADES}); choose a larger step")
    return [(first + offset) * step for offset in range(width + 1)]


def graded(values: Sequence[float], fit: Summary, grades: Sequence[float], step: float) -> Rows[Grade]:
    """Return every grade with the share of stems in it, counted and by the fitted normal distribution."""
    from scipy.special import ndtr

    sd = fit.sd or 0.0
    found = []
    for diameter in grades:
        low, high = diameter - step / 2, diameter + step / 2
        count = sum(low <= value < high for value in values)
        fitted = float(100.0 * (ndtr((high - fit.mean) / sd) - ndtr((low - fit.mean) / sd)))
        found.append(Grade(diameter, low, high, count, 100.0 * count / len(values), fitted))
    return Rows(found)
