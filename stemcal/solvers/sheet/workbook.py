"""Read a sheet from a workbook of Excel, with everything marked that is not a plain value."""

from collections.abc import Iterator
from typing import Any

from stemcal.errors import UsageError
from stemcal.measured.sheets import MAX_CELLS, opening, text_of_cell

MERGED = "[merged cells]"


def tables(content: bytes, source: str) -> list[tuple[str, list[tuple[int, list[str]]]]]:
    """Return title and (row number, cells) of every sheet of a workbook.

    A formula that was never calculated appears as it is written, a cell merged with one of another row as `MERGED`, an
    error as its sign: none of them passes for a value. `UsageError` as of `opening`.
    """
    with opening(content, source) as load:
        pairs = zip(load(data_only=True).worksheets, load(data_only=False).worksheets, strict=True)
        return [(sheet.title, list(_rows(sheet, formulas, source))) for sheet, formulas in pairs]


def _rows(sheet: Any, formulas: Any, source: str) -> Iterator[tuple[int, list[str]]]:
    if sheet.max_row * sheet.max_column > MAX_CELLS:
        raise UsageError(f"{source}: sheet {sheet.title!r} has more than {MAX_CELLS:,} cells; save the sheet alone")
    merged = {cell for area in sheet.merged_cells.ranges if area.min_row != area.max_row for cell in area.cells}
    for row in range(1, sheet.max_row + 1):
        found = [
            MERGED if (row, column) in merged else _text(sheet.cell(row, column), formulas.cell(row, column))
            for column in range(1, sheet.max_column + 1)
        ]
        yield row, found


def _text(cell: Any, formula: Any) -> str:
    return text_of_cell(formula.value if cell.value is None else cell.value)
