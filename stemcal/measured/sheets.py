"""From the bytes of a file to its text, whatever its encoding, or to the sheets of a workbook of Excel."""

import io
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.files import reading
from stemcal.measured.headings import familiarity, shown
from stemcal.measured.lines import Line

_BEGINNING = 20_000  # bytes by whose words an encoding is judged
_EASTERN = ("gb18030", "cp949", "cp932", "cp1251", "cp1254", "cp866", "cp1252")
_WESTERN = ("cp1252", "cp1254", "gb18030", "cp1251")


def decoded(content: bytes, encoding: str | None, path: Path) -> tuple[str, str]:
    """Return a text and its encoding.

    It is that of the byte order mark, or UTF-8, or UTF-16; else, of the encodings of Chinese, Korean, Japanese,
    Russian, Turkish and Western machines, the one in which most words are known.

    >>> decoded("力/N".encode("gbk"), None, Path("a.csv"))
    ('力/N', 'gb18030')
    >>> decoded("Сила, Н".encode("cp1251"), None, Path("a.csv"))
    ('Сила, Н', 'cp1251')
    """
    try:
        found = reading.decoded(content, [encoding] if encoding else _guesses(content))
    except (LookupError, ValueError):
        raise UsageError(
            f"--encoding {shown(encoding or '')[1:-1]}: unknown; take utf-8, utf-16, gbk or another of Python's"
        ) from None
    if found is None:
        named = encoding or next(_guesses(content))
        raise UsageError(f"{path} is not written in {named}; leave out --encoding or name another")
    return found


def _guesses(content: bytes) -> Iterator[str]:
    """Yield Unicode, then, unless it is UTF-16, the encodings of one or two bytes a letter, the likeliest first."""
    yield from (unicode := list(reading.unicodes(content)))
    if unicode != ["utf-8"]:
        return
    begin = content[:_BEGINNING]
    # letters of Western Europe stand alone among ASCII, Chinese and Cyrillic ones come together
    usual = _EASTERN if re.search(rb"[\x80-\xff]{2}", begin) else _WESTERN
    yield from sorted(usual, key=lambda encoding: -familiarity(begin.decode(encoding, "ignore")))
    yield "latin-1"


MODERN = b"PK\x03\x04"  # xlsx, and ods
OTHERS = (b"\xd0\xcf\x11\xe0", b"<html", b"<!doctype", b"<?xml", b"<table")  # xls, and what is called so
MAX_UNPACKED = 512 * 2**20  # bytes
MAX_CELLS = 5_000_000
MAX_LINES = 250_000  # a minute at 4 kHz


def too_long(source: str) -> UsageError:
    """Return what a table of too many lines is refused with."""
    remedy = "record fewer points a second, or give the part with the test"
    return UsageError(f"{source}: more than {MAX_LINES:,} lines; {remedy}")


def is_workbook(content: bytes) -> bool:
    """Tell whether a file is an Excel workbook, whatever its name."""
    return content.startswith(MODERN)


def is_foreign(content: bytes) -> bool:
    """Tell whether a file is a table that spreadsheet programs open and this module does not read."""
    return content[:100].removeprefix(b"\xef\xbb\xbf").lstrip().lower().startswith(OTHERS)


def sheets(content: bytes, source: str) -> list[tuple[str, list[Line]]]:
    """Return title and lines of every sheet that is not empty.

    Raises
    ------
    UsageError
        If the file is damaged, too large, or no workbook of Excel's.
    """
    import openpyxl

    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
        if unpacked > MAX_UNPACKED:
            raise UsageError(f"{source} unpacks to more than {MAX_UNPACKED // 2**20} MiB; save its sheet as CSV")
        book = openpyxl.load_workbook(io.BytesIO(content), keep_links=False, read_only=True, data_only=True)
        return [(sheet.title, lines) for sheet in book.worksheets if (lines := list(_lines(sheet, source)))]
    except UsageError:
        raise
    except Exception as error:  # whatever a damaged archive, damaged XML or a strange cell makes of openpyxl
        reason = f"{type(error).__name__}: {error}".splitlines()[0][:120]
        raise UsageError(
            f"{source} cannot be read as a workbook of Excel ({reason}); save it anew as .xlsx or CSV"
        ) from None


def _lines(sheet: Any, source: str) -> Iterator[Line]:
    """Yield the rows of a sheet up to the last that is filled, without the empty cells at their ends."""
    sheet.reset_dimensions()  # some machines state them wrongly
    seen = empty = 0
    for number, row in enumerate(sheet.iter_rows(values_only=True)):
        if number == MAX_LINES:
            raise too_long(f"{source}: sheet {sheet.title!r}")
        seen += len(row) + 1
        if seen > MAX_CELLS:
            raise UsageError(f"{source}: sheet {sheet.title!r} has more than {MAX_CELLS:,} cells; is it one of curves?")
        cells = [text_of_cell(value) for value in row]
        while cells and not cells[-1]:
            cells.pop()
        if not cells:
            empty += 1
            continue
        yield from [Line("", ())] * empty
        empty = 0
        yield Line(" ".join(filter(None, cells)), tuple(cells), cells[0].startswith("#") and len(cells) == 1)


def text_of_cell(value: object) -> str:
    """Return a cell's value as it would stand in a text, a number with all its digits."""
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(value).strip()
