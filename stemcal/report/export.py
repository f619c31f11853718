"""The tables of a study as papers print them, Tables 5 to 13 of the wild chrysanthemum study, and their files."""

import re
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from stemcal.files.durable import make_folder, write_atomic
from stemcal.files.reading import csv_text, in_a_line
from stemcal.files.rows import Column, Table
from stemcal.naming import Names
from stemcal.numbers import short
from stemcal.report.docx import write_word
from stemcal.report.figures.plot import Plot
from stemcal.report.showing import Setting, showing_of
from stemcal.report.tables.columns import NUMBERS, PaperTable, starred
from stemcal.stages.results import Results
from stemcal.study.model import Study

Tables = Sequence[PaperTable]


def paper_tables(study: Study, results: Results, holds: bool = True) -> list[PaperTable]:
    """Return the tables that the finished stages allow, in the order of the paper.

    Where the study's verdict is that nothing is calibrated, `holds` is false and ranges are left out.
    """
    setting = Setting(study, results, holds)
    tables = [table for result in results.done for table in showing_of(result).printed(result, setting)]
    return [_factors(study, setting.labelled), *tables]


def numbered(tables: Sequence[PaperTable]) -> list[PaperTable]:
    """Return tables numbered from 1."""
    return [replace(table, number=number) for number, table in enumerate(tables, 1)]


def _factors(study: Study, names: Names) -> PaperTable:
    """Return the screened factors with their levels."""
    columns = [
        Column("symbol", "Symbol"),
        Column("name", "Parameters", form=names.factor, words=True),
        Column("low", "Low Level", form=short),
        Column("high", "High Level", form=short),
    ]
    table = Table.of(columns, study.factors)
    return PaperTable(NUMBERS["factors"], "factors", "Screening test parameters.", table)


# ---- files


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
        write_atomic(path, document(plain) if kind == "tex" else "\n".join(map(markdown, plain)))
    return [path]


def _csv_files(tables: Tables, folder: Path) -> list[Path]:
    """One file per table, UTF-8 with a byte order mark, which Excel needs to detect it."""
    paths = []
    for table in tables:
        # a minus that spreadsheets take for one
        text = csv_text([(cell.replace("−", "-") for cell in row) for row in (table.heads, *table.cells)])
        paths.append(folder / f"table{table.number:02d}-{table.name}.csv")
        write_atomic(paths[-1], "\ufeff" + text)
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


HEAD = r"""% Written by stemcal; names in Chinese need XeLaTeX with the package xeCJK.
\documentclass[a4paper]{article}
\usepackage{iftex}
\ifPDFTeX\usepackage[T1]{fontenc}\usepackage[utf8]{inputenc}\fi
\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}
\usepackage[margin=25mm]{geometry}
\usepackage{booktabs}
\begin{document}
"""
LONGEST = 16  # characters of a heading on one line


def document(tables: Sequence[PaperTable]) -> str:
    """Return a complete document with all tables."""
    return "\n".join([HEAD, *map(latex, tables), r"\end{document}", ""])


def latex(table: PaperTable) -> str:
    """Return a table as a float that carries the number it has in the published study."""
    import pandas as pd

    # cells with stars are aligned left, so that the digits are below each other
    kinds = ["l" if column.left or column.form is starred else "r" for column in table.table.columns]
    heads = [_heading(name, kind) for name, kind in zip(table.heads, kinds, strict=True)]
    rows = [list(map(escaped, row)) for row in table.cells]
    lines = [
        rf"\setcounter{{table}}{{{table.number - 1}}}",
        r"\begin{table}[htbp]",
        r"\centering\small",
        rf"\caption{{{escaped(table.caption)}}}",
        rf"\label{{tab:{table.name}}}",
        pd.DataFrame(rows, columns=heads).to_latex(index=False, escape=False, column_format="".join(kinds)).rstrip(),
    ]
    lines += [rf"\par\smallskip\parbox{{\linewidth}}{{\footnotesize {escaped(table.note)}}}"] if table.note else []
    return "\n".join([*lines, r"\end{table}", ""])


def _heading(name: str, kind: str) -> str:
    """Return a column's name, a long one on several lines.

    >>> _heading("Maximum Shear Force/N", "r")
    '\\\\shortstack[r]{\\\\strut Maximum Shear\\\\\\\\Force/N}'
    """
    lines = textwrap.wrap(name, LONGEST, break_long_words=False) or [""]
    stack = r"\\".join(map(escaped, lines))
    return stack if len(lines) == 1 else rf"\shortstack[{kind}]{{\strut {stack}}}"


_ESCAPES = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"$<$", ">": r"$>$", "−": r"$-$", "·": r"$\cdot$",
    "²": r"$^2$", "³": r"$^3$", "±": r"$\pm$", "–": "--", "’": "'", "µ": r"$\mu$", "μ": r"$\mu$", "°": r"$^\circ$",
    "…": r"\dots{}", "α": r"$\alpha$", "β": r"$\beta$", "ε": r"$\varepsilon$", "σ": r"$\sigma$", "ρ": r"$\rho$",
    "ν": r"$\nu$", "γ": r"$\gamma$", "δ": r"$\delta$", "η": r"$\eta$", "θ": r"$\theta$", "κ": r"$\kappa$",
    "λ": r"$\lambda$", "π": r"$\pi$", "τ": r"$\tau$", "φ": r"$\varphi$", "ψ": r"$\psi$", "ω": r"$\omega$",
    "Δ": r"$\Delta$", "Θ": r"$\Theta$", "Φ": r"$\Phi$", "Ω": r"$\Omega$",
    "√": r"$\surd$", "≤": r"$\le$", "≥": r"$\ge$", "×": r"$\times$",
}  # fmt: skip


def escaped(text: str) -> str:
    r"""Escape what LaTeX would take for its own.

    >>> escaped("yield_stress & <0.0001 ** −4.75·X4²")
    'yield\\_stress \\& $<$0.0001 ** $-$4.75$\\cdot$X4$^2$'
    >>> escaped("*a"), escaped("[b]")
    ('{*}a', '{[}b]')
    """
    found = "".join(_ESCAPES.get(character, character) for character in text)
    # at the beginning of a row they would be options of the line break before it
    return f"{{{found[0]}}}{found[1:]}" if found.startswith(("*", "[")) else found
