"""Numbers as people and machines write them: decimal point or comma, thousands set apart, the long minus."""

from __future__ import annotations

import re

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
# 1,234.5: groups of three, the first without a leading zero, so that 0.250 is never taken for 250
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(?:([,'’\u00a0\u202f])\d{3})(?:\1\d{3})*(?:\.\d*)?")
MISSING = frozenset({"", "nan", "na", "n/a", "-", "--", "---", "null", "none", "inf", "-inf"})


def as_number(cell: str, decimal: str = ".") -> float | None:
    """Return the number a cell holds, None if it holds none.

    >>> as_number("3,5", ","), as_number("3,5"), as_number("−1.2e3"), as_number("7 mm")
    (3.5, None, -1200.0, None)
    >>> as_number("1,234.5"), as_number("1.234,5", ","), as_number("1'234.5"), as_number("0,250")
    (1234.5, 1234.5, 1234.5, None)
    """
    text = cell.strip().strip('"').strip().replace("−", "-")
    if decimal != ".":
        text = text.translate(_SWAPPED)
    if _NUMBER.fullmatch(text):
        return float(text)
    grouped = _GROUPED.fullmatch(text)
    return float(text.replace(grouped[1], "")) if grouped else None


_SWAPPED = str.maketrans({".": ",", ",": "."})


def is_missing(cell: str) -> bool:
    """Tell whether a cell says that there is no value.

    >>> is_missing(""), is_missing("NaN"), is_missing("---"), is_missing("thick")
    (True, True, True, False)
    """
    return cell.strip().strip('"').strip().lower() in MISSING
