"""Tables as testing machines write them: encoding, separator and decimal mark are found out, or given.

A file is read as lines; its data are the longest run of lines that split into equally many cells with a number
among them. The line above them names the columns, a line between of units alone gives those, the rest above is
the preamble.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from stemcal.errors import UsageError
from stemcal.measured.headings import names_and_units
from stemcal.measured.numerals import as_number

SEPARATORS = {"tab": "\t", "semicolon": ";", "comma": ",", "space": " "}
DECIMALS = {"point": ".", "comma": ","}
MAX_BYTES = 64 * 2**20
WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")  # xlsx and ods, xls
_PROBED = 3000  # lines that decide on separator and decimal mark


@dataclass(frozen=True)
class Form:
    """How a file is written; what is None is found out."""

    encoding: str | None = None
    separator: str | None = None
    decimal: str | None = None


@dataclass(frozen=True)
class Table:
    """The cells of a file as texts, with the form it was found to have."""

    source: str
    form: Form
    preamble: tuple[str, ...]
    columns: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    first_line: int
    unread: int = 0  # lines of as many numbers that lie apart from these

    def number(self, row: int, column: int) -> float | None:
        """Return a cell as a number, None if it is empty or a word."""
        return as_number(self.rows[row][column], self.form.decimal or ".")

    def is_number(self, cell: str) -> bool:
        """Tell whether a cell holds a number."""
        return as_number(cell, self.form.decimal or ".") is not None

    def numbers(self, column: int) -> list[float]:
        """Return a column of numbers.

        Raises
        ------
        UsageError
            Naming the line of the first cell that is none.
        """
        values = []
        for row in range(len(self.rows)):
            value = self.number(row, column)
            if value is None:
                cell = self.rows[row][column]
                raise UsageError(f"{self.source}: data row {row + 1}, {self.columns[column]}: {cell!r} is no number")
            values.append(value)
        return values

    @property
    def synthetic(self) -> bool:
        """Whether the file says of itself that its data are made up."""
        return any("synthetic" in line.lower() for line in self.preamble)


def read_table(path: Path, form: Form = Form()) -> Table:
    """Return the table in a file; raise `UsageError` if it holds none."""
    text, encoding = decoded(_content(path), form.encoding, path)
    lines = text.splitlines()
    best = max(_candidates(form), key=lambda pair: _score(lines[:_PROBED], *pair))
    begin, end, width = _data(lines, *best)
    if end == begin:
        raise UsageError(
            f"{path}: no rows of numbers found; say how the file is written with --separator, --decimal and --encoding"
        )
    separator, decimal = best
    columns, units, top = _heading(lines, begin, width, separator, decimal)
    rows = tuple(tuple(_cells(line, separator)) for line in lines[begin:end] if line.strip())
    preamble = tuple(line.strip() for line in lines[:top] if line.strip())
    unread = _like_data([*lines[:begin], *lines[end:]], width, separator, decimal) if width > 1 else 0
    return Table(str(path), Form(encoding, separator, decimal), preamble, columns, units, rows, begin + 1, unread)


def _like_data(lines: Sequence[str], width: int, separator: str, decimal: str) -> int:
    """Return how many lines hold as many cells, all of them numbers."""
    split = (_cells(line, separator) for line in lines if line.strip())
    return sum(len(cells) == width and all(as_number(cell, decimal) is not None for cell in cells) for cells in split)


def _content(path: Path) -> bytes:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UsageError(f"{path} is larger than {MAX_BYTES // 2**20} MiB; is this the file of one specimen?")
        content = path.read_bytes()
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    if content.startswith(WORKBOOKS):
        raise UsageError(f"{path} is a workbook; save its sheet as CSV in the spreadsheet program and give that")
    return content


def decoded(content: bytes, encoding: str | None, path: Path) -> tuple[str, str]:
    """Return a text and its encoding: that of its byte order mark, or UTF-8, UTF-16, GB 18030, Windows-1252.

    >>> decoded("力/N".encode("gbk"), None, Path("a.csv"))
    ('力/N', 'gb18030')
    """
    guesses = [encoding] if encoding else _guesses(content)
    for guess in guesses:
        try:
            return content.decode(guess).removeprefix("\ufeff"), guess
        except UnicodeDecodeError:
            continue
        except LookupError:
            raise UsageError(f"--encoding {guess}: unknown; take utf-8, utf-16, gbk or another of Python's") from None
    raise UsageError(f"{path} is not written in {guesses[0]}; leave out --encoding or name another")


def _guesses(content: bytes) -> list[str]:
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return ["utf-16"]
    begin = content[:4000]
    if begin.count(0) > len(begin) // 4:
        return ["utf-16-le" if begin[1::2].count(0) >= begin[::2].count(0) else "utf-16-be"]
    if content.startswith(codecs.BOM_UTF8):
        return ["utf-8-sig"]
    # letters of Western Europe stand alone among ASCII, Chinese ones come as pairs of bytes
    legacy = ["gb18030", "cp1252"] if re.search(rb"[\x80-\xff]{2}", content) else ["cp1252", "gb18030"]
    return ["utf-8", *legacy, "latin-1"]


def _candidates(form: Form) -> list[tuple[str, str]]:
    separators = [_named(form.separator, SEPARATORS, "--separator")] if form.separator else list(SEPARATORS.values())
    decimals = [_named(form.decimal, DECIMALS, "--decimal")] if form.decimal else list(DECIMALS.values())
    return [(s, d) for s in separators for d in decimals if s != d]


def _named(given: str, known: dict[str, str], option: str) -> str:
    if given in known or given in known.values():
        return known.get(given, given)
    raise UsageError(f"{option} {given}: unknown; take one of {', '.join(known)}")


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        cells = line.split()
    elif '"' in line:  # a quoted cell may hold the separator
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    else:
        cells = line.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def _score(lines: Sequence[str], separator: str, decimal: str) -> tuple[int, bool, int, int]:
    """Judge a way of splitting by the rows it finds, whether the header splits alike, the numbers, and the columns."""
    begin, end, width = _data(lines, separator, decimal)
    above = _cells(lines[begin - 1], separator) if 0 < begin < end else []
    cells = (cell for line in lines[begin:end] for cell in _cells(line, separator))
    return end - begin, len(above) == width, sum(as_number(cell, decimal) is not None for cell in cells), width


def _data(lines: Sequence[str], separator: str, decimal: str) -> tuple[int, int, int]:
    """Return first line, line past the last, and number of columns of the longest run of data rows."""
    best, most, begin, width, filled = (0, 0, 0), 0, 0, 0, 0
    for index, line in enumerate(lines):
        if not line.strip():
            continue  # an empty line ends nothing
        cells = [] if line.lstrip().startswith("#") else _cells(line, separator)
        if all(as_number(cell, decimal) is None for cell in cells):
            width = filled = 0
            continue
        if len(cells) != width:
            begin, width, filled = index, len(cells), 0
        filled += 1
        if filled > most:
            best, most = (begin, index + 1, width), filled
    return best


def _heading(
    lines: Sequence[str], begin: int, width: int, separator: str, decimal: str
) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Return names and units of the columns, and the line on which the heading begins."""
    above: list[tuple[int, list[str]]] = []
    for index in range(begin - 1, -1, -1):
        if not lines[index].strip():
            continue
        cells = _cells(lines[index].lstrip("# ") if lines[index].startswith("#") else lines[index], separator)
        if len(cells) != width or any(as_number(cell, decimal) is not None for cell in cells) or len(above) == 2:
            break
        above.append((index, cells))
    if above and lines[above[0][0]].startswith("#") and width == 1:
        above = []  # a remark, no name
    columns, units, lines_taken = names_and_units([cells for _, cells in above], width)
    return columns, units, above[lines_taken - 1][0] if lines_taken else begin
