"""Write tables and figures to a Word file; Word numbers the captions and can list them."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import docx
from docx.enum.table import WD_TABLE_ALIGNMENT
from docx.enum.text import WD_ALIGN_PARAGRAPH
from docx.oxml import OxmlElement
from docx.oxml.ns import qn
from docx.shared import Cm, Inches, Pt, RGBColor
from docx.text.run import Run
from rich.cells import cell_len

from stemcal.drawing.plot import Plot
from stemcal.drawing.table import PaperTable
from stemcal.storage.atomic import write_atomic

_WIDTH, _HIGHEST = 16.0, 20.0  # largest width and height of a figure or a table on an A4 page, cm
# size of text, pt; width of a bold letter, cm per pt; sum of the margins left and right in a cell, cm
_SIZE, _LETTER, _MARGIN = 9.0, 0.025, 0.5


def write_word(tables: Sequence[PaperTable], plots: Sequence[Plot], path: Path) -> None:
    """Write all tables, then all figures, to one Word file."""
    document: Any = docx.Document()
    page = document.sections[0]
    page.page_width, page.page_height = Cm(21.0), Cm(29.7)
    page.left_margin = page.right_margin = page.top_margin = page.bottom_margin = Cm(2.5)
    document.styles["Normal"].font.size = Pt(_SIZE)
    document.core_properties.title = "Tables and figures from a stemcal study"
    for table in tables:
        _add_table(document, table)
    for number, plot in enumerate(plots, 1):  # a figure is reduced to the page, but not enlarged
        wide, high = plot.figure.get_size_inches()
        line = document.add_paragraph()
        line.alignment = WD_ALIGN_PARAGRAPH.CENTER
        line.paragraph_format.keep_with_next = True
        share = min(1.0, Cm(_WIDTH) / Inches(wide), Cm(_HIGHEST) / Inches(high))
        picture = line.add_run().add_picture(io.BytesIO(plot.pixels), width=round(share * Inches(wide)))
        picture._inline.docPr.set("descr", plot.caption)
        _add_caption(document, "Figure", number, plot.caption)
    file = io.BytesIO()
    document.save(file)
    write_atomic(path, file.getvalue())


def _add_caption(document: Any, kind: str, number: int, words: str) -> Any:
    caption = document.add_paragraph(style="Caption")
    caption.add_run(f"{kind} ")
    field = OxmlElement("w:fldSimple")
    field.set(qn("w:instr"), f" SEQ {kind} \\* ARABIC ")
    field.append(caption.add_run(str(number))._r)
    caption._p.append(field)
    caption.add_run(". ")
    caption.add_run(words).bold = False
    for run in (*caption.runs, *(Run(element, caption) for element in field)):
        run.font.size, run.font.color.rgb = Pt(9), RGBColor(0, 0, 0)
    return caption


def _add_table(document: Any, table: PaperTable) -> None:
    """Add caption, table and note; the table has three horizontal rules, and its heading is repeated on every page."""
    _add_caption(document, "Table", table.number, table.caption).paragraph_format.keep_with_next = True
    grid = document.add_table(rows=0, cols=len(table.heads), style="Light Shading")  # the style with three rules
    grid.alignment = WD_TABLE_ALIGNMENT.CENTER
    for name, value in (("val", "0620"), ("firstColumn", "0"), ("noHBand", "1")):  # LibreOffice reads only `val`
        grid._tbl.tblPr.find(qn("w:tblLook")).set(qn(f"w:{name}"), value)
    widths, size = _widths(table)
    grid.autofit = False
    for number, cells in enumerate((table.heads, *table.cells)):
        for place, cell, at_left, width in zip(grid.add_row().cells, cells, table.left, widths, strict=True):
            place.width, line = Cm(width), place.paragraphs[0]
            run = line.add_run(cell)
            run.font.size, run.bold = Pt(size), number - 1 in table.strong or None
            line.alignment = WD_ALIGN_PARAGRAPH.LEFT if at_left else WD_ALIGN_PARAGRAPH.RIGHT
            line.paragraph_format.space_before = line.paragraph_format.space_after = Pt(1.5)
    for column, width in zip(grid.columns, widths, strict=True):
        column.width = Cm(width)
    grid.rows[0]._tr.get_or_add_trPr().append(OxmlElement("w:tblHeader"))
    document.add_paragraph(f"Note: {table.note}" if table.note else "").paragraph_format.space_before = Pt(3)


def _widths(table: PaperTable) -> tuple[list[float], float]:
    """Return the widths of the columns (cm) and the size of the text (pt) with which the table fits the page.

    Each column is as wide as its longest cell if there is room, and at least as wide as its longest word.
    """
    columns = list(zip(table.heads, *table.cells, strict=True))
    whole = [max(map(cell_len, cells)) for cells in columns]
    # a number and its stars, as in 1.2 *, count as one word
    words = [max((cell_len(w) for c in cells for w in c.replace(" *", "-*").split()), default=1) for cells in columns]
    room = _WIDTH - _MARGIN * len(columns)
    size = min(_SIZE, room / (_LETTER * sum(words)))
    share = min(1.0, (room / (_LETTER * size) - sum(words)) / (sum(whole) - sum(words) or 1))
    letters = [least + max(0.0, share) * (most - least) for least, most in zip(words, whole, strict=True)]
    return [_MARGIN + _LETTER * size * count for count in letters], size
