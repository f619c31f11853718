"""Numbers as people and machines write them: decimal point or comma, thousands set apart, the long minus."""

import math
import re

LONGEST = 64  # characters; what is longer holds no number
# every alternative begins with another character than the one before may end with, so that no text is read twice
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?")
# 1,234.5: groups of three, the first without a leading zero, so that 0.250 is never taken for 250
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(?:([,'’\u00a0\u202f])\d{3})(?:\1\d{3})*(?:\.\d*)?")
MISSING = frozenset(
    {"", "nan", "na", "n/a", "#n/a", "#div/0!", "#value!", "-", "--", "---", "null", "none", "inf", "-inf"}
)


def as_number(cell: str, decimal: str = ".") -> float | None:
    """Return the finite number a cell holds, None if it holds none.

    >>> as_number("3,5", ","), as_number("3,5"), as_number("−1.2e3"), as_number("7 mm"), as_number("1e400")
    (3.5, None, -1200.0, None, None)
    >>> as_number("1,234.5"), as_number("1.234,5", ","), as_number("1'234.5"), as_number("0,250")
    (1234.5, 1234.5, 1234.5, None)
    """
    text = _bare(cell)
    if not 0 < len(text) <= LONGEST:
        return None
    text = text.replace("−", "-")
    if decimal != ".":
        text = text.translate(_SWAPPED)
    if not _NUMBER.fullmatch(text):
        grouped = _GROUPED.fullmatch(text)
        if grouped is None:
            return None
        text = text.replace(grouped[1], "")
    value = float(text)
    return value if math.isfinite(value) else None


_SWAPPED = str.maketrans({".": ",", ",": "."})


def _bare(cell: str) -> str:
    return cell.strip().strip('"').strip()


def is_missing(cell: str) -> bool:
    """Tell whether a cell says that there is no value.

    >>> is_missing(""), is_missing("NaN"), is_missing("---"), is_missing("thick")
    (True, True, True, False)
    """
    return _bare(cell).lower() in MISSING


def shown(cell: str, most: int = 40) -> str:
    """Return a cell for a message: quoted, on one line, its end left out where it is long.

    >>> shown("thick"), shown("1" * 50, 8)
    ("'thick'", "'11111111…'")
    """
    return repr(cell if len(cell) <= most else f"{cell[:most]}…")
