"""The sheets of an Excel workbook as lines of cells, by openpyxl."""

import io
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from stemcal.errors import UsageError
from stemcal.measured.lines import Line

MODERN = b"PK\x03\x04"  # xlsx, and ods
OTHERS = (b"\xd0\xcf\x11\xe0", b"<html", b"<!doctype", b"<?xml", b"<table")  # xls, and what is called so
MAX_UNPACKED = 512 * 2**20  # bytes
MAX_CELLS = 5_000_000


def is_workbook(content: bytes) -> bool:
    """Tell whether a file is an Excel workbook, whatever its name."""
    return content.startswith(MODERN)


def is_foreign(content: bytes) -> bool:
    """Tell whether a file is a table that spreadsheet programs open and this module does not read."""
    return content[:100].removeprefix(b"\xef\xbb\xbf").lstrip().lower().startswith(OTHERS)


@contextmanager
def opening(content: bytes, source: str) -> Iterator[Callable[..., Any]]:
    """Yield `load`, which opens the workbook with options of openpyxl's; what goes wrong meanwhile is named.

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
        yield lambda **options: openpyxl.load_workbook(io.BytesIO(content), keep_links=False, **options)
    except UsageError:
        raise
    except Exception as error:  # whatever a damaged archive, damaged XML or a strange cell makes of openpyxl
        reason = f"{type(error).__name__}: {error}".splitlines()[0][:120]
        raise UsageError(
            f"{source} cannot be read as a workbook of Excel ({reason}); save it anew as .xlsx or CSV"
        ) from None


def sheets(content: bytes, source: str) -> list[tuple[str, list[Line]]]:
    """Return title and lines of every sheet that is not empty; `UsageError` as of `opening`."""
    with opening(content, source) as load:
        book = load(read_only=True, data_only=True)
        return [(sheet.title, lines) for sheet in book.worksheets if (lines := list(_lines(sheet, source)))]


def _lines(sheet: Any, source: str) -> Iterator[Line]:
    """Yield the rows of a sheet up to the last that is filled, without the empty cells at their ends."""
    sheet.reset_dimensions()  # some machines state them wrongly
    seen = empty = 0
    for row in sheet.iter_rows(values_only=True):
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
