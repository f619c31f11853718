"""Tables to publish: the paper's own numbers in all formats, and nothing that a format would take for its own."""

import csv
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from stemcal.drawing.showing import Setting
from stemcal.drawing.table import Column, Table
from stemcal.report import export
from stemcal.report.docx import _MARGIN, _widths
from stemcal.report.export import _latex, _markdown, export_tables, numbered, study_tables
from stemcal.report.gallery import gallery
from stemcal.report.outcome import cited_ranges
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.invert.showing import calibration_table
from stemcal.stages.results import Results
from stemcal.vocabulary import Wording

NASTY = Table(
    (Column("a", "A_b"), Column("b", "<b>|x|</b>", form=str)),
    (("{a}~^\\", "−1"), ("=1+1", "屈服应力")),
    "Caption with 100 % & $x$_#",
    ("x_y²",),
)


@pytest.fixture
def tables(replayed: tuple[Any, Any], results: Results) -> dict[str, Table]:
    return {table.title: table for table in study_tables(replayed[0], results)}


def test_the_tables_of_the_paper_are_among_those_of_the_study(tables: dict[str, Table]) -> None:
    """Tables 5 to 7, 9 to 13 of the published study; Table 8 is the foot of the coefficients."""
    rows = {
        "Factors": 9,
        "Screening runs": 12,
        "Effects on the maximum force": 10,
        "Response surface runs": 20,
        "Analysis of variance": 14,
        "Calibrated parameters": 3,
        "Measured and simulated maximum force": 5,
        "Simulation parameters": 9,
    }
    assert {title: len(tables[title].rows) for title in rows} == rows
    effects, anova = tables["Effects on the maximum force"], tables["Analysis of variance"]
    assert effects.heads[2:7] == ("Effect, N", "Share, %", "Sum of squares", "F", "p")
    assert effects.cells[3][2:7] == ("79.42", "60.19", "18921.02", "444.32", "0.0022 **")
    assert effects.cells[4][2:7] == ("−0.25", "0.001", "0.1875", "0.0044", "0.9531   ")
    assert anova.cells[0] == ("Model", "16225.35", "9", "1802.82", "75.48", "<0.0001 **")
    assert anova.cells[-2] == ("Pure error", "93.33", "5", "18.67", "", "")
    errors = [column.key for column in tables["Measured and simulated maximum force"].columns].index("error_percent")
    found = [round(row[errors], 1) for row in tables["Measured and simulated maximum force"].rows]
    assert found == [-7.8, -6.2, 5.8, 6.3, 7.5]


def test_the_range_to_cite_is_that_of_the_page_and_only_of_a_calibrated_study(
    replayed: tuple[Any, Any], results: Results, tables: dict[str, Table]
) -> None:
    parameters = tables["Simulation parameters"]
    assert parameters.heads == ("Symbol", "Parameter", "Value", "95 % confidence interval")
    assert parameters.cells[0] == ("X1", "Density (kg/m³)", "1100", "fixed")
    assert parameters.cells[3] == ("X4", "Yield stress (MPa)", "18.37", "≤ 15.35 to ≥ 19.96")
    assert set(cited_ranges(results).values()) < {row[3] for row in parameters.cells}
    doubted = {table.title: table for table in study_tables(replayed[0], results, holds=False)}
    assert {row[3] for row in doubted["Simulation parameters"].cells} == {"calibrated", "fixed"}
    assert "range" not in [column.key for column in doubted["Calibrated parameters"].columns]


def test_the_refined_values_are_what_is_published(replayed: tuple[Any, Any], results: Results) -> None:
    refined = {**results.of(InvertResult).parameters, "yield_stress": 18.5}
    assert calibration_table(results.of(InvertResult), Wording(replayed[0].naming), refined).cells[0][1] == "18.50"


def test_csv_has_plain_numbers(tables: dict[str, Table], tmp_path: Path) -> None:
    paths = export_tables(list(tables.values()), "csv", tmp_path)
    assert len(paths) == len(tables)
    with (tmp_path / "table03-effects-on-the-maximum-force.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["Effect, N"]) == -2.95


def test_spreadsheets_run_nothing(tmp_path: Path) -> None:
    cells = ("=1+1", "@x", "+cmd", "-cmd", "−1.5", "0.1")
    (path,) = export_tables([Table(tuple(map(Column, cells)), (cells,))], "csv", tmp_path)
    rows = list(csv.reader(path.read_text("utf-8-sig").splitlines()))
    assert rows == 2 * [["'=1+1", "'@x", "'+cmd", "'-cmd", "-1.5", "0.1"]]


def test_latex_is_balanced_and_escaped(tables: dict[str, Table], tmp_path: Path) -> None:
    (path,) = export_tables([*tables.values(), NASTY], "tex", tmp_path)
    text = path.read_text("utf-8")
    body = "\n".join(line for line in text.splitlines() if not line.startswith("%"))
    bare = re.sub(r"\\[\\{}&%$#_]", "", body)
    assert bare.count("{") == bare.count("}")
    assert bare.count("$") % 2 == 0
    assert text.count(r"\begin{") == text.count(r"\end{") == 1 + 2 * (len(tables) + 1)
    for table in numbered([*tables.values(), NASTY]):
        rows = _latex(table).split(r"\toprule")[1].split(r"\bottomrule")[0]
        lines = [line for line in rows.splitlines() if line.endswith(r" \\")]
        assert len(lines) == len(table.cells) + 1
        assert all(len(re.findall(r"(?<!\\)&", line)) == len(table.heads) - 1 for line in lines)
    (starred,) = numbered([Table((Column("a"),), (("*a",), ("[b]",)))])
    assert "\n{*}a \\\\\n{[}b] \\\\\n" in _latex(starred)
    assert r"\{a\}\textasciitilde{}\textasciicircum{}\textbackslash{}" in text


def test_markdown_rows_have_as_many_cells_as_columns(tables: dict[str, Table]) -> None:
    for table in numbered([*tables.values(), NASTY]):
        lines = [line for line in _markdown(table).splitlines() if line.startswith("|")]
        assert {len(re.findall(r"(?<!\\)\|", line)) for line in lines} == {len(table.heads) + 1}
    assert "<b>" not in _markdown(numbered([NASTY])[0]).replace(r"\<b\>", "")


def test_word_has_tables_and_figures_with_caption_fields(
    replayed: tuple[Any, Any], results: Results, tables: dict[str, Table], tmp_path: Path
) -> None:
    import docx

    plots = [plot for plot in gallery(replayed[0], results, {}) if plot.on_page and not plot.detail][:2]
    (path,) = export_tables(list(tables.values()), "docx", tmp_path, plots)
    document = docx.Document(str(path))
    assert len(document.tables) == len(tables) and len(document.inline_shapes) == len(plots) == 2
    captions = [line for line in document.paragraphs if line.style.name == "Caption"]
    assert len(captions) == len(tables) + len(plots)
    instructions = re.findall(r'w:instr="([^"]*)"', document.element.xml)
    assert instructions[:2] == [r" SEQ Table \* ARABIC ", r" SEQ Table \* ARABIC "]
    assert instructions[len(tables)] == r" SEQ Figure \* ARABIC "
    assert all(plot.caption in caption.text for plot, caption in zip(plots, captions[len(tables) :], strict=True))
    cells = [cell.text for cell in document.tables[2].rows[4].cells]
    assert cells[2:7] == ["79.42", "60.19", "18921.02", "444.32", "0.0022 **"]


def test_rows_in_bold_are_bold_in_every_format(tables: dict[str, Table], tmp_path: Path) -> None:
    """The published study: yield stress and failure strain (X4, X9) are significant; nothing else is bold."""
    import docx

    found = tables["Effects on the maximum force"]
    assert "in bold" in found.foot[0]
    assert "7.475 N" in found.foot[1] and "23.79 N" in found.foot[1] and "53.28 N" in found.foot[1]  # Lenth's margins
    (paper,) = numbered([found])
    marked = [line for line in _markdown(paper).splitlines() if line.startswith("| **")]
    assert [line.split(" | ")[0] for line in marked] == ["| **X4**", "| **X9**"]
    assert all(cell.strip().startswith("**") for line in marked for cell in line.strip("|").split("|"))
    rows = [line for line in _latex(paper).splitlines() if line.startswith(r"\textbf")]
    assert [line[:10] for line in rows] == [r"\textbf{X4}"[:10], r"\textbf{X9}"[:10]]
    assert all(line.count(r"\textbf{") == len(paper.heads) for line in rows)
    (path,) = export_tables([found], "docx", tmp_path)
    (grid,) = docx.Document(str(path)).tables
    bold = [[run.bold for cell in row.cells for line in cell.paragraphs for run in line.runs] for row in grid.rows[1:]]
    assert [i for i, row in enumerate(bold) if any(row)] == sorted(found.strong) == [3, 8]
    assert all(bold[3]) and all(bold[8])


WIDE = Table(tuple(Column(f"c{n}", "Quite long heading", form=str) for n in range(14)), (("0.0022 **",) * 14,), "Wide")


def test_columns_of_word_are_as_wide_as_their_words_and_fit_the_page(tables: dict[str, Table], tmp_path: Path) -> None:
    import docx

    (path,) = export_tables([*tables.values(), NASTY, WIDE], "docx", tmp_path)
    for grid in docx.Document(str(path)).tables:
        widths = [column.width.cm for column in grid.columns]
        assert sum(widths) <= 16.01 and not grid.autofit
        for row in grid.rows:
            for cell, width in zip(row.cells, widths, strict=True):
                (run,) = cell.paragraphs[0].runs or [None]
                size = 9.0 if run is None else run.font.size.pt
                longest = max(map(len, cell.text.split()), default=0)
                assert cell.width.cm == pytest.approx(width, abs=0.01)
                assert longest * 0.6 * size * 2.54 / 72 < width  # bold letters are 0.6 of their size wide
    narrow, *_, wide = docx.Document(str(path)).tables
    assert (
        narrow.columns[1].width > 2 * narrow.columns[0].width
        and wide.rows[1].cells[0].paragraphs[0].runs[0].font.size.pt < 9
    )


def test_tables_to_publish_have_labels_and_units_instead_of_keys(
    replayed: tuple[Any, Any], tables: dict[str, Table]
) -> None:
    keys = [factor.name for factor in replayed[0].factors] + ["least_coded_distance"]
    for table in numbered(tables.values()):
        text = " ".join((*table.heads, *(cell for row in table.cells for cell in row), table.note))
        assert not [key for key in keys if re.search(rf"\b{key}\b", text) and "_" in key], table.caption
    assert tables["Response surface runs"].heads[1] == "Yield stress (MPa)"
    assert "(MPa) 17" not in " ".join(tables["Calibrated parameters"].claimed)


def test_word_tables_have_three_rules_and_repeat_their_heading(tables: dict[str, Table], tmp_path: Path) -> None:
    import docx

    (path,) = export_tables([*tables.values(), NASTY], "docx", tmp_path)
    for grid in docx.Document(str(path)).tables:
        assert grid.style.name == "Light Shading" and 'w:noHBand="1"' in grid._tbl.tblPr.xml
        assert [("w:tblHeader" in row._tr.xml) for row in grid.rows] == [True, *[False] * (len(grid.rows) - 1)]


def latex_program() -> str | None:
    return shutil.which("pdflatex")


@pytest.mark.skipif(latex_program() is None, reason="pdflatex is not installed")
def test_latex_compiles_and_nothing_sticks_out(tables: dict[str, Table], tmp_path: Path) -> None:
    """All tables and one full of characters that LaTeX would take for its own; no line wider than the page."""
    nasty = replace(NASTY, rows=(*NASTY.rows[:1], ("°±³…αβεσρν√≤≥×–’µ", "0.1 *")))
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
def test_the_word_file_opens_in_a_word_processor(tables: dict[str, Table], tmp_path: Path) -> None:
    (path,) = export_tables(list(tables.values()), "docx", tmp_path)
    command = ["soffice", "--headless", f"-env:UserInstallation={(tmp_path / 'profile').as_uri()}"]
    subprocess.run([*command, "--convert-to", "txt:Text", path.name], cwd=tmp_path, capture_output=True, timeout=200)
    text = path.with_suffix(".txt").read_text("utf-8-sig")
    for words in ("Table 1.", "Table 9.", "Share, %", "0.0022 **", "<0.0001 **"):
        assert words in text


def test_an_unfinished_study_has_fewer_tables(replayed: tuple[Any, Any], results: Results) -> None:
    found = study_tables(replayed[0], Results(results.done[:1]))
    assert [table.title for table in found] == ["Factors", "Screening runs", "Effects on the maximum force"]


def test_stars_stay_next_to_their_number() -> None:
    """Where there is only room for words, "123456789 ***" is one word of 13 letters, next to words of 26."""
    cells = ("123456789 ***", *["abcdefghijklmnopqrstuvwxyz"] * 7)
    (paper,) = numbered([Table(tuple(Column(str(i), "h") for i in range(8)), (cells,))])
    widths, _ = _widths(paper)
    assert 2 * widths[0] - widths[1] == pytest.approx(_MARGIN)  # a width is this and something for each letter


@pytest.mark.parametrize(("count", "feet"), [(9, 0), (8, 1)])
def test_fixed_parameters_are_explained_where_there_are_any(
    replayed: tuple[Any, Any], results: Results, monkeypatch: pytest.MonkeyPatch, count: int, feet: int
) -> None:
    ranges = {factor.name: "1 to 2" for factor in replayed[0].factors[:count]}
    monkeypatch.setattr(export, "cited_ranges", lambda _: ranges)
    parameters = dict.fromkeys(ranges, 1.5)
    (table,) = export._parameters(Setting(replayed[0], SimpleNamespace(parameters=parameters)))
    assert [row[3] for row in table.cells].count("fixed") == 9 - count and len(table.foot) == feet
