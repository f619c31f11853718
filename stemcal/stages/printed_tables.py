"""Printed results against recomputed ones, cell by cell, when a published study is analysed again."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from stemcal.doe.regression.anova import AnovaRow
from stemcal.doe.regression.fit_statistics import Coefficient
from stemcal.doe.screening.effect_sizes import Effect
from stemcal.doe.validation.comparison import Validation, compare_conditions
from stemcal.errors import SpecError, SpecProblem
from stemcal.files.typed import Tagged
from stemcal.solvers.csv_table import read_cells
from stemcal.stages.printed_numbers import Cell, Disagreement, compare_cells
from stemcal.study.model import Study

_COLUMNS = {
    "effect": "effect",
    "contribution_pct": "contribution_percent",
    "contribution_percent": "contribution_percent",
    "contribution": "contribution_percent",
    "sum_of_squares": "sum_of_squares",
    "df": "df",
    "mean_square": "mean_square",
    "f": "f",
    "p": "p",
    "value": "value",
    "coefficient": "value",
    "error_percent": "error_percent",
    "error_pct": "error_percent",
    "error_pct_printed": "error_percent",
}


@dataclass(frozen=True)
class Agreement:
    """How many printed cells agree with what their data give."""

    agree: int
    of: int


class Contradiction(Tagged):
    """Something that a paper prints and that the rest of it contradicts, a class for each kind."""

    @property
    def of_sign(self) -> bool:
        """Whether a number has the wrong sign."""
        return False


class Difference(Contradiction):
    """A printed cell that does not agree, and its table."""

    table: str
    cell: Disagreement

    @property
    def of_sign(self) -> bool:
        """Whether the cell has the wrong sign."""
        return self.cell.nature == "sign"


@dataclass(frozen=True)
class Audited:
    """Printed cells against computed ones, altogether and by table."""

    agree: int
    of: int
    tables: dict[str, Agreement]
    differences: tuple[Difference, ...]


def audit_screening(study: Study, effects: Sequence[Effect]) -> Audited | None:
    """Compare the printed effects; None if the spec names none."""
    if study.published is None or study.published.screening is None:
        return None
    computed = {effect.factor: effect for effect in effects}
    return audit_cells({"screening": list(_cells(study, study.published.screening, computed))})


def audit_surface(study: Study, anova: Sequence[AnovaRow], coefficients: Sequence[Coefficient]) -> Audited | None:
    """Compare the printed analysis of variance and coefficients; None if the spec names neither."""
    published = study.published
    if published is None or (published.anova is None and published.coefficients is None):
        return None
    tables: dict[str, list[Cell]] = {}
    if published.anova is not None:
        rows = {term_of(study, row.source): row for row in anova}
        tables["anova"] = list(_cells(study, published.anova, rows))
    if published.coefficients is not None:
        terms = {term_of(study, row.term): row for row in coefficients}
        tables["coefficients"] = list(_cells(study, published.coefficients, terms))
    return audit_cells(tables)


def audit_validation(study: Study) -> Audited | None:
    """Compare the printed errors with those of the printed forces; None if the spec names none."""
    if study.published is None or study.published.validation is None:
        return None
    result, printed = printed_validation(study, study.published.validation)
    cells = [
        (f"{row.condition:g}", "error_percent", text, row.error_percent)
        for text, row in zip(printed, result.rows, strict=True)
    ]
    return audit_cells({"validation": cells})


def printed_validation(study: Study, path: Path) -> tuple[Validation, list[str]]:
    """Return the errors that the printed forces give, and the errors as printed."""
    header, rows = table(path)
    columns = [_column(header, path, *names) for names in _VALIDATION]
    printed = [tuple(cells[column] for column in columns) for cells in rows]
    conditions, measured, simulated = (
        [_number(path, cells[i]) for cells in printed] for i in range(len(_VALIDATION) - 1)
    )
    result = compare_conditions(conditions, measured, simulated, study.targets.calibrate_at)
    return result, [texts[-1] for texts in printed]


_VALIDATION = (
    ("diameter", "diameter_mm"),
    ("measured", "measured_n"),
    ("simulated", "simulated_n"),
    ("error_percent", "error_pct", "error_pct_printed"),
)


def audit_cells(tables: Mapping[str, Sequence[Cell]]) -> Audited:
    """Count the cells that agree, altogether and by table, and list those that do not."""
    differ = {name: compare_cells(cells) for name, cells in tables.items()}
    counts = {name: Agreement(len(cells) - len(differ[name]), len(cells)) for name, cells in tables.items()}
    return Audited(
        sum(count.agree for count in counts.values()),
        sum(count.of for count in counts.values()),
        counts,
        tuple(Difference(name, cell) for name, found in differ.items() for cell in found),
    )


def _cells(study: Study, path: Path, computed: Mapping[str, object]) -> Iterator[Cell]:
    """Pair every printed number with the computed one: the first column names the row."""
    header, rows = table(path)
    fields = [_COLUMNS.get(heading.lower()) for heading in header]
    for cells in rows:
        term = term_of(study, cells[0])
        row = computed.get(term)
        for heading, name, text in zip(header[1:], fields[1:], cells[1:], strict=False):
            if name is not None and text.strip():
                yield term, heading if len(header) > 2 else "", text, getattr(row, name, None)


def table(path: Path) -> tuple[list[str], list[list[str]]]:
    """Return heading and rows of a printed table, as texts."""
    (_, header), *rows = read_cells(path)[0]
    return [heading.strip() for heading in header], [cells for _, cells in rows]


def printed_terms(study: Study, path: Path) -> dict[str, float]:
    """Return a printed table of coefficients: term → value."""
    return {term_of(study, cells[0]): _number(path, cells[1]) for cells in table(path)[1]}


def term_of(study: Study, printed: str) -> str:
    """Return a term by factor names, interactions in the order of the spec.

    Factors may be printed by name or symbol, squares as ``X4^2`` or ``X4²``, the mean as ``Intercept``.
    """
    text = printed.strip().replace("²", "^2")
    if text.lower() in ("intercept", "constant", "1"):
        return "1"
    names = {factor.symbol: factor.name for factor in study.factors}
    parts = [re.sub(r"^[^^]+", lambda m: names.get(m[0], m[0]), part.strip()) for part in text.split(":")]
    order = {name: index for index, name in enumerate(study.names)}
    return ":".join(sorted(parts, key=lambda part: order.get(part, 0)))


def _column(header: Sequence[str], path: Path, *names: str) -> int:
    for index, heading in enumerate(header):
        if heading.lower() in names:
            return index
    raise SpecError([SpecProblem(path.name, 1, 1, names[0], "has no column", f"call one {' or '.join(names)}")])


def _number(path: Path, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise SpecError([SpecProblem(path.name, 1, 1, "", f"{text!r} is not a number", "mend it")]) from None
