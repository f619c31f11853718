"""Tables to publish as CSV, Markdown, LaTeX or Word."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from pathlib import Path

from stemcal.files.durable import write_durably
from stemcal.outputs import make_folder
from stemcal.report.export.docx import write_word
from stemcal.report.export.latex import document
from stemcal.report.export.paper import PaperTable, is_numeric

Tables = Sequence[PaperTable]


def export_tables(tables: Tables, kind: str, folder: Path) -> list[Path]:
    """Write tables into a folder in one of the `FORMATS`; returns the files."""
    make_folder(folder)
    return FORMATS[kind](tables, folder)


def _csv_files(tables: Tables, folder: Path) -> list[Path]:
    """One file per table, UTF-8 with a byte order mark, which Excel needs to know it."""
    paths = []
    for table in tables:
        text = io.StringIO(newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(table.columns)
        writer.writerows([_ascii_minus(cell) for cell in row] for row in table.rows)
        paths.append(folder / f"table{table.number:02d}-{table.name}.csv")
        write_durably(paths[-1], "\ufeff" + text.getvalue())
    return paths


def _ascii_minus(cell: str) -> str:
    """Write a minus that spreadsheets take for one; a text that they would take for a formula stays a text."""
    cell = cell.replace("−", "-")
    risky = cell[:1] in "=+@" or (cell.startswith("-") and not cell[1:2].isdigit())
    return f"'{cell}" if cell and risky else cell


def _markdown_file(tables: Tables, folder: Path) -> list[Path]:
    path = folder / "tables.md"
    write_durably(path, "\n".join(map(markdown, tables)))
    return [path]


def markdown(table: PaperTable) -> str:
    """Return a table in Markdown.

    >>> print(markdown(PaperTable(5, "a", "Things.", ("A", "B"), (("x|y", "1"),))), end="")
    **Table 5.** Things.
    <BLANKLINE>
    | A | B |
    |---|--:|
    | x\\|y | 1 |
    """
    rules = ["--:" if is_numeric(column) else "---" for column in zip(*table.rows, strict=True)]
    cells = [[_markdown_cell(cell) for cell in row] for row in (table.columns, *table.rows)]
    lines = [f"**Table {table.number}.** {_markdown_cell(table.caption)}", "", f"| {' | '.join(cells[0])} |"]
    lines += [f"|{'|'.join(rules)}|", *(f"| {' | '.join(row)} |" for row in cells[1:])]
    lines += ["", f"Note: {_markdown_cell(table.note)}"] if table.note else []
    return "\n".join(lines) + "\n"


def _markdown_cell(text: str) -> str:
    for character in "\\|*_<>":
        text = text.replace(character, f"\\{character}")
    return text


def _latex_file(tables: Tables, folder: Path) -> list[Path]:
    path = folder / "tables.tex"
    write_durably(path, document(tables))
    return [path]


def _word_file(tables: Tables, folder: Path) -> list[Path]:
    path = folder / "tables.docx"
    write_word(tables, path)
    return [path]


FORMATS: dict[str, Callable[[Tables, Path], list[Path]]] = {
    "csv": _csv_files,
    "md": _markdown_file,
    "tex": _latex_file,
    "docx": _word_file,
}
