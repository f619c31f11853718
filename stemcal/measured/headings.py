"""Recognise the names and units of columns in the headings of laboratory files, in many languages.

A word in an alphabetic script must be a whole word of the heading. Words in Chinese, Japanese and Korean, and terms of
several words, may be anywhere in it. The file `words.csv` has the words, `units.csv` the units with their factors.
"""

import csv
import re
import unicodedata
from collections.abc import Sequence
from importlib.resources import files


def _rows(file: str) -> list[dict[str, str]]:
    return list(csv.DictReader(files("stemcal.measured").joinpath(file).read_text("utf-8").splitlines()))


_WORDS = {row["kind"]: tuple(row["words"].split("; ")) for row in _rows("words.csv")}
FORCE, TRAVEL, DIAMETER, BORE, SKIN = (_WORDS[kind] for kind in ("force", "travel", "diameter", "bore", "skin"))
LABEL, FILE, GRADE = (_WORDS[kind] for kind in ("label", "file", "grade"))
READING = _WORDS["reading"]  # name a diameter only if no heading contains a word of `DIAMETER`
NOT_MEANT = _WORDS["not meant"]  # stress, strain and rates: their names may contain a word for force or travel
_ALONE = ("last",)  # German for load if it is the only word of a heading; otherwise an English adjective
_GERMAN = ("kraft", "weg", "zeit")  # also recognised at the end of a word: Standardkraft, Traversenweg


def folded(text: str) -> str:
    """Normalise a text for comparison: lower case, full-width letters as ASCII, and the Turkish İ and ı as i."""
    return unicodedata.normalize("NFKC", text).replace("İ", "i").replace("ı", "i").casefold()


def is_called(name: str, words: Sequence[str]) -> bool:
    """Check whether the name of a column contains one of the words.

    >>> is_called("Max. Force (N)", FORCE), is_called("最大力/N", FORCE), is_called("reinforced", FORCE)
    (True, True, False)
    >>> is_called("Standardkraft", FORCE), is_called("Prüfkraft in N", FORCE), is_called("Déplacement", TRAVEL)
    (True, True, True)
    >>> is_called("Last [kN]", FORCE), is_called("Last in kN", FORCE), is_called("Last reading", FORCE)
    (True, True, False)
    """
    lowered = folded(name)
    parts = set(re.findall(r"[^\W\d_]+\d?\.?|\d+", lowered)) | set(re.findall(r"[^\W\d_]+", lowered))
    first, *rest = re.split(r"[\s\[(/,]+", lowered.rstrip(")]"))
    is_alone = all(word == "in" or word in _IN_ANY_CASE for word in rest)  # no word but units
    sought = [folded(word) for word in words if word not in _ALONE or (word == first and is_alone)]
    ends = tuple(word for word in sought if word in _GERMAN)
    # words in Chinese, Japanese and Korean, and terms of several words
    anywhere = {word for word in sought if min(word) >= "\u1100" or " " in word}
    return any(word in lowered if word in anywhere else word in parts for word in sought) or any(
        part.endswith(ends) for part in parts if ends
    )


def words_known(text: str) -> int:
    """Count the known words with letters beyond ASCII in a text; in a wrong encoding these words are garbled.

    >>> words_known("Posuv [mm];Zatížení [N]"), words_known("Posuv [mm];Zatí¾ení [N]"), words_known("Kraft [N]")
    (1, 0, 0)
    """
    known = {folded(word) for word in (*FORCE, *TRAVEL, *DIAMETER, *BORE, *SKIN, *LABEL) if not word.isascii()}
    return sum(word in known for word in re.findall(r"[^\W\d_]+", folded(text)))


_UNITS = _rows("units.csv")
NEWTONS, MILLIMETRES = (
    {row["unit"]: float(row["factor"]) for row in _UNITS if row["quantity"] == quantity}
    for quantity in ("force", "length")
)
_KNOWN = frozenset(row["unit"] for row in _UNITS)  # with units of time and others, which a line of units may contain
_IN_ANY_CASE = frozenset(unit.casefold() for unit in _KNOWN)
_LONG_UNITS = frozenset(unit.casefold() for unit in (*NEWTONS, *MILLIMETRES) if len(unit) > 1)
_LONGEST_UNIT = 3  # letters of an unknown word that may still be a unit
_PLURAL = re.compile(r"(newton|pound|gram|second|millimet(?:er|re))\(s\)", re.IGNORECASE)
_NUMBERS = ("1", "-")  # units of a dimensionless column, but no units at the end of a name such as `Kraft 1`

_LETTER = r"A-Za-zµμ%°А-Яа-я牛顿千毫厘微米秒分公斤力克초분뉴턴"
_UNIT = rf"[{_LETTER}][{_LETTER}0-9/²]{{0,7}}"
_EASTERN = r"\u2e80-\u9fff\uac00-\ud7a3"


def _bare_unit(cell: str) -> str | None:
    """Return the unit in a cell such as ``N``, ``[mm]`` or ``(s)``; "" if it is empty, None if it has other content.

    >>> [_bare_unit(cell) for cell in ("[mm]", "N", "", "Sec", "Force (N)", "Weg")]
    ['mm', 'N', '', 'Sec', None, None]
    >>> _bare_unit("Newton(s)")
    'Newton'
    """
    cell = _narrow(cell)
    if not cell or cell.casefold() in _IN_ANY_CASE:
        return cell
    match = re.fullmatch(rf"[\[(<]\s*(?:({_UNIT})|-?)\s*[\])>]", cell)
    return (match[1] or "") if match else None


def _unit_in(name: str) -> str:
    """Return the unit in the name of a column; "" if there is none.

    >>> [_unit_in(name) for name in ("Force (kN)", "位移/mm", "Kraft [N]", "Load, N", "force", "Weg in mm", "力（牛）")]
    ['kN', 'mm', 'N', 'N', '', 'mm', '牛']
    >>> [_unit_in(name) for name in ("Сила, кН", "位移mm", "力（ｋＮ）", "시간(초)", "Load Newton(s)", "kN")]
    ['кН', 'mm', 'kN', '초', 'Newton', 'kN']
    >>> [_unit_in(name) for name in ("load_cell", "Force/Fz", "Force_raw", "Force/dyn", "Time(s)", "Force Min")]
    ['', '', '', 'dyn', 's', '']
    >>> [_unit_in(name) for name in ("Force kips", "LOAD KN", "Force: lbf", "Force:kN", "Cell 1", "Weg MM")]
    ['kips', 'KN', 'lbf', 'kN', '', 'MM']
    >>> [_unit_in(name) for name in ("Diameter at 10 cm", "Diameter at 10 cm (mm)", "Kraft 2 N", "5 kN")]
    ['10 cm', 'mm', 'N', 'kN']
    """
    name = _narrow(name)
    if unit := _bare_unit(name):
        return unit
    if match := re.search(rf"[\[(<]\s*({_UNIT})\s*[\])>]\s*$", name):
        return match[1]
    if match := re.search(rf"([/,_:])\s*({_UNIT})\s*$", name):
        known = match[2].casefold() in _IN_ANY_CASE
        # an unknown short word after a slash may be a unit, but not a symbol of the force such as Fz
        may_be_unit = match[1] == "/" and len(match[2]) <= _LONGEST_UNIT and match[2][0] not in "Ff"
        return match[2] if known or may_be_unit else ""
    *words, last = name.split() or [""]
    if words and last not in _NUMBERS and (last in _KNOWN or last.casefold() in _LONG_UNITS):
        # in `Load cell 5 kN` and `Diameter at 10 cm` the unit may be that of the number only, so it counts as unknown
        number = re.fullmatch(r"\d+(?:[.,]\d+)?", words[-1]) and len(words) > 1
        return f"{words[-1]} {last}" if number and {**NEWTONS, **MILLIMETRES}.get(last) != 1.0 else last
    joined = re.search(rf"[{_EASTERN}]([A-Za-z%]{{1,3}})$", name)
    return joined[1] if joined and joined[1] in _KNOWN else ""


def _narrow(text: str) -> str:
    """Replace the wide letters and brackets of Chinese input by ASCII ones, and `Newton(s)` by `Newton`."""
    return _PLURAL.sub(r"\1", unicodedata.normalize("NFKC", text))


def _columns_named(cells: Sequence[str]) -> int:
    words = (*FORCE, *TRAVEL, *DIAMETER, *READING, *LABEL)
    return sum(not _bare_unit(cell) and is_called(cell, words) for cell in cells)


def _is_unit_row(cells: Sequence[str], every: bool = False) -> bool:
    """Check that at least half of the filled cells (or `every` one) are units, and that none names a quantity."""
    filled = [cell for cell in cells if cell not in _NUMBERS and _bare_unit(cell) != ""]
    units = sum(bool(_bare_unit(cell)) for cell in filled)
    return 0 < len(filled) <= (1 if every else 2) * units and not _columns_named(filled)


def is_heading(cells: Sequence[str]) -> bool:
    """Check whether a line, which may contain numbers, is a heading or a line of units."""
    return _columns_named(cells) > 0 or _is_unit_row(cells)


def units_in(cells: Sequence[str]) -> list[str]:
    """Return all units in the cells: units in brackets, or at the end of a cell without brackets."""
    bracketed = rf"[\[(<]\s*({_UNIT})\s*[\])>]"
    return [unit for cell in cells for unit in re.findall(bracketed, _narrow(cell)) or _unit_in(cell).split()[-1:]]


def names_and_units(above: Sequence[Sequence[str]], width: int) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Return the names and units of `width` columns, and the number of lines `above` that are headings or units.

    The first of the lines is the nearest to the data. One line may contain the units. Of the others, the line that
    names the most quantities is the heading (the nearest, if several do). If the heading and the line of units
    disagree, both units are returned in one text, which is not a known unit.
    """
    rows = [(*cells, *[""] * (width - len(cells))) for cells in above]
    units = next((i for i, cells in enumerate(rows) if _is_unit_row(cells, every=i > 0)), None)  # line of units
    headings = [i for i in range(len(rows)) if i != units or len(rows) == 1]
    if not headings:
        return tuple(f"column {number + 1}" for number in range(width)), ("",) * width, 0
    heading = max(headings, key=lambda i: (_columns_named(rows[i]), -i))
    named = tuple(_unit_in(name) for name in rows[heading])
    if units is None:  # the units may be among other words
        ends = ([_unit_in(cell) for cell in column if not re.search(r"\d", cell)] for column in zip(*rows, strict=True))
        stated = (next((unit for unit in column if unit in NEWTONS or unit in MILLIMETRES), "") for column in ends)
        return rows[heading], tuple(n or s for n, s in zip(named, stated, strict=True)), heading + 1
    both = zip((_bare_unit(cell) or cell for cell in rows[units]), named, strict=True)
    differ = ((b, n, b and n and " " not in n and b.casefold() != n.casefold()) for b, n in both)
    agreed = tuple(f"{b} or {n}" if two else b or n for b, n, two in differ)
    return rows[heading], agreed, max(heading, units) + 1


def millimetres_in(text: str) -> float | None:
    """Return the first length in mm in a text; None if there is none. Speeds, areas and volumes are not lengths."""
    length = r"(?<![\d.,])(?<!\d[eE])(?<!\d[eE][-+])(\d{1,9}(?:[.,]\d{1,9})?)[ _]?(?:mm|毫米|мм)(?!\s*/|[²³])"
    match = re.search(length, text, re.IGNORECASE | re.ASCII)
    return float(match[1].replace(",", ".")) if match else None
