"""Names and units of columns, from the lines above the numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

NEWTONS = {
    "N": 1.0, "kN": 1000.0, "daN": 10.0, "mN": 0.001, "kgf": 9.80665, "kg": 9.80665, "gf": 0.00980665, "g": 0.00980665,
    "lbf": 4.4482216152605, "lb": 4.4482216152605, "牛": 1.0, "牛顿": 1.0, "千牛": 1000.0,
}  # fmt: skip
MILLIMETRES = {
    "mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "µm": 0.001, "μm": 0.001, "in": 25.4, "inch": 25.4,
    "毫米": 1.0, "厘米": 10.0, "微米": 0.001,
}  # fmt: skip
# what else a line of units may hold, beside the columns that are wanted
OTHERS = (
    *(
        "s",
        "sec",
        "ms",
        "min",
        "h",
        "秒",
        "分",
        "%",
        "Pa",
        "kPa",
        "MPa",
        "GPa",
        "V",
        "mV",
        "J",
        "mJ",
        "C",
        "°C",
        "1",
        "-",
    ),
    *("mm/mm", "mm/s", "mm/min", "N/mm", "N/mm2", "N/mm²", "mm2", "mm²", "strain"),
)
KNOWN = frozenset((*NEWTONS, *MILLIMETRES, *OTHERS))

_UNIT = r"[A-Za-zµμ%°牛顿千毫厘微米秒分][A-Za-z0-9µμ%/²牛顿毫厘微米]{0,7}"


def bare_unit(cell: str) -> str | None:
    """Return the unit of a cell that holds nothing else: ``N``, ``[mm]``, ``(s)``; an empty cell has none.

    >>> bare_unit("[mm]"), bare_unit("N"), bare_unit(""), bare_unit("Force (N)"), bare_unit("Weg")
    ('mm', 'N', '', None, None)
    """
    if not cell or cell in KNOWN:
        return cell
    match = re.fullmatch(rf"[\[(（]\s*({_UNIT})?\s*[\])）]", cell)
    return (match[1] or "") if match else None


def unit_in(name: str) -> str:
    """Return the unit in a column's name.

    >>> [unit_in(name) for name in ("Force (kN)", "位移/mm", "Kraft [N]", "Load, N", "force", "Weg in mm", "力（牛）")]
    ['kN', 'mm', 'N', 'N', '', 'mm', '牛']
    """
    match = re.search(rf"(?:[\[(（]\s*({_UNIT})\s*[\])）]|[/,_]\s*({_UNIT}))\s*$", name)
    if match:
        return match[1] or match[2]
    words = name.split()
    return words[-1] if len(words) > 1 and words[-1] in KNOWN else ""


def names_and_units(above: Sequence[Sequence[str]], width: int) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Return names and units of `width` columns, and how many of the lines `above` gave them (nearest line first)."""
    if len(above) == 2 and all(bare_unit(cell) is not None for cell in above[0]) and any(above[0]):
        return tuple(above[1]), tuple(bare_unit(cell) or "" for cell in above[0]), 2
    if above:
        return tuple(above[0]), tuple(unit_in(name) for name in above[0]), 1
    return tuple(f"column {number + 1}" for number in range(width)), ("",) * width, 0
