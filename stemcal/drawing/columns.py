"""Table columns that several stages use, and the formatting of their values."""

from collections.abc import Callable, Iterable
from typing import Any

from stemcal.drawing.table import Column
from stemcal.formats import decimals, direction, fixed, probability, short, significant
from stemcal.vocabulary import FIRST, FORCE, Variable, Vocabulary, Wording

Form = Callable[[Any], str]

ERROR = Column("error_percent", "Error", "%", direction)


def condition(naming: Vocabulary) -> tuple[Column, ...]:
    """Return a tuple with the column of the condition; empty if the study has no condition."""
    named = naming.condition
    return () if named is None else (Column("condition", named.capital, named.written, short),)


def factor(names: Wording) -> Column:
    """Return the column of factors, with their labels or names."""
    return Column("factor", "Factor", form=names.factor, words=True)


def levels(factors: Iterable[str], names: Wording, form: Form = significant) -> tuple[Column, ...]:
    """Return a column with the levels of each factor."""
    return tuple(Column(name, names.factor(name), form=form) for name in factors)


def simulated(named: Variable, label: str = "") -> Column:
    """Return the column of the simulated response of each run: its value, or the reason why the run failed."""

    def of(row: Any) -> float | str:
        value: float | None = row.outcome.response
        if value is not None:
            return value
        return f"failed ({row.outcome.reason})" if row.outcome.reason else "failed"

    return Column(FIRST, label or named.capital, named.written, significant, of)


def measured_columns(names: Wording, each: bool, columns: Iterable[tuple[str, str, Form]]) -> list[Column]:
    """Return the column of the condition, then `columns` (key, label, format), with the unit of the first response.

    If `each` row has its own response, the first and the last column contain its name and its unit.
    """
    naming, unit = names.naming, "" if each else names.response.written
    values = [Column(key, label, unit, form) for key, label, form in columns]
    if not each:
        return [*condition(naming), *values]
    first = Column("response", "Response", of=lambda row: naming.named(row["response"]).noun)
    last = Column("unit", "Unit", of=lambda row: naming.named(row["response"]).written)
    return [first, *condition(naming), *values, last]


def starred(value: tuple[float | None, str] | None) -> str:
    """Format a p-value and its significance stars, padded so that the digits are aligned; empty for None.

    >>> starred((0.0022, "**")), starred((0.4, "")), starred((None, ""))
    ('0.0022 **', '0.4000   ', '')
    """
    return "" if value is None or value[0] is None else f"{probability(value[0])} {value[1]:<2}"


def squares(value: float | None) -> str:
    """Format a sum of squares with two decimals, or with four significant digits below 1; empty for None."""
    if value is None:
        return ""
    return fixed(value) if abs(value) >= 1.0 or value == 0.0 else significant(value)


def ratio(value: float | None) -> str:
    """Format an F ratio with two decimals, or with four below 1; empty for None."""
    return "" if value is None else fixed(value, 2 if value >= 1.0 else 4)


def response_decimals(response: Variable, values: Iterable[float | None], usual: int = 2) -> int:
    """Return the number of decimals for values of a response: `usual` for the force, more for small other values."""
    return usual if response == FORCE else decimals(values, usual)


def to_decimals(places: int) -> Form:
    """Return a function that formats numbers with a fixed number of decimals."""
    return lambda value: fixed(value, places)


def scores(names: Wording) -> list[str]:
    """Return a footnote that explains scores, if a response of the study is a score of a curve."""
    text = (
        "A score is the signed deviation of a curve from the mean measured curve along one mode. The error of a score "
        "is given as a percentage of the maximum force."
    )
    return [text] if any(named.apart for named in names.naming.responses) else []


_VALUES = "measured", "predicted", "simulated"  # keys of rows that contain values of the response


def from_means(rows: Iterable[dict[str, Any]], names: Wording) -> list[dict[str, Any]]:
    """Return the rows of a table; values of curve scores are replaced by their differences from the measured mean."""
    shown = []
    for row in rows:
        if (named := names.naming.named(row["response"])).apart:
            row = row | {k: named.table_value(row[k], row["measured"]) for k in _VALUES if row.get(k) is not None}
        shown.append(row)
    return shown
