"""Tables to publish as CSV, Markdown, LaTeX or Word."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.report.paper import PaperTable
from stemcal.study.durable import write_durably

Tables = Sequence[PaperTable]


def export_tables(tables: Tables, kind: str, folder: Path) -> list[Path]:
    """Write tables into a folder in one of the `FORMATS`; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
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
    rules = ["---" if index == 0 else "--:" for index in range(len(table.columns))]
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
    body = "\n".join(map(latex, tables))
    write_durably(path, f"{_LATEX_HEAD}\n{body}\n\\end{{document}}\n")
    return [path]


_LATEX_HEAD = r"""% Written by stemcal; names in Chinese need XeLaTeX with the package xeCJK.
\documentclass{article}
\usepackage{iftex}
\ifPDFTeX\usepackage[T1]{fontenc}\usepackage[utf8]{inputenc}\fi
\usepackage{booktabs}
\begin{document}
"""


def latex(table: PaperTable) -> str:
    """Return a table as a LaTeX float with the rules of booktabs."""
    lines = [
        r"\begin{table}[htbp]",
        r"\centering\small",
        rf"\caption{{{_latex_cell(table.caption)}}}",
        rf"\label{{tab:{table.name}}}",
        rf"\begin{{tabular}}{{l{'r' * (len(table.columns) - 1)}}}",
        r"\toprule",
        _latex_row(table.columns),
        r"\midrule",
        *map(_latex_row, table.rows),
        r"\bottomrule",
        r"\end{tabular}",
    ]
    lines += [rf"\par\smallskip\parbox{{\linewidth}}{{\footnotesize {_latex_cell(table.note)}}}"] if table.note else []
    return "\n".join([*lines, r"\end{table}", ""])


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join(map(_latex_cell, cells)) + r" \\"


_LATEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"$<$", ">": r"$>$", "−": r"$-$", "·": r"$\cdot$",
    "²": r"$^2$", "³": r"$^3$", "±": r"$\pm$", "–": "--", "’": "'", "µ": r"$\mu$", "°": r"$^\circ$",
}  # fmt: skip


def _latex_cell(text: str) -> str:
    r"""Escape what LaTeX would take for its own.

    >>> _latex_cell("yield_stress & <0.0001 ** −4.75·X4²")
    'yield\\_stress \\& $<$0.0001 ** $-$4.75$\\cdot$X4$^2$'
    """
    return "".join(_LATEX.get(character, character) for character in text)


def _word_file(tables: Tables, folder: Path) -> list[Path]:
    try:
        import docx
    except ImportError:
        raise UsageError('Word files need an extra: pip install "stemcal[docx]"') from None
    document: Any = docx.Document()
    for table in tables:
        _add_to_word(document, table)
    path = folder / "tables.docx"
    document.save(str(path))
    return [path]


def _add_to_word(document: Any, table: PaperTable) -> None:
    """Add caption, table and note; the first row is marked as heading."""
    caption = document.add_paragraph()
    caption.add_run(f"Table {table.number}. ").bold = True
    caption.add_run(table.caption)
    caption.paragraph_format.keep_with_next = True
    grid = document.add_table(rows=0, cols=len(table.columns), style="Light List")
    for index, cells in enumerate((table.columns, *table.rows)):
        for place, cell in zip(grid.add_row().cells, cells, strict=True):
            place.text = ""
            place.paragraphs[0].add_run(cell).bold = index == 0
    document.add_paragraph(f"Note: {table.note}" if table.note else "")


FORMATS: dict[str, Callable[[Tables, Path], list[Path]]] = {
    "csv": _csv_files,
    "md": _markdown_file,
    "tex": _latex_file,
    "docx": _word_file,
}
