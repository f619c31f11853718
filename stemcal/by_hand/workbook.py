"""The sheet as a workbook of Excel: written with what is asked for locked, read with what is no plain value marked."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.errors import UsageError
from stemcal.measured.sheets import MAX_CELLS, opening, text_of_cell

if TYPE_CHECKING:
    from stemcal.by_hand.sheet import Field

_WIDE = 24  # of columns for words, in characters
_FILLED = ("response", "said")
MERGED = "[merged cells]"


def written(title: str, fields: Sequence[Field], rows: Sequence[Sequence[str | float]]) -> bytes:
    """Return a workbook in which only the cells to be filled in can be changed; no password locks the others."""
    from openpyxl import Workbook
    from openpyxl.styles import Alignment, Font, PatternFill, Protection
    from openpyxl.utils import get_column_letter

    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.title = "".join("-" if letter in "[]:*?/\\'" else letter for letter in title)[:31]
    sheet.append([field.heading for field in fields])
    for row in rows:
        sheet.append(["" if cell == "" else cell for cell in row])
    for number, field in enumerate(fields, 1):
        width = _WIDE if field.kind == "said" else max(len(field.heading) + 2, 11)
        sheet.column_dimensions[get_column_letter(number)].width = width
        head = sheet.cell(1, number)
        head.font, head.alignment = Font(bold=True), Alignment(wrap_text=True, vertical="top")
        for line in range(2, len(rows) + 2):
            cell = sheet.cell(line, number)
            if field.kind in _FILLED:
                cell.protection, cell.fill = Protection(locked=False), PatternFill("solid", fgColor="FFF8DC")
    sheet.freeze_panes = "B2"
    sheet.protection.sheet = True
    sheet.protection.formatColumns = False
    text = io.BytesIO()
    book.save(text)
    return text.getvalue()


def tables(content: bytes, source: str) -> list[tuple[str, list[tuple[int, list[str]]]]]:
    """Return title and (row number, cells) of every sheet of a workbook.

    A formula that was never calculated stands there as it is written, a cell merged with one of another row as
    `MERGED`, an error as its sign: none of them passes for a value. `UsageError` as of `opening`.
    """
    with opening(content, source) as load:
        pairs = zip(load(data_only=True).worksheets, load(data_only=False).worksheets, strict=True)
        return [(sheet.title, list(_rows(sheet, formulas, source))) for sheet, formulas in pairs]


def _rows(sheet: Any, formulas: Any, source: str) -> Iterator[tuple[int, list[str]]]:
    if sheet.max_row * sheet.max_column > MAX_CELLS:
        raise UsageError(f"{source}: sheet {sheet.title!r} has more than {MAX_CELLS:,} cells; give the sheet alone")
    merged = {cell for area in sheet.merged_cells.ranges if area.min_row != area.max_row for cell in area.cells}
    for row in range(1, sheet.max_row + 1):
        found = [
            MERGED if (row, column) in merged else _text(sheet.cell(row, column), formulas.cell(row, column))
            for column in range(1, sheet.max_column + 1)
        ]
        yield row, found


def _text(cell: Any, formula: Any) -> str:
    return text_of_cell(formula.value if cell.value is None else cell.value)
