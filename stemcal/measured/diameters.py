"""Evaluate stem diameters: average the readings of each stem, fit a normal distribution, and propose grades."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from pathlib import Path

import numpy as np

from stemcal.errors import UsageError
from stemcal.formats import counted, series
from stemcal.measured.cells import is_missing, not_a_number, quoted
from stemcal.measured.headings import BORE, DIAMETER, LABEL, MILLIMETRES, READING, SKIN
from stemcal.measured.statistics import ShapiroWilk, Summary, shapiro_wilk, summarise
from stemcal.measured.tables import Form, TextTable, read_table
from stemcal.notes import Note, Remedy
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, inline

_NONE = "none"  # with this value of `--label-column`, each row is a separate stem
_SHARE = 0.95  # share of the stems that the proposed grades must contain
WIDEST = 1000.0  # largest plausible diameter, mm
_MOST_GRADES = 100


@dataclass(frozen=True)
class Grade:
    """Stems with diameters from `low` to below `high` (mm): their share as counted and as fitted (normal)."""

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
    """The diameters of a sample of stems and their statistics; `share_percent` of the stems are in a grade."""

    source: str
    stems: Rows[_MeasuredStem]
    readings: int
    summary: Summary = inline()
    normality: ShapiroWilk
    grades: Rows[Grade]
    bore: dict[str, float] = field(default_factory=dict)
    skin: dict[str, float] = field(default_factory=dict)
    """Mean bore diameter and mean thickness of the skin of the stems in each grade, mm, if these were measured."""
    share_percent: float
    synthetic: bool
    notes: tuple[Note, ...] = ()


def measure_diameters(
    path: Path,
    form: Form = Form(),
    grades: Sequence[float] = (),
    step: float = 1.0,
    column: str | None = None,
    label: str | None = None,
) -> Diameters:
    """Return the statistics and the grades of the diameters in a file.

    grades   nominal diameters of the grades, mm; proposed if empty
    step     width of a grade, mm
    column   names or numbers of the columns of diameters, separated by commas; detected if None
    label    names or numbers of the columns that together name a stem; detected if None; ``none``: each row is a stem
    """
    _check_grades(grades, step)
    table = read_table(path, form)
    labels, columns = _columns(table, column, label)
    stems, notes = _stems_of(table, labels, columns), tuple(_repeated(table, labels, columns))
    values = [sum(readings) / len(readings) for readings in stems.values()]
    if len(values) < 3 or max(values) == min(values):
        there = f"{counted(len(values), 'stem')}, {counted(len(set(values)), 'diameter')}"
        raise UsageError(f"{path}: {there}; a distribution requires at least three stems of different diameters")
    summary = summarise(values)
    grades_of_stems = _graded(values, summary, sorted(grades) or _proposed_grades(values, step), step)
    return Diameters(
        source=path.name,
        stems=Rows(map(_MeasuredStem, stems, values)),
        readings=sum(map(len, stems.values())),
        summary=summary,
        normality=shapiro_wilk(values),
        grades=grades_of_stems,
        bore=_by_grade(table, labels, table.matching(BORE, MILLIMETRES), stems, grades_of_stems),
        skin=_by_grade(table, labels, table.matching(SKIN, MILLIMETRES), stems, grades_of_stems),
        share_percent=sum(grade.share_percent for grade in grades_of_stems),
        synthetic=table.synthetic,
        notes=notes,
    )


def _by_grade(
    table: TextTable, labels: Sequence[int], columns: Sequence[int], stems: Mapping[str, Sequence[float]],
    grades: Sequence[Grade],
) -> dict[str, float]:  # fmt: skip
    """Return the mean bore or skin thickness (mm) of the stems in each grade, read from the first of `columns`."""
    lengths = _stems_of(table, labels, columns[:1], least=-1e-9)
    inside = {name: float(np.mean(readings)) for name, readings in lengths.items()}
    sizes = {name: float(np.mean(readings)) for name, readings in stems.items() if name in inside}
    for name, size in sizes.items():
        if inside[name] >= size:
            place = f"{table.source}: stem {quoted(name)[1:-1]}: {quoted(table.columns[columns[0]])}"
            raise UsageError(f"{place} is {inside[name]:g} mm, but the diameter {size:g} mm; correct one of them")
    of_grades = {g.diameter: [inside[n] for n, d in sizes.items() if g.low <= d < g.high] for g in grades}
    return {f"{diameter:g} mm": float(f"{np.mean(values):.4g}") for diameter, values in of_grades.items() if values}


def geometry_section(stems: Diameters) -> str:
    """Return the measured bore and skin as sections of a spec in YAML; empty if neither was measured."""
    bore, skin = (", ".join(f"{d}: {mm:g} mm" for d, mm in means.items()) for means in (stems.bore, stems.skin))
    specimen = f"specimen:\n  bore: {{{bore}}}\n" if bore else ""
    layers = f"layers:\n  - {{name: skin, thickness: {{{skin}}}}}\n  - {{name: pith}}\n" if skin else ""
    return specimen + layers


def _check_grades(grades: Sequence[float], step: float) -> None:
    if not 0.0 < step < WIDEST:
        raise UsageError(f"--step {step:g}: the grade width must be above 0 mm and below {WIDEST:g} mm")
    for grade in grades:
        if not 0.0 < grade < WIDEST:
            raise UsageError(f"--grades: {grade:g} mm is not a plausible stem diameter; write diameters in mm")
    if len(grades) > _MOST_GRADES:
        raise UsageError(f"--grades: too many grades ({len(grades)}); list at most {_MOST_GRADES} grades")
    for low, high in pairwise(sorted(grades)):
        if high - low < step * (1.0 - 1e-9):
            message = f"--grades: the grades of {low:g} and {high:g} mm overlap (width {step:g} mm); reduce `--step`"
            raise UsageError(message)


def _columns(table: TextTable, column: str | None, label: str | None) -> tuple[list[int], list[int]]:
    labels = _label_columns(table) if label is None else [] if label == _NONE else table.chosen(label, "labels")
    columns = table.chosen(column, "diameters") if column else _reading_columns(table, labels)
    return [i for i in labels if i not in columns], columns


def _label(cells: Sequence[str], row: int, labels: Sequence[int]) -> str:
    return " ".join(cells[i] for i in labels) if labels else str(row + 1)


def _stems_of(
    table: TextTable, labels: Sequence[int], columns: Sequence[int], least: float = 0.0
) -> dict[str, list[float]]:
    """Return all readings (mm, above `least`) of every stem; rows with the same label are of the same stem."""
    scales = {column: table.scale_of(column, MILLIMETRES, "mm") for column in columns}
    values = {column: table.values(column) for column in columns}
    stems: dict[str, list[float]] = {}
    for row, cells in enumerate(table.rows):
        name = _label(cells, row, labels)
        place = f"{table.source}: stem {quoted(name)[1:-1]}"
        for column in columns:
            if (value := values[column][row]) is not None:
                stems.setdefault(name, []).append(checked_diameter(value * scales[column], place, least))
            elif not is_missing(cells[column]):
                raise UsageError(f"{place}: {not_a_number(cells[column])}")
    return stems


def _repeated(table: TextTable, labels: Sequence[int], columns: Sequence[int]) -> Iterator[Note]:
    """Yield a note if rows with the same label are not adjacent or differ: plants of two plots may share a number."""
    words = [i for i in range(len(table.columns)) if i not in (*labels, *columns) and _has_no_numbers(table, i)]
    words = [i for i in words if all(cells[i] for cells in table.rows)]  # others contain remarks
    if not (repeated := _labels_apart(table, labels, words)):
        return
    together = sorted([*words, *labels])
    plain = all(re.fullmatch(r"\w+", table.columns[i]) for i in together)
    option = ",".join(table.columns[i] if plain else str(i + 1) for i in together)
    better = option if words and not _labels_apart(table, together) else _NONE
    differ = " or differ in other columns" if words else ""
    text = f"Rows with the same label ({series(repeated[:3])}) are not adjacent{differ}. "
    text += "Their diameters are averaged as repeated readings of one stem."
    remedy = Remedy(f"If they are different stems, use `--label-column {better}`.")
    yield Note("labels_repeated", "warning", text, remedy)


def _labels_apart(table: TextTable, labels: Sequence[int], words: Sequence[int] = ()) -> list[str]:
    rows = ((_label(cells, row, labels), *(cells[i] for i in words)) for row, cells in enumerate(table.rows))
    blocks = [name for (name, *_), _ in groupby(rows)]
    return [name for name, count in Counter(blocks).items() if count > 1]


def _has_no_numbers(table: TextTable, column: int) -> bool:
    return all(value is None for value in table.values(column))


def checked_diameter(value: float, place: str, least: float = 0.0) -> float:
    """Return a plausible stem diameter (mm); raise `UsageError` with the `place` if it is not plausible."""
    if not least < value < WIDEST:
        raise UsageError(f"{place}: {value:g} mm is not a plausible diameter; correct the value or add its unit")
    return value


def _label_columns(table: TextTable) -> list[int]:
    """Return the column that names the stems: the one with such a heading, or the first if it has words or 1, 2, …"""
    if named := table.matching(LABEL):
        return named[:1]
    counts = table.values(0) == [row + 1.0 for row in range(len(table.rows))]
    return [0] if len(table.columns) > 1 and (counts or _has_no_numbers(table, 0)) else []


def _reading_columns(table: TextTable, labels: Sequence[int]) -> list[int]:
    """Return the columns whose headings name a diameter; without headings, the only numbers besides labels."""
    inside = (*table.matching(BORE), *table.matching(SKIN))
    for words in (DIAMETER, READING):
        if named := [i for i in table.matching(words, MILLIMETRES) if i not in (*inside, *labels)]:
            return named
    numeric = [i for i in range(len(table.columns)) if i not in labels and not _has_no_numbers(table, i)]
    if len(numeric) == 1 and not table.headed:
        return numeric
    there = f"no diameter column found among {table.listed_columns()}"
    raise UsageError(f"{table.source}: {there}; specify the column with `--diameter-column`")


def _proposed_grades(values: Sequence[float], step: float = 1.0) -> list[float]:
    """Return the fewest adjacent grades, whole multiples of `step`, that contain 95 % of the stems."""
    numbers = sorted(math.floor(value / step + 0.5) for value in values)  # a stem at a limit is in the upper grade
    needed = math.ceil(_SHARE * len(numbers))
    spans = [(numbers[i + needed - 1] - numbers[i], numbers[i]) for i in range(len(numbers) - needed + 1)]
    centre = float(np.mean(numbers))
    width, first = min(spans, key=lambda span: (span[0], abs(span[1] + span[0] / 2 - centre)))
    if width >= _MOST_GRADES:
        raise UsageError(f"--step {step:g}: {width + 1} grades are needed (limit {_MOST_GRADES}); choose a larger step")
    return [(first + offset) * step for offset in range(width + 1)]


def _graded(values: Sequence[float], fit: Summary, grades: Sequence[float], step: float) -> Rows[Grade]:
    from scipy.special import ndtr

    sd, rows = fit.sd or 0.0, []
    for diameter in grades:
        low, high = diameter - step / 2, diameter + step / 2
        count = sum(low <= value < high for value in values)
        fitted = float(100.0 * (ndtr((high - fit.mean) / sd) - ndtr((low - fit.mean) / sd)))
        rows.append(Grade(diameter, low, high, count, 100.0 * count / len(values), fitted))
    return Rows(rows)
