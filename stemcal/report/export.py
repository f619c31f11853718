"""The tables of a study for publication, as CSV, Markdown, LaTeX and Word files."""

import re
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path

from stemcal.drawing.columns import starred
from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import RANGE, Setting, names_of
from stemcal.drawing.table import Column, PaperTable, Table, showable
from stemcal.formats import significant
from stemcal.report.outcome import cited_ranges, showing_of
from stemcal.report.study_tables import design_tables, factors_table
from stemcal.stages.results import Results
from stemcal.storage.atomic import make_folder, write_atomic
from stemcal.storage.encodings import csv_text, in_a_line
from stemcal.study.model.study import Study
from stemcal.study.types.factor import Factor


def study_tables(study: Study, results: Results, holds: bool = True) -> list[Table]:
    """Return the tables of a study: factors, then runs and results of each finished stage, then all parameters.

    Confidence intervals are included only if the study is calibrated (`holds`).
    """
    setting = Setting(study, results, holds)
    tables, symbols = [factors_table(study, keys=False)], {factor.name: factor.symbol for factor in study.factors}
    for result in results.done:
        tables += design_tables(result, symbols, setting.labelled.labels)
        tables += showing_of(result).tables(result, names_of(result, setting.labelled.labels))
    return showable([*tables, *_parameters(setting)], holds)


def _parameters(setting: Setting) -> list[Table]:
    if not (ranges := cited_ranges(setting.results)):
        return []
    levels = {**setting.study.midlevels(), **{name: setting.results.parameters[name] for name in ranges}}

    def known(factor: Factor) -> str:
        if factor.name not in ranges:
            return "fixed"
        return ranges[factor.name] if setting.holds else "calibrated"

    columns = [
        Column("symbol", "Symbol"),
        Column("name", "Parameter", form=setting.labelled.factor, words=True),
        Column("value", "Value", form=significant, of=lambda factor: levels[factor.name]),
        Column("known", RANGE if setting.holds else "Source", of=known),
    ]
    foot = ["fixed: the parameter was set to its mid-range value."] if len(ranges) < len(levels) else []
    return [Table.of(columns, setting.study.factors, "Simulation parameters", foot)]


def numbered(tables: Iterable[Table]) -> list[PaperTable]:
    """Return tables in the form for publication, numbered from 1."""
    return [
        PaperTable(
            number,
            in_a_line(f"{table.title}."),
            tuple(map(in_a_line, table.heads)),
            tuple(tuple(in_a_line(cell).rstrip() for cell in row) for row in table.cells),
            # numbers followed by stars are aligned left, so that their digits stay aligned
            tuple(column.left or column.form is starred for column in table.columns),
            in_a_line(
                " ".join(f"{line.removesuffix('.')}." for line in (*table.foot, *table.claimed)).replace("`", "")
            ),
            table.strong,
        )
        for number, table in enumerate(tables, 1)
    ]


def export_tables(tables: Iterable[Table], kind: str, folder: Path, plots: Sequence[Plot] = ()) -> list[Path]:
    """Write tables to a folder as `kind` csv, md, tex or docx (with the figures `plots`); return the paths."""
    make_folder(folder)
    plain = numbered(tables)
    if kind == "csv":  # one file per table, UTF-8 with a byte order mark, which Excel needs to detect it
        paths = []
        for table in plain:
            # spreadsheets read only the hyphen as a minus sign
            text = csv_text([(cell.replace("−", "-") for cell in row) for row in (table.heads, *table.cells)])
            title = re.sub(r"\W+", "-", table.caption.lower()).strip("-")[:60]
            paths.append(folder / f"table{table.number:02d}-{title}.csv")
            write_atomic(paths[-1], "\ufeff" + text)
        return paths
    path = folder / f"tables.{kind}"
    if kind == "docx":
        from stemcal.report.docx import write_word

        write_word(plain, plots, path)
    else:
        write_atomic(path, document(plain) if kind == "tex" else "\n".join(map(_markdown, plain)))
    return [path]


def _markdown(table: PaperTable) -> str:
    """Return a table in Markdown.

    >>> print(_markdown(PaperTable(1, "Things.", ("A", "B"), (("x|y", "1"),), (True, False))), end="")
    **Table 1.** Things.
    <BLANKLINE>
    | A | B |
    |---|--:|
    | x\\|y | 1 |
    """
    rules = ["---" if left else "--:" for left in table.left]
    heads, *cells = [list(map(_markdown_cell, row)) for row in (table.heads, *table.cells)]
    cells = [[f"**{cell}**" if i in table.strong and cell else cell for cell in row] for i, row in enumerate(cells)]
    lines = [f"**Table {table.number}.** {_markdown_cell(table.caption)}", "", f"| {' | '.join(heads)} |"]
    lines += [f"|{'|'.join(rules)}|", *(f"| {' | '.join(row)} |" for row in cells)]
    lines += ["", f"Note: {_markdown_cell(table.note)}"] if table.note else []
    return "\n".join(lines) + "\n"


def _markdown_cell(text: str) -> str:
    """Escape the special characters of Markdown, and everything that it would turn into a link.

    >>> print(_markdown_cell("[a](https://b.c) www.d.e f@g.h"))
    \\[a\\](https\\://b.c) www\\.d.e f\\@g.h
    """
    text = "".join(f"\\{character}" if character in "\\|*_<>[]`~@$" else character for character in text)
    text = re.sub(r"&(?=#?\w+;)", "&amp;", text)
    return re.sub(r"(?i)(?<=www)\.|:(?=//)|(?<=mailto):|(?<=xmpp):", lambda match: f"\\{match[0]}", text)


_HEAD = r"""% Written by stemcal; Chinese names require XeLaTeX with the xeCJK package.
\documentclass[a4paper]{article}
\usepackage{iftex}
\ifPDFTeX\usepackage[T1]{fontenc}\usepackage[utf8]{inputenc}\fi
\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}
\usepackage[margin=25mm]{geometry}
\usepackage{booktabs}
\begin{document}
"""
_LONGEST = 16  # most characters in a line of a heading


def document(tables: Sequence[PaperTable]) -> str:
    """Return a complete LaTeX document with all tables."""
    return "\n".join([_HEAD, *map(_latex, tables), r"\end{document}", ""])


def _latex(table: PaperTable) -> str:
    import pandas as pd

    kinds = ["l" if left else "r" for left in table.left]
    heads = [_heading(name, kind) for name, kind in zip(table.heads, kinds, strict=True)]
    rows = [list(map(_escaped, row)) for row in table.cells]
    for i in table.strong:
        rows[i] = [cell and rf"\textbf{{{cell}}}" for cell in rows[i]]
    lines = [
        rf"\setcounter{{table}}{{{table.number - 1}}}",
        r"\begin{table}[htbp]",
        r"\centering\small",
        rf"\caption{{{_escaped(table.caption)}}}",
        rf"\label{{tab:{table.number}}}",
        pd.DataFrame(rows, columns=heads).to_latex(index=False, escape=False, column_format="".join(kinds)).rstrip(),
    ]
    lines += [rf"\par\smallskip\parbox{{\linewidth}}{{\footnotesize {_escaped(table.note)}}}"] if table.note else []
    return "\n".join([*lines, r"\end{table}", ""])


def _heading(name: str, kind: str) -> str:
    """Return the heading of a column in LaTeX; a long one is broken into several lines.

    >>> _heading("Simulated maximum force, N", "r")
    '\\\\shortstack[r]{\\\\strut Simulated\\\\\\\\maximum force, N}'
    """
    lines = textwrap.wrap(name, _LONGEST, break_long_words=False) or [""]
    stack = r"\\".join(map(_escaped, lines))
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


def _escaped(text: str) -> str:
    r"""Escape the special characters of LaTeX.

    >>> _escaped("yield_stress & <0.0001 ** −4.75·X4²")
    'yield\\_stress \\& $<$0.0001 ** $-$4.75$\\cdot$X4$^2$'
    >>> _escaped("*a"), _escaped("[b]")
    ('{*}a', '{[}b]')
    """
    escaped = "".join(_ESCAPES.get(character, character) for character in text)
    # after a line break (``\\``), which begins each row, LaTeX reads a star or a bracket as its option
    return f"{{{escaped[0]}}}{escaped[1:]}" if escaped.startswith(("*", "[")) else escaped
