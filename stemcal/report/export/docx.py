"""Tables to publish as a Word file: three rules, headings repeated on every page, numbers to the right."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.outputs import open_output
from stemcal.report.export.paper import PaperTable
from stemcal.report.tables.columns import starred

WIDTH = 16.0  # cm between the margins of an A4 page
PER_CHARACTER = 0.19  # cm, of letters of 9 points
BOLD = 1.25  # how much wider a heading is
PADDING = 0.45  # cm, left and right of a cell
LONGEST = 14  # characters of a heading on one line
THICK, THIN = 12, 6  # eighths of a point


def write_word(tables: Sequence[PaperTable], path: Path) -> None:
    """Write all tables into one file."""
    try:
        import docx
        from docx.shared import Cm, Pt
    except ImportError:
        raise UsageError('Word files need an extra: pip install "stemcal[docx]"') from None
    document: Any = docx.Document()
    page = document.sections[0]
    page.page_width, page.page_height = Cm(21.0), Cm(29.7)
    page.left_margin = page.right_margin = page.top_margin = page.bottom_margin = Cm(2.5)
    document.styles["Normal"].font.size = Pt(9)
    document.core_properties.title = "Tables of a stemcal study"
    for table in tables:
        _add(document, table)
    with open_output(path) as file:
        document.save(file)


def _add(document: Any, table: PaperTable) -> None:
    """Add caption, table and note."""
    from docx.enum.table import WD_TABLE_ALIGNMENT
    from docx.shared import Cm, Pt

    caption = document.add_paragraph()
    caption.add_run(f"Table {table.number}. ").bold = True
    caption.add_run(table.caption)
    caption.paragraph_format.keep_with_next = True
    grid = document.add_table(rows=0, cols=len(table.heads))
    grid.alignment = WD_TABLE_ALIGNMENT.CENTER
    grid.autofit = False
    # cells with stars stand to the left, so that the digits stand below each other
    right = [column.form is not None and column.form is not starred for column in table.table.columns]
    for column, width in zip(grid.columns, column_widths(table), strict=True):
        column.width = Cm(width)
    rows = (table.heads, *table.cells)
    for number, cells in enumerate(rows, 1):
        _add_row(grid, cells, right, heading=number == 1, together=number < len(rows))
    _rule(grid.rows[0], "top", THICK)
    _rule(grid.rows[0], "bottom", THIN)
    _rule(grid.rows[-1], "bottom", THICK)
    note = document.add_paragraph(f"Note: {table.note}" if table.note else "")
    note.paragraph_format.space_before = Pt(3)


def column_widths(table: PaperTable) -> list[float]:
    """Return widths in cm: of the longest cell or line of the heading, together no more than the page has.

    >>> from stemcal.files.rows import Column, Table
    >>> columns = Column("run", "No."), Column("force", "Maximum Shear Force", "N")
    >>> column_widths(PaperTable(5, "a", "Things.", Table(columns, (("1", "90.30"),))))
    [1.16, 3.54]
    """
    columns = zip(table.heads, *table.cells, strict=True)
    longest = [max(BOLD * max(map(len, textwrap.wrap(name, LONGEST))), *map(len, cells)) for name, *cells in columns]
    wanted = [PER_CHARACTER * characters + PADDING for characters in longest]
    return [round(width * min(1.0, WIDTH / sum(wanted)), 2) for width in wanted]


def _add_row(grid: Any, cells: Sequence[str], right: list[bool], heading: bool, together: bool) -> None:
    """Add a row; `together` keeps it on the page of the next one, as far as a page goes."""
    from docx.enum.text import WD_ALIGN_PARAGRAPH
    from docx.shared import Pt

    row = grid.add_row()
    _mark(row, "cantSplit")
    if heading:
        _mark(row, "tblHeader")
    for place, cell, to_the_right in zip(row.cells, cells, right, strict=True):
        line = place.paragraphs[0]
        line.add_run(cell).bold = heading
        line.alignment = WD_ALIGN_PARAGRAPH.RIGHT if to_the_right else WD_ALIGN_PARAGRAPH.LEFT
        line.paragraph_format.space_before = line.paragraph_format.space_after = Pt(1.5)
        line.paragraph_format.keep_with_next = together


def _mark(row: Any, name: str) -> None:
    """Set a property of a row that python-docx has no name for."""
    from docx.oxml import OxmlElement

    row._tr.get_or_add_trPr().append(OxmlElement(f"w:{name}"))


def _rule(row: Any, edge: str, thickness: int) -> None:
    """Draw a line along an edge of all cells of a row."""
    from docx.oxml import OxmlElement
    from docx.oxml.ns import qn

    for cell in row.cells:
        properties = cell._tc.get_or_add_tcPr()
        borders = properties.find(qn("w:tcBorders"))
        if borders is None:
            borders = OxmlElement("w:tcBorders")
            properties.append(borders)
        line = OxmlElement(f"w:{edge}")
        for key, value in (("val", "single"), ("sz", str(thickness)), ("space", "0"), ("color", "000000")):
            line.set(qn(f"w:{key}"), value)
        borders.append(line)
