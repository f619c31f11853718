"""Does a printed number agree with the computed one, at the digits that were printed?"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal

_NUMBER = re.compile(r"^(?P<bound>[<>])?(?P<number>[+-]?\d+(?:\.\d*)?(?:e[+-]?\d+)?|[+-]?\.\d+(?:e[+-]?\d+)?)$")


@dataclass(frozen=True)
class Disagreement:
    """One cell whose printed number is not what the data give.

    `kind` is ``sign``, ``value`` or ``unreadable``.
    """

    label: str
    printed: str
    value: float | None
    kind: str
    sentence: str


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


def compare_cells(cells: Iterable[tuple[str, str, float | None]]) -> list[Disagreement]:
    """Find the cells (label, printed, computed) that disagree; cells printed empty are skipped."""
    found = [_compare(label, printed, value) for label, printed, value in cells if _cleaned(printed)]
    return [disagreement for disagreement in found if disagreement is not None]


def _compare(label: str, printed: str, value: float | None) -> Disagreement | None:
    shown = printed.strip()
    try:
        bound, number = _parse(printed)
    except ValueError:
        return Disagreement(
            label, shown, value, "unreadable", f"{label}: the paper prints {shown!r}, which is no number"
        )
    if value is None:
        sentence = f"{label}: the paper prints {_signed(shown)}, its data give no such number"
        return Disagreement(label, shown, None, "value", sentence)
    if agrees(printed, value):
        return None
    computed = _formatted(value, number)
    if not bound and number != 0 and agrees(str(-number), value):
        sign = "+" if value > 0 else ""
        sentence = f"{label}: the paper prints {_signed(shown)}, its data give {sign}{computed}: the sign differs"
        return Disagreement(label, shown, value, "sign", sentence)
    sentence = f"{label}: the paper prints {_signed(shown)}, its data give {computed}"
    return Disagreement(label, shown, value, "value", sentence)


def _cleaned(printed: str) -> str:
    """Strip what typesetting adds: thousands separators, spaces, stars, percent signs, other minus signs."""
    text = re.sub(r"[\s,*%\u2009\u202f\u00a0]", "", printed)
    return re.sub("[\u2212\u2013\u2010\u2011]", "-", text).lower()


def _parse(printed: str) -> tuple[str, Decimal]:
    match = _NUMBER.match(_cleaned(printed))
    if match is None:
        raise ValueError(f"{printed!r} is no printed number")
    return match["bound"] or "", Decimal(match["number"])


def _last_digit(number: Decimal) -> Decimal:
    """One unit of the last printed digit."""
    return Decimal(1).scaleb(int(number.as_tuple().exponent))


def _formatted(value: float, number: Decimal) -> str:
    """Write the value with one digit more than was printed."""
    decimals = max(1 - int(number.as_tuple().exponent), 0)
    if value != 0.0 and abs(value) < 0.5 * 10.0**-decimals:
        return _signed(f"{value:.2g}")
    return _signed(f"{value:.{decimals}f}")


def _signed(text: str) -> str:
    return text.replace("-", "\u2212")
