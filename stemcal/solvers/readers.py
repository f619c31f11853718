"""Read the series of numbers in a file that a program has left, JSON, CSV or text, and make one number of it.

Numbers are in ASCII, with Fortran's exponents, or say that they are none.
"""

import csv
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.errors import SimulationFailed
from stemcal.solvers.result_reader import ResultReader
from stemcal.storage.encodings import lenient
from stemcal.storage.plain import MIB, read_plain

Array = NDArray[np.float64]
# 1.5, -.5E+3, 1.5D-3, 1.5-101 (an exponent of three digits takes the letter's place). Unlike Python, not:
# 1_000, digits of other scripts.
NUMBER = r"[-+]?(?:[0-9]{1,400}\.?[0-9]{0,400}|\.[0-9]{1,400})(?:[EeDd]?[-+][0-9]{1,9}|[EeDd][0-9]{1,9})?"
_NUMBER = re.compile(rf"({NUMBER})", re.ASCII)
_PARTS = re.compile(r"([-+]?[0-9.]+)[EeDd]?([-+]?[0-9]*)", re.ASCII)
_NONE = re.compile(r"[-+]?(nan|inf|infinity)|\*+", re.IGNORECASE | re.ASCII)
MAX_BYTES = 20 * MIB  # read in about a second
LONGEST_LINE = 10_000  # characters of a line that a pattern searches
REDUCTIONS: dict[str, Callable[[Array], float]] = {
    "max": np.max,
    "min": np.min,
    "first": lambda y: y[0],
    "last": lambda y: y[-1],
}


_Series = tuple[Sequence[float], Sequence[float] | None]
"""Numbers, and what they are plotted along if that is known."""


def read_number(result: ResultReader, folder: Path) -> float:
    """Return the number a program has left in its run folder.

    Raises
    ------
    SimulationFailed
        If it is not there (``no_result``), cannot be read (``bad_result``) or is not a number (``nan``).
    """
    return result.scale * float(REDUCTIONS[result.reduction](_finite(_series(result, folder)[0])))


def read_curve(result: ResultReader, folder: Path) -> tuple[Array, Array]:
    """Return the travel of a curve and its numbers; raise `SimulationFailed` as `read_number` does."""
    numbers, along = _series(result, folder)
    y, x = _finite(numbers), np.asarray([] if along is None else along, dtype=float)
    if x.size != y.size:
        raise SimulationFailed("bad_result", f"the curve has {y.size} response values but {x.size} travel values")
    if not (np.isfinite(x).all() and (np.diff(x) >= 0).all()):
        raise SimulationFailed("bad_result", "the travel values of the curve are not in increasing order")
    return x, result.scale * y


def _series(result: ResultReader, folder: Path) -> _Series:
    text = read_text(folder, result.file, MAX_BYTES)
    if result.pattern is not None:
        return _regex(text, result.file, result.pattern)
    return _csv(text, result) if result.column is not None else _json(text, result)


def read_text(folder: Path, name: str, most: int = 200 * MIB) -> str:
    """Return a file of the run folder as text; one that a link leads out of the folder is not there."""
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        if not inside or not path.is_file():
            raise SimulationFailed("no_result", f"the program did not write the file {name}")
        content = read_plain(path, most)
    except OSError as error:
        raise SimulationFailed("bad_result", f"{name}: {error.strerror}") from None
    if not content.strip():
        raise SimulationFailed("no_result", f"{name} is empty")
    if b"\0" in content:
        raise SimulationFailed("bad_result", f"{name} is not a text file")
    return lenient(content)


def _json(text: str, result: ResultReader) -> _Series:
    try:
        data = json.loads(text, parse_int=float)  # a whole number of a thousand digits is infinite
    except (ValueError, RecursionError) as error:
        raise SimulationFailed("bad_result", f"{result.file} is not valid JSON: {str(error)[:200]}") from None
    path = result.path or ""
    y = _numbers(_found(data, path, result.file), path)
    x = None if result.along is None else _numbers(_found(data, result.along, result.file), result.along)
    return y, x


def _found(data: Any, path: str, file: str) -> Any:
    for step in path.split("."):
        try:
            data = data[int(step)] if isinstance(data, list) else data[step]
        except (KeyError, IndexError, ValueError, TypeError):
            raise SimulationFailed("no_result", f"{file} has no entry {path!r} ({step!r} was not found)") from None
    return data


def _numbers(found: Any, where: str) -> list[float]:
    values = found if isinstance(found, list) else [found]
    return [_number(value, where) for value in values]


def _number(value: Any, where: str) -> float:
    """Return a number, or NaN for none."""
    if value is None:
        return float("nan")
    if isinstance(value, str):
        number = _number_of(value)
    else:
        number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
    if number is None:
        raise SimulationFailed("bad_result", f"{where}: {str(value)[:40]!r} is not a number")
    return number


def _csv(text: str, result: ResultReader) -> _Series:
    lines = text.splitlines()
    reader = csv.DictReader(lines, delimiter=max(",;\t", key=lines[0].count))
    try:
        reader.fieldnames = [name.strip() for name in reader.fieldnames or ()]
        rows = list(reader)
    except (csv.Error, ValueError) as error:
        raise SimulationFailed("bad_result", f"{result.file} is not a valid CSV table: {error}") from None
    for name in (result.column, result.along):
        if name is not None and name not in reader.fieldnames:
            there = ", ".join(reader.fieldnames)[:200]
            raise SimulationFailed("no_result", f"{result.file} has no column {name!r}, only {there}")
    y, x = (
        None
        if name is None
        else [_number(row[name], f"{result.file}, row {number}") for number, row in enumerate(rows, 1)]
        for name in (result.column, result.along)
    )
    return y or [], x


def _regex(text: str, file: str, pattern: str) -> _Series:
    search = re.compile(pattern)
    along, number = "x" in search.groupindex, "y" if "y" in search.groupindex else 1
    found = [match for line in text.splitlines() for match in search.finditer(line[:LONGEST_LINE])]
    if not found:
        raise SimulationFailed("no_result", f"{file} contains no match for the pattern")
    numbers = [_number(match[number], file) for match in found]
    return numbers, ([_number(match["x"], file) for match in found] if along else None)


def _finite(numbers: Sequence[float]) -> Array:
    y = np.asarray(numbers, dtype=float)
    if y.size == 0:
        raise SimulationFailed("no_result", "the result contains no numbers")
    if not np.isfinite(y).all():
        raise SimulationFailed(
            "nan", f"value {int(np.argmin(np.isfinite(y))) + 1} of {y.size} is not finite ({y[~np.isfinite(y)][0]:g})"
        )
    return y


def required_number(text: str) -> float:
    """Return the number that a text is; raise `SimulationFailed` if it is none."""
    if (number := _number_of(text)) is None:
        raise SimulationFailed("bad_result", f"{text[:40]!r} is not a number")
    return number


def _number_of(text: str) -> float | None:
    """Return the number that a text is, NaN if it marks a missing value or an overflow; None for any other.

    >>> [_number_of(text) for text in ("1.5-101", " -2.5D+01", "****", "1_000", "12 N")]
    [1.5e-101, -25.0, nan, None, None]
    """
    text = text.strip()
    if _NUMBER.fullmatch(text):
        parts = _PARTS.fullmatch(text)
        assert parts is not None
        return float(f"{parts[1]}e{parts[2] or 0}")
    return float("nan") if _NONE.fullmatch(text) else None
