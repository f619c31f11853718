"""Does a printed number agree with the computed one, at the digits that were printed?"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal

_NUMBER = re.compile(r"^(?P<bound>[<>])?(?P<number>[+-]?\d+(?:\.\d*)?(?:e[+-]?\d+)?|[+-]?\.\d+(?:e[+-]?\d+)?)$")


Cell = tuple[str, str, str, float | None]
"""Term and column of a printed number, its print, and the number that the data give, if they give one."""


@dataclass(frozen=True)
class Disagreement:
    """One cell whose printed number is not what the data give.

    `nature` is ``sign``, ``value`` or ``unreadable``.
    """

    term: str
    column: str
    printed: str
    value: float | None
    nature: str


def agrees(printed: str, value: float) -> bool:
    """Compare at the printed number of digits; a half in the next digit may go either way.

    >>> agrees("16,225.35", 16225.352), agrees("<0.0001", 5e-8), agrees("−2.88", 2.883)
    (True, True, False)
    """
    bound, number = _parse(printed)
    if bound == "<":
        return value < float(number)
    if bound == ">":
        return value > float(number)
    # Half a unit of the last digit, and a hair for binary rounding.
    slack = 0.5 * float(_last_digit(number)) * (1.0 + 1e-9) + 1e-15 * abs(value)
    return abs(value - float(number)) <= slack


def compare_cells(cells: Iterable[Cell]) -> list[Disagreement]:
    """Find the cells that disagree; cells printed empty are skipped."""
    return [
        Disagreement(term, column, printed.strip(), value, nature)
        for term, column, printed, value in cells
        if _cleaned(printed) and (nature := _nature(printed, value))
    ]


def _nature(printed: str, value: float | None) -> str:
    """Return what is wrong with a printed number, "" if nothing is."""
    try:
        bound, number = _parse(printed)
    except ValueError:
        return "unreadable"
    if value is None:
        return "value"
    if agrees(printed, value):
        return ""
    return "sign" if not bound and number != 0 and agrees(str(-number), value) else "value"


def decimals_of(printed: str) -> int:
    """Return how many decimals a number is printed with; fewer than none where it ends in zeros by its power of ten.

    >>> decimals_of("16,225.35"), decimals_of("3e2")
    (2, -2)
    """
    return -int(_parse(printed)[1].as_tuple().exponent)


def _cleaned(printed: str) -> str:
    """Strip what typesetting adds: thousands separators, spaces, stars, percent signs, other minus signs."""
    text = re.sub(r"[\s,*%\u2009\u202f\u00a0]", "", printed)
    return re.sub("[\u2212\u2013\u2010\u2011]", "-", text).lower()


def _parse(printed: str) -> tuple[str, Decimal]:
    match = _NUMBER.match(_cleaned(printed))
    if match is None:
        raise ValueError(f"{printed!r} is not a printed number")
    return match["bound"] or "", Decimal(match["number"])


def _last_digit(number: Decimal) -> Decimal:
    """One unit of the last printed digit."""
    return Decimal(1).scaleb(int(number.as_tuple().exponent))
