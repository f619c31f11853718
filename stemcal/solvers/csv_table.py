"""CSV tables as laboratories and spreadsheets write them, read strictly: numbers under known names."""

import csv
import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from stemcal.errors import SpecError, SpecProblem
from stemcal.files.encodings import decode
from stemcal.files.plain import MIB, read_plain
from stemcal.words import counted, nearest

MAX_BYTES = 10 * MIB
MOST = 1e30  # numbers whose powers are still numbers
PASSED_OVER = {"run", "#", ""}
NO_NUMBER = {"", "nan", "na", "n/a", "-"}


@dataclass(frozen=True)
class Sheet:
    """A table that has been read: a mapping from column to value per row, and the responses beside it.

    `further` has the other responses of each row by name, where there is more than one.
    """

    path: Path
    sha256: str
    columns: tuple[str, ...]
    response: str
    rows: tuple[Mapping[str, float], ...]
    responses: tuple[float | None, ...]
    lines: tuple[int, ...]
    further: tuple[Mapping[str, float | None], ...] = ()

    def place(self, row: int) -> str:
        """Return file and line of a row."""
        return f"{self.path.name}:{self.lines[row]}"


@dataclass(frozen=True)
class Answers:
    """Which columns are responses: those of these names; one alone is the last column, whatever that is called.

    `noun` is what the first response is called in sentences; `alone` says that no factor need have a column.
    """

    names: tuple[str, ...] = ()
    noun: str = "force"
    alone: bool = False

    def columns(self, header: Sequence[str]) -> dict[str, int]:
        """Return the column of each response that is there, by its name."""
        if len(self.names) < 2 and header[-1] not in self.names and not set(self.names) & set(header):
            return {header[-1]: len(header) - 1}
        return {name: header.index(name) for name in self.names if name in header}

    def missing(self, columns: Mapping[str, int]) -> list[str]:
        """Return the responses that have no column though they are known by name."""
        return [] if set(columns) - set(self.names) else [name for name in self.names if name not in columns]

    def hint(self, columns: Mapping[str, int]) -> str:
        """Say where the response stands if it is known by its place."""
        return "" if set(columns) & set(self.names) else f"; the {self.noun} comes last"


def read_sheet(
    path: Path, known: Mapping[str, str], required: Sequence[str] = (), answers: Answers = Answers()
) -> Sheet:
    """Read a CSV file with a header.

    Parameters
    ----------
    path : path
        UTF-8, UTF-16 or GBK; separated by comma, semicolon or tab.
    known : mapping
        Column headings that may occur, and the name each stands for.
    required : sequence
        Names that must occur.
    answers : Answers
        Which columns are responses: the last one, which may be called anything, unless they have names.

    Raises
    ------
    SpecError
        With every problem found.
    """
    table, sha256 = read_cells(path, answers.noun)
    header = [cell.strip() for cell in table[0][1]]
    columns = answers.columns(header)
    names = _names(path, header, known, required, answers)
    body = [(line, cells) for line, cells in table[1:] if any(cell.strip() for cell in cells)]
    if not body:
        raise SpecError([_problem(path, 2, 1, "", "there are no rows", "add a row per run")])
    rows, found = _numbers(path, header, names, body, list(columns.values()))
    first, *others = columns
    return Sheet(
        path=path,
        sha256=sha256,
        columns=tuple(name for name in names if name),
        response=first,
        rows=tuple(rows),
        responses=tuple(row[0] for row in found),
        lines=tuple(line for line, _ in body),
        further=tuple(dict(zip(others, row[1:], strict=True)) for row in found) if others else (),
    )


def _bytes(path: Path) -> bytes:
    try:
        return read_plain(path, MAX_BYTES)
    except OSError as error:
        raise SpecError([_problem(path, 1, 1, "", f"{error.strerror}", "name a table of runs")]) from None


def read_cells(path: Path, response: str = "force") -> tuple[list[tuple[int, list[str]]], str]:
    """Return (line number, cells) of every line of a CSV file that is not empty, and the file's SHA-256."""
    blob = _bytes(path)
    lines = _decoded(path, blob).splitlines()
    separator = max(",;\t", key=(lines[0] if lines else "").count)
    try:
        reader = csv.reader(lines, delimiter=separator, strict=True)
        table = [(reader.line_num, cells) for cells in reader if cells]
    except csv.Error as error:
        raise SpecError([_problem(path, 1, 1, "", f"is not a CSV table: {error}", "mend it")]) from None
    if not table or len(table[0][1]) < 2:
        remedy = f"write a line of factor names, the {response} last, separated by commas"
        raise SpecError([_problem(path, 1, 1, "", "there is no header of two columns or more", remedy)])
    return table, hashlib.sha256(blob).hexdigest()


def _decoded(path: Path, blob: bytes) -> str:
    text = decode(blob)
    if text is None or "\0" in text:
        raise SpecError([_problem(path, 1, 1, "", "is not text", "save it as CSV in UTF-8")])
    return text


def _names(
    path: Path, header: Sequence[str], known: Mapping[str, str], required: Sequence[str], answers: Answers
) -> list[str | None]:
    """Return the name each column stands for, None where it is a response or passed over."""
    problems: list[SpecProblem] = []
    names: list[str | None] = []
    columns = answers.columns(header)
    for column, heading in enumerate(header, start=1):
        name = known.get(heading)
        if column - 1 in columns.values():
            name = None
        elif name is None and heading.lower() not in PASSED_OVER:
            problems.append(_problem(path, 1, column, heading, "is not a factor", _suggestion(heading, known)))
        elif name is not None and name in names:
            problems.append(_problem(path, 1, column, heading, "stands there twice", "delete one"))
        names.append(name)
    for name in required:
        if name not in names:
            problems.append(_problem(path, 1, 1, name, "has no column", f"add it{answers.hint(columns)}"))
    problems += [_problem(path, 1, 1, name, "has no column", "add it") for name in answers.missing(columns)]
    if header[-1] in known and header[-1] in columns:
        remedy = f"the {answers.noun} must come last"
        problems.append(_problem(path, 1, len(header), header[-1], "is the last column", remedy))
    if not problems and not any(names) and not answers.alone:
        problems.append(_problem(path, 1, 1, "", "no column is a factor", "call columns by factor name"))
    if problems:
        raise SpecError(problems)
    return names


def _numbers(
    path: Path,
    header: Sequence[str],
    names: Sequence[str | None],
    body: Sequence[tuple[int, list[str]]],
    columns: Sequence[int],
) -> tuple[list[dict[str, float]], list[list[float | None]]]:
    """Return the level by name of every row, and its responses, which stand in `columns`."""
    problems: list[SpecProblem] = []
    rows: list[dict[str, float]] = []
    responses: list[list[float | None]] = []
    for line, cells in body:
        if len(cells) != len(header):
            message = f"has {counted(len(cells), 'cell')}, the header has {len(header)}"
            problems.append(_problem(path, line, 1, "", message, "mend the row"))
            continue
        row = {
            name: _number(path, line, column, name, cell, problems)
            for column, (name, cell) in enumerate(zip(names, cells, strict=False), start=1)
            if name is not None
        }
        rows.append(row)
        responses.append(
            [
                None
                if cells[i].strip().lower() in NO_NUMBER
                else _number(path, line, i + 1, header[i], cells[i], problems)
                for i in columns
            ]
        )
    if problems:
        raise SpecError(problems)
    return rows, responses


def _number(path: Path, line: int, column: int, name: str, cell: str, problems: list[SpecProblem]) -> float:
    """Return a finite number, or note the problem and return NaN, which then goes nowhere."""
    try:
        value = float(cell.strip())
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in cell:
        remedy = "write a number with a decimal point"
        problems.append(_problem(path, line, column, name, f"{cell.strip()[:40]!r} is not a number", remedy))
    elif abs(value) > MOST:
        problems.append(_problem(path, line, column, name, f"{cell.strip()[:40]} is beyond {MOST:g}", "check the unit"))
    return value


def _suggestion(heading: str, known: Mapping[str, str]) -> str:
    meant = nearest(heading, known)
    return f"did you mean {meant}?" if meant else f"columns may be {', '.join(dict.fromkeys(known.values()))}"


def _problem(path: Path, line: int, column: int, name: str, message: str, remedy: str) -> SpecProblem:
    return SpecProblem(path.name, line, column, name, message, remedy)
