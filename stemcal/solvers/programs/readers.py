"""Read the series of numbers in a file that a program has left: JSON, CSV or text."""

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from stemcal.files.encodings import lenient
from stemcal.files.plain import MIB, read_plain
from stemcal.solvers.fortran import number_of
from stemcal.solvers.programs.reductions import Array, NoResult, Series, plotted, reduce_series
from stemcal.study.model import ResultReader

MAX_BYTES = 20 * MIB  # read in about a second
LONGEST_LINE = 10_000
SEARCH_SECONDS = 10.0
# Prints every match as [x, y]. A regular expression cannot be interrupted, so the search has its own process, which
# ends itself after the given number of seconds, even if no other process is left to end it.
_SEARCH = """
import faulthandler, json, re, sys
faulthandler.dump_traceback_later(float(sys.argv[1]), exit=True)
pattern = re.compile(sys.argv[2])
named = pattern.groupindex
lines = sys.stdin.buffer.read().decode().splitlines()
found = (match for line in lines for match in pattern.finditer(line[:int(sys.argv[3])]))
print(json.dumps([(m["x"] if "x" in named else None, m["y" if "y" in named else 1]) for m in found]))
"""


def read_number(result: ResultReader, folder: Path) -> float:
    """Return the number a program has left in its run folder.

    Raises
    ------
    NoResult
        If it is not there (``no_result``), cannot be read (``bad_result``) or is not a number (``nan``).
    """
    return result.scale * reduce_series(_series(result, folder), result.reduction)


def read_curve(result: ResultReader, folder: Path) -> tuple[Array, Array]:
    """Return the travel of a curve and its numbers; raise `NoResult` as `read_number` does."""
    along, numbers = plotted(_series(result, folder))
    return along, result.scale * numbers


def _series(result: ResultReader, folder: Path) -> Series:
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
            raise NoResult("no_result", f"the program has left no file {name}")
        content = read_plain(path, most)
    except OSError as error:
        raise NoResult("bad_result", f"{name}: {error.strerror}") from None
    if not content.strip():
        raise NoResult("no_result", f"{name} is empty")
    if b"\0" in content:
        raise NoResult("bad_result", f"{name} is not text")
    return lenient(content)


def _json(text: str, result: ResultReader) -> Series:
    try:
        data = json.loads(text, parse_int=float)  # a whole number of a thousand digits is infinite
    except (ValueError, RecursionError) as error:
        raise NoResult("bad_result", f"{result.file} is not JSON: {str(error)[:200]}") from None
    path = result.path or ""
    y = _numbers(_found(data, path, result.file), path)
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


def _csv(text: str, result: ResultReader) -> Series:
    lines = text.splitlines()
    separator = max(",;\t", key=lines[0].count)
    try:
        header, *rows = csv.reader(lines, delimiter=separator)
    except (csv.Error, ValueError) as error:
        raise NoResult("bad_result", f"{result.file} is not a CSV table: {error}") from None
    names = [name.strip() for name in header]
    y = _column(names, rows, result.column or "", result.file)
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


def _regex(text: str, file: str, pattern: str) -> Series:
    limits = str(SEARCH_SECONDS), pattern, str(LONGEST_LINE)
    search = [sys.executable, "-I", "-S", "-X", "utf8", "-c", _SEARCH, *limits]
    done = subprocess.run(search, input=text.encode(), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    if done.returncode:
        message = f"{file}: searching it took more than {SEARCH_SECONDS:g} s; simplify solver.result.pattern"
        raise NoResult("timeout", message)
    found = json.loads(done.stdout)
    if not found:
        raise NoResult("no_result", f"{file} holds nothing that the pattern matches")
    travel, numbers = ([_number(text, file) for text in texts] for texts in zip(*found, strict=True))
    return Series(numbers, None if found[0][0] is None else travel)
