"""Stem diameters: repeats averaged per stem, a normal distribution fitted, grades proposed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stemcal.errors import UsageError
from stemcal.measured.columns import DIAMETER, LABEL, is_called, matching, scale_of
from stemcal.measured.headings import MILLIMETRES
from stemcal.measured.normality import LEAST, NormalityTest, anderson_darling, shapiro_wilk
from stemcal.measured.numerals import is_missing
from stemcal.measured.reading import Form, Table, read_table
from stemcal.measured.samples import Summary, summarise

SHARE = 0.95  # of the stems that proposed grades must hold
WIDEST = 1000.0  # mm; no stem is thicker


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
class Diameters:
    """The stems of a field in numbers."""

    source: str
    stems: tuple[str, ...]
    values: tuple[float, ...]
    readings: int
    summary: Summary
    tests: tuple[NormalityTest, ...]
    grades: tuple[Grade, ...]
    synthetic: bool

    def as_dict(self) -> dict[str, Any]:
        """Return all as JSON values."""
        return {
            "source": Path(self.source).name,
            "stems": [{"stem": s, "diameter": d} for s, d in zip(self.stems, self.values, strict=True)],
            "readings": self.readings,
            **self.summary.as_dict(),
            "normality": [test.as_dict() for test in self.tests],
            "grades": [vars(grade) for grade in self.grades],
            "share_percent": sum(grade.share_percent for grade in self.grades),
            "synthetic": self.synthetic,
        }


def measure_diameters(path: Path, form: Form = Form(), grades: Sequence[float] = (), step: float = 1.0) -> Diameters:
    """Read a file of diameters and describe them.

    Parameters
    ----------
    grades : sequence of float
        Diameters of the grades, mm; proposed if none are given.
    step : float
        Width of a grade, mm.
    """
    if not 0.0 < step < WIDEST:
        raise UsageError(f"--step {step:g}: the width of a grade must be above 0 mm")
    table = read_table(path, form)
    stems = stems_of(table)
    values = [sum(readings) / len(readings) for readings in stems.values()]
    if len(values) < 3 or max(values) == min(values):
        raise UsageError(f"{path}: {len(values)} stems that differ; a distribution needs three or more")
    tests = (shapiro_wilk(values), *((anderson_darling(values),) if len(values) >= LEAST else ()))
    summary = summarise(values)
    return Diameters(
        source=str(path),
        stems=tuple(stems),
        values=tuple(values),
        readings=sum(map(len, stems.values())),
        summary=summary,
        tests=tests,
        grades=graded(values, summary, sorted(grades) or proposed_grades(values, step), step),
        synthetic=table.synthetic,
    )


def stems_of(table: Table) -> dict[str, list[float]]:
    """Return the readings (mm) of every stem: those of its row, and of all rows that carry its label."""
    label = _label_column(table)
    columns = [index for index in _reading_columns(table) if index != label]
    stems: dict[str, list[float]] = {}
    for row, cells in enumerate(table.rows):
        name = cells[label] if label is not None else str(row + 1)
        for column in columns:
            value = table.number(row, column)
            if value is None:
                if not is_missing(cells[column]):
                    raise UsageError(f"{table.source}: stem {name}: {cells[column]!r} is no number")
                continue
            stems.setdefault(name, []).append(_checked(value * scale_of(table, column, MILLIMETRES, "mm"), name, table))
    return stems


def _checked(value: float, name: str, table: Table) -> float:
    if not 0.0 < value < WIDEST:
        raise UsageError(f"{table.source}: stem {name}: {value:g} mm is no diameter; mend the file or give its unit")
    return value


def _label_column(table: Table) -> int | None:
    """Return the column that names the stems: by its name, or because it counts them or holds words."""
    named = [index for index, name in enumerate(table.columns) if is_called(name, LABEL)]
    if named:
        return named[0]
    first = [table.number(row, 0) for row in range(len(table.rows))]
    counts = first == [float(number + 1) for number in range(len(first))]
    words = all(value is None for value in first)
    return 0 if len(table.columns) > 1 and (counts or words) else None


def _reading_columns(table: Table) -> list[int]:
    named = matching(table, DIAMETER)
    if named:
        return named
    numeric = [i for i in range(len(table.columns)) if any(table.number(row, i) for row in range(len(table.rows)))]
    if not numeric:
        raise UsageError(f"{table.source}: no column of diameters; call it diameter")
    return numeric


def proposed_grades(values: Sequence[float], step: float = 1.0) -> list[float]:
    """Return the fewest neighbouring grades, whole multiples of `step`, that hold 95 % of the stems.

    >>> proposed_grades([7.2, 8.1, 8.3, 9.0, 9.4, 10.8, 6.9, 8.8, 7.9, 9.9])
    [7.0, 8.0, 9.0, 10.0, 11.0]
    """
    numbers = sorted(_grade_number(value, step) for value in values)
    needed = math.ceil(SHARE * len(numbers))
    spans = [(numbers[i + needed - 1] - numbers[i], numbers[i]) for i in range(len(numbers) - needed + 1)]
    centre = float(np.mean(numbers))
    width, first = min(spans, key=lambda span: (span[0], abs(span[1] + span[0] / 2 - centre)))
    return [(first + offset) * step for offset in range(width + 1)]


def _grade_number(value: float, step: float) -> int:
    """Round half up, so that limits fall the same way everywhere."""
    return math.floor(value / step + 0.5)


def graded(values: Sequence[float], fit: Summary, grades: Sequence[float], step: float) -> tuple[Grade, ...]:
    """Return every grade with the share of stems in it, counted and by the fitted normal distribution."""
    from scipy import stats

    normal = stats.norm(fit.mean, fit.sd)
    found = []
    for diameter in grades:
        low, high = diameter - step / 2, diameter + step / 2
        count = sum(low <= value < high for value in values)
        fitted = float(100.0 * (normal.cdf(high) - normal.cdf(low)))
        found.append(Grade(diameter, low, high, count, 100.0 * count / len(values), fitted))
    return tuple(found)
