"""Tables to publish: the paper's own numbers in all formats, and nothing that a format would take for its own."""

import csv
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stemcal.files.rows import Column, Table
from stemcal.naming import Names
from stemcal.report.export import export_tables, latex, markdown, numbered, paper_tables
from stemcal.report.gallery import gallery
from stemcal.report.tables.columns import PaperTable
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.invert.showing import calibration_table, cited_ranges
from stemcal.stages.results import Results

NASTY = PaperTable(
    5,
    "nasty",
    "Caption with 100 % & $x$_#",
    Table((Column("a", "A_b"), Column("b", "<b>|x|</b>", form=str)), (("{a}~^\\", "−1"), ("=1+1", "屈服应力"))),
    "x_y²",
)


@pytest.fixture
def tables(replayed: tuple[Any, Any], results: Results) -> dict[int, PaperTable]:
    return {table.number: table for table in paper_tables(replayed[0], results)}


def test_all_nine_tables_of_the_paper(tables: dict[int, PaperTable]) -> None:
    assert sorted(tables) == list(range(5, 14))
    assert {number: len(table.cells) for number, table in tables.items()} == {
        5: 9, 6: 12, 7: 9, 8: 5, 9: 20, 10: 14, 11: 3, 12: 9, 13: 5,
    }  # fmt: skip


def test_cells_as_printed(tables: dict[int, PaperTable]) -> None:
    assert tables[7].heads == ("Parameters", "Effect", "Contribution/%", "Sum of Squares", "F-Value", "p-Value")
    assert tables[7].cells[3] == ("X4", "79.42", "60.19", "18921.02", "444.32", "0.0022 **")
    assert tables[7].cells[4] == ("X5", "−0.25", "0.001", "0.1875", "0.0044", "0.9531")
    assert tables[10].cells[0] == ("Model", "16225.35", "9", "1802.82", "75.48", "<0.0001 **")
    assert tables[10].cells[-2] == ("Pure error", "93.33", "5", "18.67", "", "")
    assert tables[8].cells[0][0] == "1.682"
    assert tables[8].cells[1] == ("1", "17.97", "0.04", "95.95")
    assert [row[3] for row in tables[13].cells] == ["−7.8", "−6.2", "5.8", "6.3", "7.5"]
    assert tables[12].heads == ("Symbol", "Parameters", "Value", "95 % Range")
    assert tables[12].cells[0] == ("X1", "Density (kg/m³)", "1100", "fixed")
    assert tables[12].cells[3] == ("X4", "Yield stress (MPa)", "18.37", "15.35 to 19.96")


def test_the_range_to_cite_is_that_of_the_page_and_only_of_a_calibrated_study(
    replayed: tuple[Any, Any], results: Results, tables: dict[int, PaperTable]
) -> None:
    head, ranges = cited_ranges(results.of(InvertResult))
    assert head == "95 % range"
    assert tables[11].heads == ("Parameter", "Numerical Calibration", "95 % Range")
    assert tables[11].cells[0] == ("Yield stress (MPa)", "18.37", "15.35 to 19.96")
    assert [row[2] for row in tables[11].cells] == list(ranges.values())
    doubted = {table.number: table for table in paper_tables(replayed[0], results, holds=False)}
    assert doubted[11].heads == ("Parameter", "Numerical Calibration")
    assert {row[3] for row in doubted[12].cells} == {"calibrated", "fixed"}


def test_the_refined_values_are_what_is_published(replayed: tuple[Any, Any], results: Results) -> None:
    refined = {**results.of(InvertResult).parameters, "yield_stress": 18.5}
    assert calibration_table(results.of(InvertResult), Names(replayed[0].naming), refined).cells[0][1] == "18.50"


def test_numbers_of_ones_own(tables: dict[int, PaperTable]) -> None:
    """From 1, or as in the published study as far as that has them."""
    own = list(tables.values())
    assert [table.number for table in numbered(own)] == list(range(1, 10))


def test_csv_has_plain_numbers(tables: dict[int, PaperTable], tmp_path: Path) -> None:
    paths = export_tables(list(tables.values()), "csv", tmp_path)
    assert len(paths) == 9
    with (tmp_path / "table07-screening.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["Effect"]) == -2.95


def test_spreadsheets_run_nothing(tmp_path: Path) -> None:
    cells = ("=1+1", "@x", "+cmd", "-cmd", "−1.5", "0.1")
    (path,) = export_tables([replace(NASTY, table=Table(tuple(map(Column, cells)), (cells,)))], "csv", tmp_path)
    rows = list(csv.reader(path.read_text("utf-8-sig").splitlines()))
    assert rows == 2 * [["'=1+1", "'@x", "'+cmd", "'-cmd", "-1.5", "0.1"]]


def test_latex_is_balanced_and_escaped(tables: dict[int, PaperTable], tmp_path: Path) -> None:
    (path,) = export_tables([*tables.values(), NASTY], "tex", tmp_path)
    text = path.read_text("utf-8")
    body = "\n".join(line for line in text.splitlines() if not line.startswith("%"))
    bare = re.sub(r"\\[\\{}&%$#_]", "", body)
    assert bare.count("{") == bare.count("}")
    assert bare.count("$") % 2 == 0
    assert text.count(r"\begin{") == text.count(r"\end{") == 1 + 2 * 10
    for table in [*tables.values(), NASTY]:
        rows = latex(table).split(r"\toprule")[1].split(r"\bottomrule")[0]
        lines = [line for line in rows.splitlines() if line.endswith(r" \\")]
        assert len(lines) == len(table.cells) + 1
        assert all(len(re.findall(r"(?<!\\)&", line)) == len(table.heads) - 1 for line in lines)
    starred = replace(NASTY, table=Table((Column("a"),), (("*a",), ("[b]",))))
    assert "\n{*}a \\\\\n{[}b] \\\\\n" in latex(starred)
    assert r"\{a\}\textasciitilde{}\textasciicircum{}\textbackslash{}" in text


def test_markdown_rows_have_as_many_cells_as_columns(tables: dict[int, PaperTable]) -> None:
    for table in [*tables.values(), NASTY]:
        lines = [line for line in markdown(table).splitlines() if line.startswith("|")]
        assert {len(re.findall(r"(?<!\\)\|", line)) for line in lines} == {len(table.heads) + 1}
    assert "<b>" not in markdown(NASTY).replace(r"\<b\>", "")


def test_word_has_tables_and_figures_with_caption_fields(
    replayed: tuple[Any, Any], results: Results, tables: dict[int, PaperTable], tmp_path: Path
) -> None:
    import docx

    plots = [plot for plot in gallery(replayed[0], results, {}) if plot.on_page and not plot.detail][:2]
    (path,) = export_tables(numbered(list(tables.values())), "docx", tmp_path, plots)
    document = docx.Document(str(path))
    assert len(document.tables) == 9 and len(document.inline_shapes) == len(plots) == 2
    captions = [line for line in document.paragraphs if line.style.name == "Caption"]
    assert len(captions) == 9 + len(plots)
    instructions = re.findall(r'w:instr="([^"]*)"', document.element.xml)
    assert instructions[:2] == [r" SEQ Table \* ARABIC \r 1 ", r" SEQ Table \* ARABIC "]
    assert instructions[9] == r" SEQ Figure \* ARABIC \r 1 "
    assert all(plot.caption in caption.text for plot, caption in zip(plots, captions[9:], strict=True))
    cells = [cell.text for cell in document.tables[2].rows[4].cells]
    assert cells == ["X4", "79.42", "60.19", "18921.02", "444.32", "0.0022 **"]


def test_word_tables_fit_the_page_and_repeat_their_heading(tables: dict[int, PaperTable], tmp_path: Path) -> None:
    import docx

    (path,) = export_tables([*tables.values(), NASTY], "docx", tmp_path)
    for grid in docx.Document(str(path)).tables:
        assert sum(column.width.cm for column in grid.columns) <= 16.1
        properties = grid.rows[0]._tr.trPr.xml
        assert "w:tblHeader" in properties and "w:cantSplit" in properties
        assert grid.rows[-1].cells[0]._tc.tcPr.xml.count("w:bottom") == 1


def latex_program() -> str | None:
    return shutil.which("pdflatex")


@pytest.mark.skipif(latex_program() is None, reason="pdflatex is not installed")
def test_latex_compiles_and_nothing_sticks_out(tables: dict[int, PaperTable], tmp_path: Path) -> None:
    """Nine tables and one full of characters that LaTeX would take for its own; no line wider than the page."""
    rows = (*NASTY.table.rows[:1], ("°±³…αβεσρν√≤≥×–’µ", "0.1 *"))
    nasty = replace(NASTY, table=replace(NASTY.table, rows=rows))
    (path,) = export_tables([*tables.values(), nasty], "tex", tmp_path)
    done = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", path.name],
        cwd=tmp_path,
        capture_output=True,
        timeout=300,
    )
    log = (tmp_path / "tables.log").read_text("utf-8", errors="replace")
    assert done.returncode == 0, log[-2000:]
    assert "Overfull" not in log
    assert (tmp_path / "tables.pdf").stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("soffice") is None, reason="LibreOffice is not installed")
def test_the_word_file_opens_in_a_word_processor(tables: dict[int, PaperTable], tmp_path: Path) -> None:
    (path,) = export_tables(list(tables.values()), "docx", tmp_path)
    command = ["soffice", "--headless", f"-env:UserInstallation={(tmp_path / 'profile').as_uri()}"]
    subprocess.run([*command, "--convert-to", "txt:Text", path.name], cwd=tmp_path, capture_output=True, timeout=200)
    text = path.with_suffix(".txt").read_text("utf-8-sig")
    for words in ("Table 5.", "Table 13.", "Contribution/%", "0.0022 **", "<0.0001 **"):
        assert words in text


def test_an_unfinished_study_has_fewer_tables(replayed: tuple[Any, Any], results: Results) -> None:
    found = paper_tables(replayed[0], Results(results.done[:1]))
    assert [table.number for table in found] == [5, 6, 7]
