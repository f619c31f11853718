"""Convert a file to lines of cells (text in any encoding, Excel workbooks), and find the lines of data among them.

The data are the longest run of lines that have the same number of cells and at least one number. After the first lines
of a run, a line may be shorter, because some machines omit the separators after the last filled cell.
"""

import csv
import io
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import NamedTuple
from zipfile import ZipFile

from stemcal.errors import UsageError
from stemcal.measured.headings import is_heading, words_known
from stemcal.storage import encodings
from stemcal.storage.plain import MIB

MAX_BYTES = 64 * MIB
MOST_ROWS, MOST_CELLS = 500_000, 2_000_000
"""Limits that keep reading short: a row needs up to a kilobyte of memory, a cell of a workbook up to 20 µs."""
_SMALLER = "export fewer points, or split the file by specimen"

_MODERN = b"PK\x03\x04"  # xlsx, and ods
_OTHERS = (b"\xd0\xcf\x11\xe0", b"<html", b"<!doctype", b"<?xml", b"<table")  # xls, and other files named .xls

_OLD = ("gb18030", "cp1252", "cp1250", "cp1251", "shift_jis", "big5", "euc_kr")  # encodings before Unicode
_HEAD = 4000  # characters at the beginning of a file in which known words are counted
# XML of a cell with a formula and no value; t="str" marks a formula whose value is an empty text
_NO_VALUE = re.compile(rb'<c (?![^>]*t="str")[^>]*><f(?: [^>]*)?(?:/>|>[^<]*</f>)(?:<v ?/>|<v></v>)?</c>')


class Line(NamedTuple):
    """A line of a file: its text, its cells, and whether it is a remark, which begins with ``#``."""

    text: str
    cells: Sequence[str]
    remark: bool = False


def split(texts: Sequence[str], separator: str) -> list[Line]:
    """Split lines of text into cells; an empty line has no cells."""
    lines = []
    for text in texts:
        remark = text.lstrip().startswith("#")
        content = text.lstrip("# ") if remark else text
        cells = content.split(None if separator == " " else separator)
        if '"' in content and separator != " ":  # a quoted cell may contain the separator
            with suppress(csv.Error):  # a cell of more than 131,072 characters, which cannot be a number
                cells = next(csv.reader([content], delimiter=separator, skipinitialspace=True), [])
        filled = [cell.strip().strip('"').strip() for cell in cells] if content.strip() else []
        lines.append(Line(text, filled, remark))
    return lines


def decoded_table(content: bytes, encoding: str | None, path: Path) -> tuple[str, str]:
    """Return the text of a file and its encoding, which is detected if `encoding` is None.

    A byte order mark or many zero bytes show UTF-16. Content that is not valid UTF-8 has the encoding of Chinese or
    European machines in which the text contains the most known words.
    """
    rows = content.count(b"\n") + 1
    _require_size(str(path), rows, rows + max(map(content.count, (b";", b",", b"\t"))))
    try:
        decoded = encodings.decoded(content, [encoding] if encoding else encodings.guesses(content))
        if decoded is not None and not encoding and decoded[1] in _OLD:
            texts = (encodings.decoded(content, [code]) for code in (decoded[1], *_OLD))
            decoded = max(filter(None, texts), key=lambda pair: words_known(pair[0][:_HEAD]))
    except (LookupError, ValueError):
        raise UsageError(
            f"--encoding {quoted(encoding or '')[1:-1]}: unknown encoding; use utf-8, utf-16, gbk or another "
            "Python encoding"
        ) from None
    if decoded is None:
        named = encoding or next(encodings.guesses(content))
        raise UsageError(f"{path} is not encoded in {named}; omit `--encoding` or choose another encoding")
    return decoded


def _require_size(source: str, rows: int, cells: int) -> None:
    """Raise `UsageError` if a table has too many rows or cells."""
    for what, size, most in (("rows", rows, MOST_ROWS), ("cells", cells, MOST_CELLS)):
        if size > most:
            raise UsageError(f"{source}: the file has more than {most:,} {what}; {_SMALLER}")


def workbook(content: bytes, source: str) -> dict[str, list[Line]] | None:
    """Return the lines of every worksheet of an Excel workbook by its title; None if the content is no workbook."""
    if content[:100].removeprefix(b"\xef\xbb\xbf").lstrip().lower().startswith(_OTHERS):
        raise UsageError(f"{source} is in a spreadsheet format that stemcal cannot read; save the file as .xlsx or CSV")
    if not content.startswith(_MODERN):
        return None
    import openpyxl

    try:
        with ZipFile(io.BytesIO(content)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
            if unpacked > MAX_BYTES:  # a small archive may contain gigabytes
                size = f"the workbook unpacks to {unpacked / MIB:.0f} MiB (limit {MAX_BYTES / MIB:.0f} MiB)"
                raise UsageError(f"{source}: {size}; {_SMALLER}")
            parts = (archive.read(name) for name in archive.namelist() if name.startswith("xl/worksheets/"))
            lacks_values = any(map(_NO_VALUE.search, parts))  # if so, the formulas are read as texts
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=not lacks_values)
        lines_of: dict[str, list[Line]] = {}
        rows = cells = 0
        for sheet in book.worksheets:
            sheet.reset_dimensions()  # the size stated in the file may be wrong
            lines = lines_of.setdefault(str(sheet.title), [])
            for row in sheet.iter_rows(values_only=True):
                rows, cells = rows + 1, cells + len(row)
                _require_size(source, rows, cells)
                # 5.0 becomes 5: its point would mislead the detection of the decimal mark in cells with texts
                values = [int(v) if isinstance(v, float) and v.is_integer() else v for v in row]
                texts = ["" if value is None else str(getattr(value, "text", value)).strip() for value in values]
                while texts and not texts[-1]:
                    texts.pop()
                remark = len(texts) == 1 and texts[0].startswith("#")
                lines.append(Line(" ".join(filter(None, texts)), texts, remark))
        return lines_of
    except UsageError:
        raise
    except Exception as error:  # openpyxl raises many kinds of exceptions for damaged archives, XML or cells
        reason = f"{type(error).__name__}: {error}".splitlines()[0][:120]
        message = f"{source} cannot be read as an Excel workbook ({reason}); save the file again as .xlsx or CSV"
        raise UsageError(message) from None


# ---- numbers in cells

DECIMALS = {"point": ".", "comma": ","}
# no part can match the characters of the part before it, so that matching a long cell takes linear time
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?")
# groups of three digits, as in 1,234.5; the first has no leading zero, so that 0,250 is not read as 250
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(?:([,'’\u00a0\u202f])\d{3})(?:\1\d{3})*(?:\.\d*)?")
_SWAPPED = str.maketrans({".": ",", ",": "."})
_MISSING = ("", "nan", "na", "n/a", "#n/a", "#div/0!", "#value!", "-", "--", "---", "null", "none", "inf", "-inf")


def as_number(cell: str, decimal: str = ".") -> float | None:
    """Return the content of a cell as a number; None if it is not a finite number.

    >>> as_number("3,5", ","), as_number("3,5"), as_number("−1.2e3"), as_number("7 mm"), as_number("1e400")
    (3.5, None, -1200.0, None, None)
    >>> as_number("1,234.5"), as_number("1.234,5", ","), as_number("1'234.5"), as_number("0,250")
    (1234.5, 1234.5, 1234.5, None)
    """
    text = _bare(cell).replace("−", "-")
    if decimal != ".":
        text = text.translate(_SWAPPED)
    if not _NUMBER.fullmatch(text):
        grouped = _GROUPED.fullmatch(text)
        if grouped is None:
            return None
        text = text.replace(grouped[1], "")
    value = float(text)
    return value if math.isfinite(value) else None


def _bare(cell: str) -> str:
    return cell.strip().strip('"').strip()


def is_missing(cell: str) -> bool:
    """Check for a cell that marks a missing value, such as ``NaN`` or ``---``."""
    return _bare(cell).lower() in _MISSING


def quoted(cell: str, most: int = 40) -> str:
    """Return the content of a cell for a message: in quotes, on one line, and at most `most` characters of it."""
    return repr(cell if len(cell) <= most else f"{cell[:most]}…")


def not_a_number(cell: str) -> str:
    """Return why a cell is not read as a number, as the end of a message; for a formula also what to do."""
    if not cell.startswith("="):
        return f"{quoted(cell)} is not a number"
    return f"{quoted(cell)} is a formula without a stored value; open the workbook in Excel or LibreOffice and save it"


# ---- the lines of data and the headings above them

_MOST_ABOVE = 4  # lines of headings, symbols and units above the data
_SAMPLE = 20  # rows of data from which the columns of numbers are detected
_SETTLED = 3  # after this number of lines with all cells, shorter lines are also data


class Run(NamedTuple):
    """Position of the data: index of their first line, index after their last line, and number of cells in a line."""

    begin: int
    end: int
    width: int


def score(lines: Sequence[Line], decimal: str, ragged: bool) -> tuple[int, bool, int, int]:
    """Rate a way to split lines into cells: number of rows of data, heading as wide as the data, numbers, width."""
    run = _data_run(lines, decimal, ragged)
    as_wide = 0 < run.begin < run.end and len(lines[run.begin - 1].cells) == run.width
    cells = (cell for line in lines[run.begin : run.end] for cell in line.cells)
    return run.end - run.begin, as_wide, sum(as_number(cell, decimal) is not None for cell in cells), run.width


def _data_run(lines: Sequence[Line], decimal: str, ragged: bool) -> Run:
    """Return the position of the longest run of lines with numbers; if `ragged`, shorter lines do not end a run."""
    best, most, begin, width, filled = Run(0, 0, 0), 0, 0, 0, 0
    for index, line in enumerate(lines):
        absent = len(line.cells) == width and any(line.cells) and all(map(is_missing, line.cells))
        if not line.cells or absent:
            continue  # neither an empty line nor one of missing values ends a run
        if line.remark or all(as_number(cell, decimal) is None for cell in line.cells):
            width = filled = 0
            continue
        if len(line.cells) != width and not (ragged and filled >= _SETTLED and len(line.cells) < width):
            begin, width, filled = index, len(line.cells), 0
        filled += 1
        if filled > most:
            best, most = Run(begin, index + 1, width), filled
    return _without_headings(lines, best, decimal)


def _is_number(cell: str) -> bool:
    """Test whether a cell is a number with either decimal mark; the mark of the file is not known yet."""
    return any(as_number(cell, decimal) is not None for decimal in DECIMALS.values())


def _without_headings(lines: Sequence[Line], run: Run, decimal: str) -> Run:
    """Return the run without its first lines that are headings with a number, or serial numbers of sensors."""
    full = [index for index in range(run.begin, run.end) if lines[index].cells]
    sample = [lines[index].cells for index in full[_MOST_ABOVE:][:_SAMPLE] or full[-1:]]
    numeric = [all(map(_is_number, column)) for column in zip(*sample, strict=False)]
    begin = run.begin
    for index in full[:_MOST_ABOVE]:
        cells = lines[index].cells
        over = [cell for cell, below in zip(cells, numeric, strict=False) if below]
        has_words = any(not _is_number(cell) and not is_missing(cell) for cell in over)
        if (has_words and is_heading(cells)) or _are_serials(cells, sample, decimal):
            begin = index + 1
    return run._replace(begin=begin)


def _are_serials(cells: Sequence[str], below: Sequence[Sequence[str]], decimal: str) -> bool:
    """Test whether a line has two or more numbers, and all are serial numbers.

    Each is a whole number of three digits or more, larger than all numbers below it; one is over ten times as large.
    """
    columns = ([as_number(cell, decimal) or 0.0 for cell in column] for column in zip(*below, strict=False))
    over = [(cell, max(map(abs, column))) for cell, column in zip(cells, columns, strict=False) if _is_number(cell)]
    if len(over) < 2 or not all(re.fullmatch("[0-9]{3,}", cell) for cell, _ in over):
        return False
    return all(int(cell) > most for cell, most in over) and any(int(cell) > 10.0 * most for cell, most in over)


def _is_data(line: Line, decimal: str) -> bool:
    return all(as_number(cell, decimal) is not None for cell in line.cells)


def find_data(lines: Sequence[Line], decimal: str, ragged: bool, source: str) -> tuple[Run, list[int], int]:
    """Return the data, the indices of lines above them that may be headings, and the number of other numeric lines."""
    run = _data_run(lines, decimal, ragged)
    _refuse_broken(lines, run, decimal, source)
    apart = [*lines[: run.begin], *lines[run.end :]] if run.width > 1 else []
    unread = sum(len(line.cells) > 1 and _is_data(line, decimal) for line in apart)
    return run, _above_data(lines, run, decimal), unread


def _refuse_broken(lines: Sequence[Line], run: Run, decimal: str, source: str) -> None:
    """Raise `UsageError` for a faulty line within the data: only the longer of their two parts would be read.

    Such a line differs in its number of cells from the data on both sides; a line of words alone is no error.
    """
    for outwards in (range(run.end, len(lines)), range(run.begin - 1, -1, -1)):
        places = list(islice((i for i in outwards if lines[i].cells), 2))
        if run.width == 1 or len(places) < 2:
            continue
        odd, beyond = (lines[place] for place in places)
        count, has_numbers = len(odd.cells), any(as_number(cell, decimal) is not None for cell in odd.cells)
        # a line of numbers as wide as the data is outside them only if it has serial numbers, which is no fault
        broken = (has_numbers and count != run.width) or odd.text.count('"') % 2 == 1 or count > run.width
        if broken and not odd.remark and len(beyond.cells) == run.width and _is_data(beyond, decimal):
            differ = f"the adjacent lines differ in the number of cells ({count} and {run.width})"
            raise UsageError(f"{source}: line {places[0] + 1} and {differ}; correct or delete this line")


def _above_data(lines: Sequence[Line], run: Run, decimal: str) -> list[int]:
    """Return the indices of the lines above the data that may be headings or units, the nearest first.

    Such a line has a word in every column, or names a quantity or units. Ruled lines and lines of serial numbers are
    skipped.
    """
    above: list[int] = []
    sample = [line.cells for line in lines[run.begin : run.end] if line.cells][:_SAMPLE]
    for index in range(run.begin - 1, -1, -1):
        cells = lines[index].cells
        if all(not cell.strip("-=_ ") for cell in cells) or _are_serials(cells, sample, decimal):
            continue
        words = len(cells) == run.width and all(as_number(cell, decimal) is None for cell in cells)
        while len(cells) > run.width and not cells[-1]:
            cells = cells[:-1]
        if not (words or (len(cells) <= run.width and is_heading(cells))) or len(above) == _MOST_ABOVE:
            break
        above.append(index)
    # a remark above a single column is not a heading
    return [] if above and lines[above[0]].remark and run.width == 1 else above
