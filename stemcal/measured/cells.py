"""Convert the bytes of a file into lines of cells: text files of any encoding, and Excel workbooks."""

import csv
import io
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple
from zipfile import ZipFile

from stemcal.errors import UsageError
from stemcal.measured.headings import quoted, words_known
from stemcal.storage import encodings
from stemcal.storage.plain import MIB

MAX_BYTES = 64 * MIB
MOST_ROWS, MOST_CELLS = 500_000, 2_000_000
"""Limits of a file: a row requires up to a kilobyte of memory, a cell of a workbook up to 20 µs."""
_SMALLER = "export fewer points, or split the file by specimen"

_MODERN = b"PK\x03\x04"  # xlsx, and ods
_OTHERS = (b"\xd0\xcf\x11\xe0", b"<html", b"<!doctype", b"<?xml", b"<table")  # xls, and other files named .xls

_OLD = ("gb18030", "cp1252", "cp1250", "cp1251", "shift_jis", "big5", "euc_kr")
_HEAD = 4000  # characters that are searched for known words


class Line(NamedTuple):
    """A line of a file, its cells, and whether it is a remark (``# …``)."""

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
    """Return the lines of every worksheet of an Excel workbook by its title; None if the content is no workbook.

    Raises `UsageError` for a damaged workbook, for one that is too large, and for other formats of spreadsheets.
    """
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
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        lines_of: dict[str, list[Line]] = {}
        rows = cells = 0
        for sheet in book.worksheets:
            sheet.reset_dimensions()  # the size stated in the file may be wrong
            lines = lines_of.setdefault(str(sheet.title), [])
            for row in sheet.iter_rows(values_only=True):
                rows, cells = rows + 1, cells + len(row)
                _require_size(source, rows, cells)
                # the decimal mark of a whole number, as in 5.0, would mislead the detection of the file's decimal mark
                values = [int(v) if isinstance(v, float) and v.is_integer() else v for v in row]
                texts = ["" if value is None else str(value).strip() for value in values]
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
