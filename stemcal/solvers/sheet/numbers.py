"""A cell as a number in the unit that is wanted, or why it is none."""

import re
from dataclasses import dataclass

from stemcal.measured.headings import as_number
from stemcal.study.types.units import UnitError, convert, from_internal, parse_unit

MOST = 1e30  # numbers whose powers are still numbers
_WITH_UNIT = re.compile(r"([-+−]?(?:\d[\d.,'’]*|[.,]\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s.,].*)")
_OTHER = {".": ",", ",": "."}


@dataclass(frozen=True)
class Unread:
    """Why a cell holds no number: it is ``no_number``, ``ambiguous``, ``too_large`` or of an ``other_unit``."""

    why: str
    unit: str = ""
    readings: tuple[float, ...] = ()


def number_in(cell: str, decimal: str, heading: str, wanted: str) -> float | Unread:
    """Return the number of a cell in the unit `wanted`; one without a unit has that of its column's `heading`.

    >>> number_in("12,5", ".", "N", "N"), number_in("0.0125 kN", ".", "N", "N"), number_in("12.5", ".", "kN", "N")
    (12.5, 12.5, 12500.0)
    >>> number_in("1,234", ".", "N", "N").why, number_in("1,234", ",", "N", "N"), number_in("12 mm", ".", "N", "N").why
    ('ambiguous', 1.234, 'other_unit')
    """
    found, unit = _number(cell, decimal), heading
    if isinstance(found, Unread) and found.why == "no_number" and (match := _WITH_UNIT.fullmatch(cell)):
        found, unit = _number(match[1], decimal), match[2].strip()
    if isinstance(found, Unread):
        return found
    value = _converted(found, unit, wanted)
    if value is None:
        return Unread("other_unit", unit)
    return value if abs(value) <= MOST else Unread("too_large")


def readings(cell: str) -> list[float]:
    """Return what a cell without a unit may mean, by either decimal mark."""
    return [value for mark in _OTHER if (value := as_number(cell, mark)) is not None]


def _number(cell: str, decimal: str) -> float | Unread:
    """Read a number; a single mark before three digits, 1,234, means two things where the sheet does not tell."""
    first, second = as_number(cell, decimal), as_number(cell, _OTHER[decimal])
    if first is None or _OTHER[decimal] not in cell:
        first, second = (second, None) if first is None else (first, None)
    if first is None:
        return Unread("no_number")
    return first if second is None or second == first else Unread("ambiguous", readings=(first, second))


def _converted(value: float, unit: str, wanted: str) -> float | None:
    """Return a value in another unit, None if that is not known or measures something else."""
    if unit == wanted or (not unit and wanted == "1"):
        return value
    try:
        known, into = parse_unit(unit), parse_unit(wanted)
        return value if known == into else from_internal(convert(value, unit, into.dimension), wanted)
    except UnitError:
        return None
