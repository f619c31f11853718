"""Which column is which, by its name in several languages, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Sequence

from stemcal.errors import UsageError
from stemcal.measured.reading import Table

FORCE = ("force", "load", "kraft", "fuerza", "力", "载荷", "负荷", "荷重")
TRAVEL = ("displacement", "travel", "extension", "stroke", "position", "crosshead", "deflection", "weg", "位移", "行程",
          "变形")  # fmt: skip
DIAMETER = ("diameter", "durchmesser", "diametro", "直径", "径", "reading", "measurement", "d1", "d2", "d3", "d4")
LABEL = ("stem", "sample", "specimen", "plant", "no", "no.", "nr", "nr.", "id", "number", "编号", "序号", "试样", "茎")
FILE = ("file", "filename", "datei", "文件")
GRADE = ("grade", "class", "等级", "分级")

NEWTONS = {"N": 1.0, "kN": 1000.0, "mN": 0.001, "kgf": 9.80665, "gf": 0.00980665, "lbf": 4.4482216152605}
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "µm": 0.001, "μm": 0.001, "in": 25.4}


def find_column(table: Table, words: Sequence[str], what: str, given: str | None = None) -> int:
    """Return the column that `given` names (or numbers from 1), else the first whose name has one of the words.

    Raises
    ------
    UsageError
        Telling the columns there are.
    """
    if given is not None:
        return _given(table, given, what)
    found = matching(table, words)
    if not found:
        raise UsageError(f"{table.source}: no column for {what} among {_shown(table)}; name it with --{what}-column")
    return found[0]


def matching(table: Table, words: Sequence[str]) -> list[int]:
    """Return the columns whose names hold one of the words."""
    return [index for index, name in enumerate(table.columns) if is_called(name, words)]


def is_called(name: str, words: Sequence[str]) -> bool:
    """Tell whether a column's name holds one of the words: whole Latin ones, Chinese ones anywhere.

    >>> is_called("Max. Force (N)", FORCE), is_called("最大力/N", FORCE), is_called("reinforced", FORCE)
    (True, True, False)
    """
    lowered = name.lower()
    parts = set(re.findall(r"[a-z]+\d?\.?|\d+", lowered)) | set(re.findall(r"[a-z]+", lowered))
    return any(word in parts if word.isascii() else word in lowered for word in words)


def scale_of(table: Table, column: int, known: dict[str, float], default: str, given: str | None = None) -> float:
    """Return the factor that turns a column into `default` (N or mm)."""
    unit = given or table.units[column] or default
    for name, factor in known.items():
        if unit == name or (unit.lower() == name.lower() and name != "mN" and unit.lower() != "mn"):
            return factor
    where = f"{table.source}: column {table.columns[column]}"
    raise UsageError(f"{where}: unknown unit {unit!r}; use one of {', '.join(known)}")


def _given(table: Table, given: str, what: str) -> int:
    if given in table.columns:
        return table.columns.index(given)
    if given.isdigit() and 1 <= int(given) <= len(table.columns):
        return int(given) - 1
    raise UsageError(f"{table.source}: no column {given!r} for {what}; there are {_shown(table)}")


def _shown(table: Table) -> str:
    return ", ".join(repr(name) for name in table.columns)
