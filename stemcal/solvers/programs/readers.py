"""From a file a program has left to a series of numbers: the readers by kind."""

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from stemcal.files.encodings import lenient
from stemcal.files.plain import MIB, read_plain
from stemcal.solvers.fortran import number_of
from stemcal.solvers.programs.calculix import printed_series
from stemcal.solvers.programs.helper_process import run_in_helper
from stemcal.solvers.programs.rcforc import contact_force
from stemcal.solvers.programs.reductions import Array, NoResult, Series, plotted, reduce_series
from stemcal.study.model import ResultReader

T = TypeVar("T")

MAX_BYTES = 200 * MIB
LONGEST_LINE = 10_000
_SMALL = 1_000_000  # bytes that take no time to speak of


def read_number(result: ResultReader, folder: Path) -> float:
    """Return the number a program has left in its run folder.

    Raises
    ------
    NoResult
        If it is not there (``no_result``), cannot be read (``bad_result``) or is not a number (``nan``).
    """
    series = READERS[result.kind](read_text(folder, result.file), result)
    return result.scale * reduce_series(series, result.reduction, result.at, result.over)


def read_curve(result: ResultReader, folder: Path) -> tuple[Array, Array]:
    """Return what the numbers of a result are plotted along, and these; raise `NoResult` as `read_number` does."""
    series = READERS[result.kind](read_text(folder, result.file), result)
    along, numbers = plotted(series)
    return along, result.scale * numbers


def read_within(seconds: float, read: Callable[[ResultReader, Path], T], result: ResultReader, folder: Path) -> T:
    """Return what is read in so many seconds; raise `NoResult` (``timeout``) if it takes longer.

    What is small and of linear effort is read here, the rest in a process that can be ended.
    """
    if is_small(folder / result.file) and result.kind != "regex":
        return read(result, folder)
    return run_in_helper(seconds, read, result, folder)


def is_small(file: Path) -> bool:
    """Tell whether a file is read in no time, or is not there."""
    try:
        return file.stat().st_size <= _SMALL
    except OSError:
        return True


def read_text(folder: Path, name: str) -> str:
    """Return a file of the run folder as text; one that a link leads out of the folder is not there."""
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        if not inside or not path.is_file():
            raise NoResult("no_result", f"the program has left no file {name}")
        content = read_plain(path, MAX_BYTES)
    except OSError as error:
        raise NoResult("bad_result", f"{name}: {error.strerror}") from None
    if not content.strip():
        raise NoResult("no_result", f"{name} is empty")
    if b"\0" in content:
        raise NoResult("bad_result", f"{name} is not text")
    return lenient(content)


def _json(text: str, result: Any) -> Series:
    try:
        data = json.loads(text, parse_int=float)  # a whole number of a thousand digits is infinite
    except (ValueError, RecursionError) as error:
        raise NoResult("bad_result", f"{result.file} is not JSON: {str(error)[:200]}") from None
    y = _numbers(_found(data, result.path, result.file), result.path)
    x = None if result.along is None else _numbers(_found(data, result.along, result.file), result.along)
    return Series(y, x)


def _found(data: Any, path: str, file: str) -> Any:
    for step in path.split("."):
        try:
            data = data[int(step)] if isinstance(data, list) else data[step]
        except (KeyError, IndexError, ValueError, TypeError):
            raise NoResult("no_result", f"{file} has no {path} (looked for {step!r})") from None
    return data


def _numbers(found: Any, where: str) -> list[float]:
    values = found if isinstance(found, list) else [found]
    return [_number(value, where) for value in values]


def _number(value: Any, where: str) -> float:
    """Return a number, or NaN for none."""
    if value is None:
        return float("nan")
    if isinstance(value, str):
        number = number_of(value)
    else:
        number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
    if number is None:
        raise NoResult("bad_result", f"{where}: {str(value)[:40]!r} is not a number")
    return number


def _csv(text: str, result: Any) -> Series:
    lines = text.splitlines()
    separator = max(",;\t", key=lines[0].count)
    try:
        header, *rows = csv.reader(lines, delimiter=separator)
    except (csv.Error, ValueError) as error:
        raise NoResult("bad_result", f"{result.file} is not a CSV table: {error}") from None
    names = [name.strip() for name in header]
    y = _column(names, rows, result.column, result.file)
    return Series(y, None if result.along is None else _column(names, rows, result.along, result.file))


def _column(names: list[str], rows: list[list[str]], name: str, file: str) -> list[float]:
    if name not in names:
        raise NoResult("no_result", f"{file} has no column {name!r}, only {', '.join(names)[:200]}")
    index = names.index(name)
    values = []
    for line, row in enumerate(rows, start=2):
        if row and len(row) <= index:
            raise NoResult("bad_result", f"{file}:{line} ends before column {name!r}")
        if row:
            values.append(_number(row[index], f"{file}:{line}"))
    return values


def _regex(text: str, result: Any) -> Series:
    pattern = re.compile(result.pattern)
    y = "y" if "y" in pattern.groupindex else 1
    found = [match for line in text.splitlines() for match in pattern.finditer(line[:LONGEST_LINE])]
    if not found:
        raise NoResult("no_result", f"{result.file} holds nothing that the pattern matches")
    x = [_number(match["x"], result.file) for match in found] if "x" in pattern.groupindex else None
    return Series([_number(match[y], result.file) for match in found], x)


def _rcforc(text: str, result: Any) -> Series:
    contact = contact_force(text, result.interface, result.component)
    return Series(contact.force.tolist(), contact.time.tolist())


def _calculix(text: str, result: Any) -> Series:
    return printed_series(text, result.quantity, result.set, result.component, result.node)


READERS: dict[str, Callable[[str, Any], Series]] = {
    "json": _json,
    "csv": _csv,
    "regex": _regex,
    "rcforc": _rcforc,
    "calculix": _calculix,
}
