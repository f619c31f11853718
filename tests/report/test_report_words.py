"""A study of its own words is told in these: an angle of repose alone, or with a bulk density over moisture."""

import re
import shutil
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fakes import PYTHON
from workflow import calibrate

from stemcal.drawing.style import svg
from stemcal.drawing.table import Table
from stemcal.report.export import document, numbered, study_tables
from stemcal.report.gallery import gallery
from stemcal.report.outcome import certainty, outcome_sentences, shown_notes, tables_of
from stemcal.report.page.headline import quantity_calibrated, question
from stemcal.report.page.page import _first_pictures, _run_tables
from stemcal.report.progress import describe
from stemcal.report.records import read_records
from stemcal.report.study_tables import runs_table, setting_tables
from stemcal.report.terminal import final_tables
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.ledger import ledger
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.rsm.showing import equation
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.vocabulary import CUTTING, Variable, Vocabulary, Wording

CASE = Path(__file__).parents[1] / "cases" / "repose"
OF_STEMS = re.compile(r"\b((?i:forces?|diameters?|stems?|blades?|cut|cutting)|N|N²|mm|mJ)\b|\bF =|Shear Force")
ANGLE = "  - {name: angle, label: Angle of repose, symbol: θ, unit: deg}\n"
BULK = "  - {name: bulk, label: Bulk density, symbol: ρ, unit: kg/m3}\n"
MOIST = """\
targets:
  - {moisture: 12, angle: 32.6 deg, n: 5, bulk: 745 kg/m3, sd: {angle: 0.8 deg, bulk: 6}}
  - {moisture: 16, angle: 33.0 deg, n: 5, bulk: 741 kg/m3, sd: {angle: 0.9 deg, bulk: 6}}
climb: {}
refine: {}
invert: {diameters: all, responses: all}
"""
Told = tuple[Study, StudyFolder, Results]


def done(folder: Path, changed: Iterable[tuple[str, str]]) -> Told:
    """Calibrate the heap with a changed spec."""
    shutil.copytree(CASE, folder / "case")
    spec = folder / "case" / "angle.yaml"
    text = spec.read_text(encoding="utf-8").replace("[python,", f"[{PYTHON},")
    for old, new in changed:
        assert old in text
        text = text.replace(old, new)
    spec.write_text(text, encoding="utf-8")
    template = spec.with_name("given.json")
    if "conditions" in text:
        given = template.read_text(encoding="utf-8").replace('{"static"', '{"moisture": {{moisture}}, "static"')
        template.write_text(given, encoding="utf-8")
    study, results = load_study(spec), StudyFolder(folder / "out")
    calibrate(study, results, InlineExecutor())
    return study, results, fresh_results(study, results)


@pytest.fixture(scope="module")
def angle(tmp_path_factory: pytest.TempPathFactory) -> Told:
    """One response, no condition."""
    return done(tmp_path_factory.mktemp("angle"), [])


@pytest.fixture(scope="module")
def moist(tmp_path_factory: pytest.TempPathFactory) -> Told:
    """Two responses over moisture, fitted together, with a climb and a refinement."""
    one = "{file: out.json, path: angle}"
    both = f"{{angle: {one}, bulk: {one.replace('path: angle', 'path: bulk')}}}"
    changes = [
        (ANGLE, ANGLE + BULK + "conditions: [{name: moisture, unit: '%'}]\n"),
        (one, both),
        ("targets:\n  - {angle: 32.6 deg, sd: 0.8 deg, n: 5}\n", MOIST),
    ]
    return done(tmp_path_factory.mktemp("moist"), changes)


@pytest.fixture(params=["angle", "moist"])
def told(request: pytest.FixtureRequest) -> Told:
    """Each of both."""
    found: Told = request.getfixturevalue(request.param)
    return found


def all_tables(told: Told) -> list[Table]:
    """Return every table of terminal and page."""
    study, folder, results = told
    names = Wording(study.naming)
    stages = [table for stage in results.done for table in tables_of(stage)]
    runs = runs_table(ledger(study, folder), names, "Runs")
    ends = final_tables(study, results, True)
    return [*stages, *setting_tables(study), *_run_tables(study, results), *ends, runs]


def words_of(table: Table) -> list[str]:
    foot = (*table.foot, *table.claimed)
    return [table.title, *table.heads, *(cell for row in table.cells for cell in row), *foot]


def of_stems(texts: Iterable[str]) -> list[str]:
    """Return the texts that speak of the shear test."""
    return [text for text in texts if OF_STEMS.search(text)]


def test_tables_speak_of_no_stem(told: Told) -> None:
    tables = all_tables(told)
    assert len(tables) > 12
    assert of_stems(word for table in tables for word in words_of(table)) == []


def test_tables_have_the_studys_own_heads(angle: Told) -> None:
    screen, surface, _, validation = angle[2].done
    (effects,), (anova, coefficients, fit, *_) = tables_of(screen), tables_of(surface)
    assert effects.title == "Effects on the angle of repose"
    assert effects.heads[2] == "Effect, °" and anova.heads[0] == "Source"
    assert coefficients.heads[1] == "Coefficient, °"
    assert coefficients.foot[0].startswith("θ = 29.")
    assert "PRESS" in [row[0] for row in fit.rows]
    assert tables_of(validation)[0].heads == ("Role", "Measured, °", "Simulated, °", "Error, %")
    assert [column.left for column in tables_of(validation)[0].columns] == [True, False, False, False]


def test_a_condition_of_its_own_has_a_column(moist: Told) -> None:
    validation = moist[2].of(ValidateResult)
    assert validation is not None
    table = tables_of(validation)[0]
    assert table.title == "Measured and simulated angle of repose"
    assert table.heads[:3] == ("Moisture, %", "Role", "Measured, °")
    assert [row[0] for row in table.cells] == ["12", "16"]
    errors = [row.compared.error_percent for row in validation.rows]
    errors += [one.error_percent for row in validation.rows for one in row.further]
    largest = max(abs(error or 0.0) for error in errors)
    assert table.foot[0].startswith(f"Largest absolute percentage error: {largest:.2f} %")


def test_further_responses_are_named_with_their_units(moist: Told) -> None:
    tables = {table.title: table for table in all_tables(moist)}
    beside = tables["Responses other than the angle of repose"]
    assert [(*row[:3], row[4]) for row in beside.cells] == [
        ("bulk density", "12", "745", "kg/m³"),
        ("bulk density", "16", "741", "kg/m³"),
    ]
    assert beside.foot == ()
    joint = tables["Fitted together"]
    assert [row[:3] for row in joint.cells] == [
        ("angle of repose", "12", "32.6"),
        ("bulk density", "12", "745"),
        ("angle of repose", "16", "33"),
        ("bulk density", "16", "741"),
    ]
    measured = tables["Measured angle of repose and bulk density"]
    assert measured.heads == ("Moisture, %", "Angle of repose, °", "SD, °", "Bulk density, kg/m³", "SD, kg/m³", "n")
    assert measured.cells[1] == ("16", "33", "0.9", "741", "6", "5")
    assert tables["Effects on the bulk density"].heads[2] == "Effect, kg/m³"
    surface = tables["Response surface in coded units: bulk density at moisture 16 %"]
    assert surface.heads[1] == "Coefficient, kg/m³" and surface.foot[0].startswith("ρ = ")
    assert "Analysis of variance: bulk density at moisture 16 %" in tables
    surfaces = tables["Fit quality of all response surfaces"]
    assert [row[:2] for row in surfaces.cells[2:]] == [("angle of repose", "16"), ("bulk density", "16")]
    assert tables["Screening runs"].heads[-2:] == ("Angle of repose, °", "Bulk density, kg/m³")


def test_published_tables_speak_of_no_stem(told: Told) -> None:
    study, _, results = told
    tables = numbered(study_tables(study, results))
    assert of_stems([document(tables).partition("begin{document}")[2]]) == []
    assert "Measured and simulated angle of repose." in [table.caption for table in tables]
    assert r"$\theta$ = " in document(tables)


def test_figures_speak_of_no_stem(moist: Told) -> None:
    study, folder, results = moist
    plots = gallery(study, results, read_records(results, folder))
    texts = [text for plot in plots for text in re.findall(r"<text[^>]*>(.*?)</text>", svg(plot.figure), re.DOTALL)]
    assert len(texts) > 50
    assert of_stems([*texts, *(plot.caption for plot in plots), *(plot.name for plot in plots)]) == []
    assert "force-travel" not in {plot.name for plot in plots}


def test_each_response_has_its_figure_of_validation(moist: Told) -> None:
    study, folder, results = moist
    plots = gallery(study, results, read_records(results, folder))
    assert [plot.name for plot in _first_pictures(study, plots)] == ["validation", "validation-bulk"]
    (axes,) = next(plot for plot in plots if plot.name == "validation-bulk").figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("moisture, %", "bulk density, kg/m³")
    assert list(axes.lines[0].get_ydata()) == [745.0, 741.0]


def test_without_a_condition_the_axis_has_no_values(angle: Told) -> None:
    study, folder, results = angle
    plots = gallery(study, results, read_records(results, folder))
    (axes,) = next(plot for plot in plots if plot.name == "validation").figure.axes
    assert axes.get_ylabel() == "angle of repose, °"
    assert [label.get_text() for label in axes.get_xticklabels()] == [""]


def test_the_page_asks_in_the_studys_words(angle: Told, moist: Told) -> None:
    assert quantity_calibrated(angle[0]) == "Calibration of a simulation against the measured angle of repose"
    assert question(angle[0]) == "Which parameter values reproduce the measured angle of repose?"
    assert question(moist[0]) == (
        "Which parameter values reproduce the measured angle of repose and bulk density at moisture 12 and 16 %?"
    )


def test_sentences_speak_of_no_stem(angle: Told, moist: Told) -> None:
    outcomes = [sentence for told in (angle, moist) for stage in told[2].done for sentence in outcome_sentences(stage)]
    assert of_stems(outcomes) == []
    assert of_stems(certainty(angle[2])) == []
    notes = [str(note) for told in (angle, moist) for stage in told[2].done for note in shown_notes(stage, True)]
    assert of_stems(notes) == []
    validation, joint = angle[2].of(ValidateResult), moist[2].of(InvertResult)
    assert validation is not None and joint is not None
    difference = r"The simulated angle of repose differs from the measurement by at most [\d.]+ %\."
    assert re.fullmatch(difference, outcome_sentences(validation)[0])
    missed = r".* response surfaces are [\d.]+ % \(angle of repose\) and [\d.]+ % \(bulk density\)\."
    assert re.fullmatch(missed, outcome_sentences(joint)[1])


def test_runs_are_listed_under_the_studys_names(angle: Told, moist: Told) -> None:
    heads = []
    for study, folder, _ in (angle, moist):
        table = runs_table(ledger(study, folder), Wording(study.naming), "Runs")
        heads.append([column.key for column in table.headed(study.naming.headings).columns])
    assert heads[0] == ["stage", "key", "status", "reason", "run", "angle", "wall_seconds"]
    assert heads[1] == ["stage", "key", "status", "reason", "run", "moisture", "angle", "wall_seconds"]
    assert [column.left for column in table.columns[:5]] == [True, True, True, True, False]  # a key is no number
    assert str(angle[0]) == "Study repose: 5 factors, 1 target, solver command"
    assert "2 targets" in str(moist[0])


def test_progress_tells_the_last_answer() -> None:
    progress: Any = SimpleNamespace(
        stage="screen",
        done=5,
        total=8,
        cached=0,
        failed=0,
        last_response=0.5312,
        last_condition=12.0,
        preparing=False,
        points=8,
    )
    restitution = Variable("cor", "Restitution", "e", "1")
    assert describe(progress, Vocabulary(None, (restitution,))) == "Screening: 5/8 runs, last 0.5312"
    assert describe(progress, CUTTING) == "Screening: 5/8 runs, last 0.5312 N at 12 mm"


def test_small_responses_keep_their_digits() -> None:
    restitution = Variable("cor", "Restitution", "e", "1")
    coefficients: Any = [SimpleNamespace(term="1", value=0.5312), SimpleNamespace(term="a", value=-0.00312)]
    assert equation(coefficients, {"a": "X1"}, restitution) == "e = 0.53120 − 0.00312·X1"
    assert equation(coefficients, {"a": "X1"}) == "F = 0.53 − 0.00·X1"
