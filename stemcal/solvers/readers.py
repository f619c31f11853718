"""Read a series of numbers in a result file (JSON, CSV or text) of a program, and reduce it to one number.

Numbers have ASCII digits and may have Fortran exponents; NaN, infinity and asterisks (overflow) are read as NaN.
"""

import csv
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stemcal.arrays import Array
from stemcal.errors import SimulationFailed
from stemcal.solvers.result_reader import ResultReader
from stemcal.storage.encodings import lenient
from stemcal.storage.plain import MIB, read_plain

# 1.5, -.5E+3, 1.5D-3, 1.5-101 (Fortran omits the letter before an exponent of three digits). Unlike in Python, 1_000
# and digits of other scripts are not numbers.
NUMBER = r"[-+]?(?:[0-9]{1,400}\.?[0-9]{0,400}|\.[0-9]{1,400})(?:[EeDd]?[-+][0-9]{1,9}|[EeDd][0-9]{1,9})?"
_NUMBER = re.compile(rf"({NUMBER})", re.ASCII)
_PARTS = re.compile(r"([-+]?[0-9.]+)[EeDd]?([-+]?[0-9]*)", re.ASCII)
_NOT_FINITE = re.compile(r"[-+]?(nan|inf|infinity)|\*+", re.IGNORECASE | re.ASCII)
MAX_BYTES = 20 * MIB  # read in about a second
_LONGEST_LINE = 10_000  # characters of a line that a pattern searches
_ENDING = 10  # number of last lines that are searched for `ends_with`
_REDUCTIONS: dict[str, Callable[[Array], float]] = {"max": np.max, "min": np.min}
_REDUCTIONS |= {"first": lambda y: y[0], "last": lambda y: y[-1]}

_Series = tuple[Sequence[float], Sequence[float] | None]
"""The numbers of a response, and the travel at each of them; None if the travel is not read."""


def require_end(result: ResultReader, folder: Path, printed: str) -> None:
    """Raise `SimulationFailed` (``incomplete``) if neither result file nor printed output ends with `ends_with`."""
    if result.ends_with is None:
        return
    texts = (read_text(folder, result.file, MAX_BYTES), printed)
    filled = ([line for line in text[-_LONGEST_LINE:].splitlines() if line.strip()] for text in texts)
    if not any(result.ends_with in line for lines in filled for line in lines[-_ENDING:]):
        place = f"neither at the end of {result.file} nor at the end of the printed output"
        message = f"{result.ends_with!r} (`ends_with`) is {place}, so the program stopped early"
        raise SimulationFailed("incomplete", message)


def still_rising(result: ResultReader, folder: Path) -> bool:
    """Check whether the extremum of a series is its last number, so that the true extremum may be beyond it."""
    series = _finite(_series(result, folder)[0])
    index_of = {"max": np.argmax, "min": np.argmin}.get(result.reduction)
    return index_of is not None and series.size > 1 and int(index_of(series)) == series.size - 1


def read_number(result: ResultReader, folder: Path) -> float:
    """Return the response that a program has written to its run folder.

    Raises `SimulationFailed`: ``no_result`` if it is missing, ``bad_result`` if unreadable, ``nan`` if not finite.
    """
    return result.scale * float(_REDUCTIONS[result.reduction](_finite(_series(result, folder)[0])))


def read_curve(result: ResultReader, folder: Path) -> tuple[Array, Array]:
    """Return the travel and the response of a curve; raise `SimulationFailed` as `read_number` does."""
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
    if result.ends_with is not None and result.column is not None:
        *rows, last = text.rstrip().splitlines()
        text = "\n".join(rows) if result.ends_with in last and rows else text
    return _csv(text, result) if result.column is not None else _json(text, result)


def read_text(folder: Path, name: str, most: int = 200 * MIB) -> str:
    """Return the text of a file in the run folder; `SimulationFailed` if missing, empty, binary or > `most` bytes."""
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
        data = json.loads(text, parse_int=float)  # a whole number of a thousand digits becomes infinite
    except (ValueError, RecursionError) as error:
        raise SimulationFailed("bad_result", f"{result.file} is not valid JSON: {str(error)[:200]}") from None
    y = _numbers_at(data, result.path or "", result.file)
    return y, None if result.along is None else _numbers_at(data, result.along, result.file)


def _numbers_at(data: Any, path: str, file: str) -> list[float]:
    for step in path.split("."):
        try:
            data = data[int(step)] if isinstance(data, list) else data[step]
        except (KeyError, IndexError, ValueError, TypeError):
            raise SimulationFailed("no_result", f"{file} has no entry {path!r} ({step!r} was not found)") from None
    return [_number(value, path) for value in (data if isinstance(data, list) else [data])]


def _number(value: Any, where: str) -> float:
    """Return a value as a number, NaN for a missing value; raise `SimulationFailed` for any other value."""
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
    lines = (line[:_LONGEST_LINE] for line in text.splitlines())
    matches = [(row, match) for row, line in enumerate(lines, 1) for match in search.finditer(line)]
    if not matches:
        raise SimulationFailed("no_result", f"{file} contains no match for the pattern")
    groups = [number, "x"] if along else [number]
    previous_end = dict.fromkeys((row for row, _ in matches), 0)  # end of the previous match in each line
    for row, match in matches:
        for group in groups:
            if _is_part_of_number(match, group, previous_end[row]):
                raise SimulationFailed(
                    "bad_result",
                    f"{file}, line {row}: the pattern matches {match[group]!r}, which is only part of a number in "
                    f"{match.string.strip()[:80]!r}; extend the group to the whole number, as in (\\S+)",
                )
        previous_end[row] = match.end()
    y, *x = ([_number(match[group], f"{file}, line {row}") for row, match in matches] for group in groups)
    return y, x[0] if x else None


# Characters that continue a number: a digit, a decimal point, an exponent (including 1.5-101 of Fortran and × 10^3).
_CONTINUES = re.compile(r"\.?\d|\.?[eEdD][-+]?\d|\.?\s*[x×*·]\s*10\s*(\^|\*\*|[⁻²³¹⁴-⁹])|\^\d|[¼½¾⁻²³¹⁴-⁹]", re.ASCII)
_FORTRAN = re.compile(r"[-+]\d{3}(?!\d)", re.ASCII)
_BEGINS = re.compile(r"\d\.?$|\d\.?[eEdD][-+]?$", re.ASCII)
# A thousands separator next to a number, or the separator of two numbers. `_BEFORE` includes signs and points.
_MARK = "[,'’_\u00a0\u2009\u202f]"
_AFTER = re.compile(rf"{_MARK}\d", re.ASCII)
_BEFORE = re.compile(rf"\d{_MARK}$|[-−–.]$", re.ASCII)
_COLUMNS = re.compile(r"\.\{\d+\}\)")  # a group of fixed width, which ends within digits if columns have no gap

# A number with spaces as thousands separators. No other number is next to it, unlike in a row of a table.
_GROUPED = re.compile(r"(?<![\d.,])(?<!\d )[1-9]\d{0,2}( \d{3})+([.,]\d+)?(?! ?[\d.,+-])", re.ASCII)


def _is_part_of_number(match: re.Match[str], group: str | int, previous_end: int = 0) -> bool:
    r"""Check whether a group of a match contains only part of a number in the line.

    A comma, a sign or another mark next to the group is not part of the number if the pattern requires that mark, or
    if it is before the end of the previous match.

    >>> [_is_part_of_number(re.search(p, "F = -3,958.4"), 1) for p in (r"([\d.]+)", r"(3),", r"= (\S+)")]
    [True, True, False]
    """
    text, line = match[group] or "", match.string
    start = match.start(group) + len(text) - len(text.lstrip())
    end, number = start + len(text.strip()), text.strip()
    before, after = line[:start], line[end:]
    if _NUMBER.fullmatch(number) is None or _COLUMNS.search(match.re.pattern):
        return False
    if _CONTINUES.match(after) or (number[0] not in "+-" and _BEGINS.search(before)):
        return True
    for whole in _GROUPED.finditer(line):
        inside = whole.start() <= start and end <= whole.end()
        before_read = whole.start() == start or match.start() < start - 1
        after_read = whole.end() == end or match.end() > end + 1
        if inside and not (before_read and after_read):
            return True
    if "." in number and _FORTRAN.match(after) and number[-1].isdigit():
        return True
    following = match.re.search(line, match.end())
    at_mark = match.end() == end + 1 and _AFTER.match(after)  # the match ends with the separator after the number
    if at_mark and "." not in number:
        of_list = following is not None and following.start(group) == end + 1
        if not of_list or (len(number.lstrip("+-")) <= 3 and re.match(r".\d{3}(?!\d)", after)):
            return True
    marks = [end] if _AFTER.match(after) else []
    marks += [start - 1] if start > previous_end and number[0] not in "+-" and _BEFORE.search(before) else []
    # if the pattern also matches with another character in place of the mark, it does not require the mark
    others = [line[:place] + "\N{SECTION SIGN}" + line[place + 1 :] for place in marks]
    if any(other.span(group) == match.span(group) for text in others for other in match.re.finditer(text)):
        return True
    # the pattern does not require the mark either if it matches the line without the mark, as for an optional sign
    unsigned = [line[:place] + line[place + 1 :] for place in marks if place < start]
    return any(other.start(group) == start - 1 for text in unsigned for other in match.re.finditer(text))


def _finite(numbers: Sequence[float]) -> Array:
    y = np.asarray(numbers, dtype=float)
    if y.size == 0:
        raise SimulationFailed("no_result", "the result contains no numbers")
    if not np.isfinite(y).all():
        message = f"value {int(np.argmin(np.isfinite(y))) + 1} of {y.size} is not finite ({y[~np.isfinite(y)][0]:g})"
        raise SimulationFailed("nan", message)
    return y


def required_number(text: str) -> float:
    """Return a text as a number; raise `SimulationFailed` if it is not a number."""
    if (number := _number_of(text)) is None:
        raise SimulationFailed("bad_result", f"{text[:40]!r} is not a number")
    return number


def _number_of(text: str) -> float | None:
    """Return a text as a number, NaN if it marks a missing value or an overflow; None for any other text."""
    text = text.strip()
    if _NUMBER.fullmatch(text):
        parts = _PARTS.fullmatch(text)
        assert parts is not None
        return float(f"{parts[1]}e{parts[2] or 0}")
    return float("nan") if _NOT_FINITE.fullmatch(text) else None
