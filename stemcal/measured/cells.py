"""From the bytes of a file to lines of cells: texts of any encoding, workbooks of Excel."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import UsageError
from stemcal.measured.headings import quoted
from stemcal.storage import encodings

_MODERN = b"PK\x03\x04"  # xlsx, and ods
_OTHERS = (b"\xd0\xcf\x11\xe0", b"<html", b"<!doctype", b"<?xml", b"<table")  # xls, and what is called so


class Line(NamedTuple):
    """A line as written in the file, its cells, and whether it is a remark (``# …``)."""

    text: str
    cells: Sequence[str]
    remark: bool = False


def split(texts: Sequence[str], separator: str) -> list[Line]:
    """Return lines of text with their cells; an empty line has none."""
    lines = []
    for text in texts:
        remark = text.lstrip().startswith("#")
        lines.append(Line(text, _cells_of(text.lstrip("# ") if remark else text, separator), remark))
    return lines


def _cells_of(text: str, separator: str) -> list[str]:
    if not text.strip():
        return []
    if separator == " ":
        cells = text.split()
    elif '"' in text:  # a quoted cell may hold the separator
        try:
            cells = next(csv.reader([text], delimiter=separator, skipinitialspace=True), [])
        except csv.Error:  # a cell of more than 131,072 characters holds no number
            cells = text.split(separator)
    else:
        cells = text.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def decoded_table(content: bytes, encoding: str | None, path: Path) -> tuple[str, str]:
    """Return a text and its encoding.

    It is that of the byte order mark, UTF-8 or UTF-16, else that of Chinese or of Western European machines.

    >>> decoded("力/N".encode("gbk"), None, Path("a.csv"))
    ('力/N', 'gb18030')
    """
    try:
        found = encodings.decoded(content, [encoding] if encoding else encodings.guesses(content))
    except (LookupError, ValueError):
        raise UsageError(
            f"--encoding {quoted(encoding or '')[1:-1]}: unknown encoding; use utf-8, utf-16, gbk or another "
            "Python encoding"
        ) from None
    if found is None:
        named = encoding or next(encodings.guesses(content))
        raise UsageError(f"{path} is not encoded in {named}; omit `--encoding` or choose another encoding")
    return found


def is_workbook(content: bytes, source: object) -> bool:
    """Return whether a file is an Excel workbook, independent of its name.

    Raises
    ------
    UsageError
        If it is a table that spreadsheet programs open and this module does not read.
    """
    if content[:100].removeprefix(b"\xef\xbb\xbf").lstrip().lower().startswith(_OTHERS):
        raise UsageError(f"{source} is in a spreadsheet format that stemcal cannot read; save the file as .xlsx or CSV")
    return content.startswith(_MODERN)


def sheets(content: bytes, source: str) -> dict[str, list[Line]]:
    """Return the lines of every sheet of a workbook by its title.

    Raises
    ------
    UsageError
        If the file is damaged, or no workbook of Excel's.
    """
    import pandas as pd

    try:
        book = pd.read_excel(io.BytesIO(content), sheet_name=None, header=None, dtype=str, na_filter=False)
    except Exception as error:  # openpyxl raises many kinds for damaged archives, damaged XML or strange cells
        reason = f"{type(error).__name__}: {error}".splitlines()[0][:120]
        raise UsageError(
            f"{source} cannot be read as an Excel workbook ({reason}); save the file again as .xlsx or CSV"
        ) from None
    return {str(title): [_line(row) for row in frame.to_numpy().tolist()] for title, frame in book.items()}


def _line(row: Sequence[str]) -> Line:
    """Return a row of a sheet without the empty cells at its end."""
    cells = [cell.strip() for cell in row]
    while cells and not cells[-1]:
        cells.pop()
    return Line(" ".join(filter(None, cells)), cells, len(cells) == 1 and cells[0].startswith("#"))
