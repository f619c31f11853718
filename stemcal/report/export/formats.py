"""Tables to publish as CSV, Markdown, LaTeX or Word."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from stemcal.files.durable import write_durably
from stemcal.files.showing import csv_text, in_a_line
from stemcal.outputs import make_folder
from stemcal.report.export.docx import write_word
from stemcal.report.export.latex import document
from stemcal.report.export.paper import PaperTable
from stemcal.report.figures.gallery import Plot

Tables = Sequence[PaperTable]


def export_tables(tables: Tables, kind: str, folder: Path, plots: Sequence[Plot] = ()) -> list[Path]:
    """Write tables into a folder as csv, md, tex or docx, Word with these figures; returns the files."""
    make_folder(folder)
    plain = [replace(one, caption=in_a_line(one.caption), note=in_a_line(one.note)) for one in tables]
    if kind == "csv":
        return _csv_files(plain, folder)
    path = folder / f"tables.{kind}"
    if kind == "docx":
        write_word(plain, plots, path)
    else:
        write_durably(path, document(plain) if kind == "tex" else "\n".join(map(markdown, plain)))
    return [path]


def _csv_files(tables: Tables, folder: Path) -> list[Path]:
    """One file per table, UTF-8 with a byte order mark, which Excel needs to know it."""
    paths = []
    for table in tables:
        # a minus that spreadsheets take for one
        text = csv_text([(cell.replace("−", "-") for cell in row) for row in (table.heads, *table.cells)])
        paths.append(folder / f"table{table.number:02d}-{table.name}.csv")
        write_durably(paths[-1], "\ufeff" + text)
    return paths


def markdown(table: PaperTable) -> str:
    """Return a table in Markdown.

    >>> from stemcal.files.rows import Column, Table
    >>> columns = Column("a", "A"), Column("b", "B", form=str)
    >>> print(markdown(PaperTable(5, "a", "Things.", Table(columns, (("x|y", 1),)))), end="")
    **Table 5.** Things.
    <BLANKLINE>
    | A | B |
    |---|--:|
    | x\\|y | 1 |
    """
    rules = ["---" if column.left else "--:" for column in table.table.columns]
    cells = [[_markdown_cell(cell) for cell in row] for row in (table.heads, *table.cells)]
    lines = [f"**Table {table.number}.** {_markdown_cell(table.caption)}", "", f"| {' | '.join(cells[0])} |"]
    lines += [f"|{'|'.join(rules)}|", *(f"| {' | '.join(row)} |" for row in cells[1:])]
    lines += ["", f"Note: {_markdown_cell(table.note)}"] if table.note else []
    return "\n".join(lines) + "\n"


def _markdown_cell(text: str) -> str:
    """Escape what Markdown would take for its own, links of any kind among it.

    >>> print(_markdown_cell("[a](https://b.c) www.d.e f@g.h"))
    \\[a\\](https\\://b.c) www\\.d.e f\\@g.h
    """
    text = "".join(f"\\{character}" if character in "\\|*_<>[]`~@" else character for character in text)
    text = re.sub(r"&(?=#?\w+;)", "&amp;", text)
    return re.sub(r"(?i)(?<=www)\.|:(?=//)|(?<=mailto):|(?<=xmpp):", lambda found: f"\\{found[0]}", text)
