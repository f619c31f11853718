"""Tables and figures to publish as a Word file, with caption fields that Word counts and lists.

Tables have three rules, headings repeated on every page, and numbers to the right.
"""

import io
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stemcal.files.durable import write_atomic
from stemcal.report.figures.plot import Plot
from stemcal.report.tables.columns import PaperTable, starred

WIDTH, HIGHEST = 16.0, 20.0  # cm of a figure between the margins of an A4 page
PER_CHARACTER = 0.19  # cm, of letters of 9 points
BOLD = 1.25  # how much wider a heading is
PADDING = 0.45  # cm, left and right of a cell
LONGEST = 14  # characters of a heading on one line
THICK, THIN = 12, 6  # eighths of a point


def write_word(tables: Sequence[PaperTable], plots: Sequence[Plot], path: Path) -> None:
    """Write all tables, then all figures, into one file."""
    import docx
    from docx.shared import Cm, Pt

    document: Any = docx.Document()
    page = document.sections[0]
    page.page_width, page.page_height = Cm(21.0), Cm(29.7)
    page.left_margin = page.right_margin = page.top_margin = page.bottom_margin = Cm(2.5)
    document.styles["Normal"].font.size = Pt(9)
    document.core_properties.title = "Tables and figures of a stemcal study"
    for place, table in enumerate(tables):
        _add(document, table, begin=place == 0 or table.number != tables[place - 1].number + 1)
    for number, plot in enumerate(plots, 1):
        _add_figure(document, number, plot)
    file = io.BytesIO()
    document.save(file)
    write_atomic(path, file.getvalue())


def _add_figure(document: Any, number: int, plot: Plot) -> None:
    """Add a figure as wide as the page allows, no larger than it was drawn, its caption below it."""
    from docx.enum.text import WD_ALIGN_PARAGRAPH
    from docx.shared import Cm, Inches

    wide, high = plot.figure.get_size_inches()
    line = document.add_paragraph()
    line.alignment = WD_ALIGN_PARAGRAPH.CENTER
    line.paragraph_format.keep_with_next = True
    share = min(1.0, Cm(WIDTH) / Inches(wide), Cm(HIGHEST) / Inches(high))
    picture = line.add_run().add_picture(io.BytesIO(plot.pixels), width=round(share * Inches(wide)))
    picture._inline.docPr.set("descr", plot.caption)
    _add_caption(document, "Figure", number, plot.caption, begin=number == 1)


def _add_caption(document: Any, kind: str, number: int, words: str, begin: bool) -> Any:
    """Add a caption whose number is a field; one that begins a sequence sets it."""
    from docx.oxml import OxmlElement
    from docx.oxml.ns import qn
    from docx.shared import Pt, RGBColor
    from docx.text.run import Run

    caption = document.add_paragraph(style="Caption")
    caption.add_run(f"{kind} ")
    field = OxmlElement("w:fldSimple")
    field.set(qn("w:instr"), f" SEQ {kind} \\* ARABIC" + (f" \\r {number}" if begin else "") + " ")
    field.append(caption.add_run(str(number))._r)
    caption._p.append(field)
    caption.add_run(". ")
    caption.add_run(words).bold = False
    for run in (*caption.runs, *(Run(element, caption) for element in field)):
        run.font.size, run.font.color.rgb = Pt(9), RGBColor(0, 0, 0)
    return caption


def _add(document: Any, table: PaperTable, begin: bool) -> None:
    """Add caption, table and note."""
    from docx.enum.table import WD_TABLE_ALIGNMENT
    from docx.shared import Cm, Pt

    caption = _add_caption(document, "Table", table.number, table.caption, begin)
    caption.paragraph_format.keep_with_next = True
    grid = document.add_table(rows=0, cols=len(table.heads))
    grid.alignment = WD_TABLE_ALIGNMENT.CENTER
    grid.autofit = False
    # cells with stars are aligned left, so that the digits are below each other
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
