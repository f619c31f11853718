"""Names and units of columns, from the lines above the numbers."""

import re
import unicodedata
from collections.abc import Sequence

NEWTONS = {
    "N": 1.0, "kN": 1000.0, "daN": 10.0, "mN": 0.001, "kgf": 9.80665, "kg": 9.80665, "gf": 0.00980665, "g": 0.00980665,
    "lbf": 4.4482216152605, "lb": 4.4482216152605, "牛": 1.0, "牛顿": 1.0, "千牛": 1000.0, "公斤力": 9.80665,
    "公斤": 9.80665, "千克力": 9.80665, "Н": 1.0, "кН": 1000.0, "даН": 10.0, "кгс": 9.80665, "кг": 9.80665, "뉴턴": 1.0,
}  # fmt: skip
MILLIMETRES = {
    "mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "µm": 0.001, "μm": 0.001, "in": 25.4, "inch": 25.4,
    "毫米": 1.0, "厘米": 10.0, "微米": 0.001, "мм": 1.0, "см": 10.0, "м": 1000.0, "мкм": 0.001,
}  # fmt: skip
SECONDS = {
    "s": 1.0, "sec": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0, "秒": 1.0, "毫秒": 0.001, "分": 60.0, "с": 1.0,
    "сек": 1.0, "мс": 0.001, "мин": 60.0, "ч": 3600.0, "초": 1.0, "분": 60.0, "sn": 1.0, "dk": 60.0,
}  # fmt: skip
# what else a line of units may hold, beside the columns that are wanted
OTHERS = (
    *("%", "Pa", "kPa", "MPa", "GPa", "МПа", "V", "mV", "J", "mJ", "C", "°C", "1", "-"),
    *("mm/mm", "mm/s", "mm/min", "N/mm", "N/mm2", "N/mm²", "mm2", "mm²", "strain"),
)
KNOWN = frozenset((*NEWTONS, *MILLIMETRES, *SECONDS, *OTHERS))
_IN_ANY_CASE = frozenset(unit.casefold() for unit in KNOWN)
_NUMBERS = ("1", "-")  # units on a line of their own; at the end of a name, as in `Kraft 1`, a number

_LETTER = r"A-Za-zµμ%°А-Яа-я牛顿千毫厘微米秒分公斤力克초분뉴턴"
_UNIT = rf"[{_LETTER}][{_LETTER}0-9/²]{{0,7}}"
_EASTERN = r"\u2e80-\u9fff\uac00-\ud7a3"
_LONGEST = 200  # characters; a longer name ends in no unit


def bare_unit(cell: str) -> str | None:
    """Return the unit of a cell that holds nothing else: ``N``, ``[mm]``, ``(s)``; an empty cell has none.

    >>> bare_unit("[mm]"), bare_unit("N"), bare_unit(""), bare_unit("Sec"), bare_unit("Force (N)"), bare_unit("Weg")
    ('mm', 'N', '', 'Sec', None, None)
    """
    if not cell or cell.casefold() in _IN_ANY_CASE:
        return cell
    match = re.fullmatch(rf"[\[(]\s*({_UNIT})?\s*[\])]", _narrow(cell)) if len(cell) <= _LONGEST else None
    return (match[1] or "") if match else None


def unit_in(name: str) -> str:
    """Return the unit in a column's name.

    >>> [unit_in(name) for name in ("Force (kN)", "位移/mm", "Kraft [N]", "Load, N", "force", "Weg in mm", "力（牛）")]
    ['kN', 'mm', 'N', 'N', '', 'mm', '牛']
    >>> [unit_in(name) for name in ("Сила, кН", "位移mm", "力（ｋＮ）", "시간(초)")]
    ['кН', 'mm', 'kN', '초']
    """
    if len(name) > _LONGEST:
        return ""
    name = _narrow(name)
    match = re.search(rf"(?:[\[(]\s*({_UNIT})\s*[\])]|[/,_]\s*({_UNIT}))\s*$", name)
    if match:
        return match[1] or match[2]
    words = name.split()
    if len(words) > 1 and words[-1] in KNOWN and words[-1] not in _NUMBERS:
        return words[-1]
    joined = re.search(rf"[{_EASTERN}]([A-Za-z%]{{1,3}})$", name)
    return joined[1] if joined and joined[1] in KNOWN else ""


def _narrow(text: str) -> str:
    """Return a text with the wide letters and brackets of Chinese input as plain ones."""
    return unicodedata.normalize("NFKC", text)


def names_and_units(above: Sequence[Sequence[str]], width: int) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Return names and units of `width` columns, and how many of the lines `above` gave them (nearest line first)."""
    if len(above) == 2 and all(bare_unit(cell) is not None for cell in above[0]) and any(above[0]):
        return tuple(above[1]), tuple(bare_unit(cell) or "" for cell in above[0]), 2
    if above:
        return tuple(above[0]), tuple(unit_in(name) for name in above[0]), 1
    return tuple(f"column {number + 1}" for number in range(width)), ("",) * width, 0


def millimetres_in(text: str) -> float | None:
    """Return the first length in mm that a text holds; a speed is none.

    >>> [millimetres_in(text) for text in ("12.1 mm", "A, d = 12,1mm", "8毫米-3", "A", "10 mm/min")]
    [12.1, 12.1, 8.0, None, None]
    """
    length = r"(?<![\d.,])(\d{1,9}(?:[.,]\d{1,9})?)[ _]?(?:mm|毫米|мм)(?!\s*/|[²³])"
    match = re.search(length, text, re.IGNORECASE | re.ASCII)
    return float(match[1].replace(",", ".")) if match else None
