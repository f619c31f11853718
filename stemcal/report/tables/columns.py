"""Columns that several tables share, and how their values are written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from stemcal.files.rows import Column
from stemcal.naming import FIRST, FORCE, Named, Naming
from stemcal.runs.outcome import Outcome
from stemcal.text.names import Names
from stemcal.text.numbers import decimals, fixed, probability, short, significant
from stemcal.text.tables import failed

ERROR = Column("error_percent", "Error", "%", fixed)


def condition(naming: Naming, of: Callable[[Any], float | None] | None = None) -> tuple[Column, ...]:
    """Return the column of the condition; none where a study has none."""
    named = naming.condition
    return () if named is None else (Column("condition", named.capital, named.written, short, of),)


def factor(names: Names, label: str = "Factor") -> Column:
    """Return the column that names a factor."""
    return Column("factor", label, form=names.factor, words=True)


def levels(factors: Iterable[str], names: Names, form: Callable[[Any], str] = significant) -> tuple[Column, ...]:
    """Return a column for the level of each factor."""
    return tuple(Column(name, names.factor(name), form=form) for name in factors)


def level_list(levels: Mapping[str, float], names: Names) -> str:
    """List levels of factors."""
    return ", ".join(f"{names.factor(name)} {significant(value)}" for name, value in levels.items())


def response(named: Named, label: str = "") -> Column:
    """Return the column of the first response of runs: its value, or why there is none."""
    return Column(FIRST, label or named.capital, named.written, significant, lambda row: value_or_reason(row.outcome))


def value_or_reason(outcome: Outcome) -> float | str:
    """Return the first response of a run, or why there is none."""
    return failed(outcome.reason) if outcome.response is None else outcome.response


def with_unit(value: float | None, named: Named, form: Callable[[float | None], str] = significant) -> str:
    """Return a value of a response with its unit, where rows have several."""
    return f"{form(value)}{named.beside}"


def starred(value: tuple[float | None, str] | None) -> str:
    """Return a p-value with its stars, the digits aligned; nothing where there is none.

    >>> starred((0.0022, "**")), starred((0.4, "")), starred((None, ""))
    ('0.0022 **', '0.4000   ', '')
    """
    return "" if value is None or value[0] is None else f"{probability(value[0])} {value[1]:<2}"


def squares(value: float | None) -> str:
    """Return a sum of squares with two decimals, more where they are needed to see it."""
    if value is None:
        return ""
    return fixed(value) if abs(value) >= 1.0 or value == 0.0 else significant(value)


def ratio(value: float | None) -> str:
    """Return a ratio F, more decimals below 1; nothing where there is none."""
    return "" if value is None else fixed(value, 2 if value >= 1.0 else 4)


def response_decimals(response: Named, values: Iterable[float | None], usual: int = 2) -> int:
    """Return the decimals of a response's values: those of forces in N, more where a response is small."""
    return usual if response == FORCE else decimals(values, usual)


def to_decimals(places: int) -> Callable[[float | None], str]:
    """Return what writes numbers with so many decimals."""
    return lambda value: fixed(value, places)
