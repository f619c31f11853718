"""Columns and tables that several stages share, and how their values are written."""

from collections.abc import Callable, Iterable
from typing import Any

from stemcal.drawing.table import Column
from stemcal.formats import decimals, direction, fixed, probability, short, significant
from stemcal.vocabulary import FIRST, FORCE, Variable, Vocabulary, Wording

Form = Callable[[Any], str]

ERROR = Column("error_percent", "Error", "%", direction)


def condition(naming: Vocabulary) -> tuple[Column, ...]:
    """Return the column of the condition; none where a study has none."""
    named = naming.condition
    return () if named is None else (Column("condition", named.capital, named.written, short),)


def factor(names: Wording) -> Column:
    """Return the column that names a factor."""
    return Column("factor", "Factor", form=names.factor, words=True)


def levels(factors: Iterable[str], names: Wording, form: Form = significant) -> tuple[Column, ...]:
    """Return a column for the level of each factor."""
    return tuple(Column(name, names.factor(name), form=form) for name in factors)


def simulated(named: Variable, label: str = "") -> Column:
    """Return the column of what runs gave: the value, or why there is none."""

    def of(row: Any) -> float | str:
        value: float | None = row.outcome.response
        if value is not None:
            return value
        return f"failed ({row.outcome.reason})" if row.outcome.reason else "failed"

    return Column(FIRST, label or named.capital, named.written, significant, of)


def measured_columns(names: Wording, each: bool, columns: Iterable[tuple[str, str, Form]]) -> list[Column]:
    """Return columns of responses, headed by the unit; if `each` row has another response, with names and units."""
    naming, unit = names.naming, "" if each else names.response.written
    values = [Column(key, label, unit, form) for key, label, form in columns]
    if not each:
        return [*condition(naming), *values]
    first = Column("response", "Response", of=lambda row: naming.named(row["response"]).noun)
    last = Column("unit", "Unit", of=lambda row: naming.named(row["response"]).written)
    return [first, *condition(naming), *values, last]


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


def response_decimals(response: Variable, values: Iterable[float | None], usual: int = 2) -> int:
    """Return the decimals of a response's values: those of forces in N, more where a response is small."""
    return usual if response == FORCE else decimals(values, usual)


def to_decimals(places: int) -> Form:
    """Return a function that writes numbers with fixed decimals."""
    return lambda value: fixed(value, places)


def scores(names: Wording) -> list[str]:
    """Return the explanation of scores, which are deviations from a measured mean."""
    text = (
        "A score is the signed deviation of a curve from the mean measured curve along one mode. The error of a score "
        "is given as a percentage of the maximum force."
    )
    return [text] if any(named.apart for named in names.naming.responses) else []


_VALUES = "measured", "predicted", "simulated"


def from_means(rows: Iterable[dict[str, Any]], names: Wording) -> list[dict[str, Any]]:
    """Return rows of responses; of one that counts so, how far values are from the measured mean."""
    shown = []
    for row in rows:
        if (named := names.naming.named(row["response"])).apart:
            row = row | {key: named.counted(row[key], row["measured"]) for key in _VALUES if row.get(key) is not None}
        shown.append(row)
    return shown
