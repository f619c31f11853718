"""Which column is which, by its name in several languages, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from stemcal.errors import UsageError
from stemcal.measured.reading import Table

FORCE = ("force", "load", "kraft", "fuerza", "carga", "effort", "forza", "força", "力", "载荷", "负荷", "荷重",
         "試験力")  # fmt: skip
TRAVEL = ("displacement", "travel", "extension", "stroke", "position", "crosshead", "deflection", "deformation",
          "distance", "compression", "weg", "verformung", "desplazamiento", "deslocamento", "déplacement", "course",
          "spostamento", "corsa", "位移", "行程", "变形", "変位", "ストローク")  # fmt: skip
GERMAN = ("kraft", "weg")  # also at the end of a word: Standardkraft, Traversenweg
DIAMETER = (
    "diameter",
    "durchmesser",
    "diametro",
    "diámetro",
    "diamètre",
    "直径",
    "径",
    "reading",
    "measurement",
    "d1",
    "d2",
    "d3",
    "d4",
)
LABEL = ("stem", "sample", "specimen", "plant", "no", "no.", "nr", "nr.", "id", "number", "编号", "序号", "试样", "茎")
FILE = ("file", "filename", "datei", "文件")
GRADE = ("grade", "class", "等级", "分级")


def find_column(
    table: Table, words: Sequence[str], what: str, given: str | None = None, known: Collection[str] = ()
) -> int:
    """Return the column that `given` names (or numbers from 1), else the first whose name has one of the words.

    One with a unit that is `known` goes before others: 应力/MPa is no force.

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
    return next((column for column in found if table.units[column] in known), found[0])


def matching(table: Table, words: Sequence[str]) -> list[int]:
    """Return the columns whose names hold one of the words."""
    return [index for index, name in enumerate(table.columns) if is_called(name, words)]


def is_called(name: str, words: Sequence[str]) -> bool:
    """Tell whether a column's name holds one of the words: whole Latin ones, Chinese ones anywhere.

    >>> is_called("Max. Force (N)", FORCE), is_called("最大力/N", FORCE), is_called("reinforced", FORCE)
    (True, True, False)
    >>> is_called("Standardkraft", FORCE), is_called("Prüfkraft in N", FORCE), is_called("Déplacement", TRAVEL)
    (True, True, True)
    """
    lowered = name.lower()
    parts = set(re.findall(r"[^\W\d_]+\d?\.?|\d+", lowered)) | set(re.findall(r"[^\W\d_]+", lowered))
    ends = tuple(word for word in words if word in GERMAN)
    return any(word in lowered if _is_eastern(word) else word in parts for word in words) or any(
        part.endswith(ends) for part in parts if ends
    )


def _is_eastern(word: str) -> bool:
    return min(word) >= "\u2e80"


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
