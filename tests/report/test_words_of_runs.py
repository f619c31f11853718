"""What the report says about runs: warnings, provenance, failures, progress, and the tables of runs and tests."""

import io
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fakes import TWO_FACTORS, make_study
from rich.console import Console

from stemcal.drawing.table import MOST_ROWS, Column, Table
from stemcal.notes import Note, Remedy
from stemcal.report import outcome, progress
from stemcal.report.export import _markdown, document, export_tables, numbered
from stemcal.report.outcome import failures_of, read_first, shortened, shown_notes
from stemcal.report.page import headline
from stemcal.report.page.headline import Card, first_remedy, made_with, quantity_calibrated, question
from stemcal.report.progress import Watcher, _Bar, _Lines, describe, make_watch, notebook_watch
from stemcal.report.records import Details, provenance_rows, run_warnings, spec_hash
from stemcal.report.redraw import _last_line
from stemcal.report.study_tables import design_tables, factors_table, runs_table, setting_tables
from stemcal.report.terminal import identifiability, simulation_table, table_drawn
from stemcal.runs.answer import Progress
from stemcal.stages.ledger import LedgerRow
from stemcal.stages.verdict.result import Verdict
from stemcal.study.reading import load_study
from stemcal.vocabulary import CUTTING, DIAMETER, Variable, Vocabulary, Wording

CONFIGS = Path(__file__).parents[2] / "configs"


def printed(*parts: Any, width: int = 80) -> str:
    out = io.StringIO()
    for part in parts:
        Console(file=out, width=width, color_system=None).print(part)
    return out.getvalue()


# ---- records


def note(kind: str, text: str) -> Note:
    return Note(kind, "warning", text, Remedy("Look."))


def record(key: str, *warnings: Note, **provenance: Any) -> Any:
    details = Details(warnings=warnings, program_version=provenance.pop("version", None))
    return SimpleNamespace(key=key, details=details, provenance=provenance)


def test_warnings_of_runs_are_counted_by_kind_and_once_a_record() -> None:
    records = {
        "rsm 1": record("a", note("short", "First."), note("short", "Again."), note("drift", "Drift.")),
        "rsm 2": record("b", note("short", "Second.")),
        "8 mm": record("b", note("short", "Second.")),
        "9 mm": record("c"),
    }
    found = run_warnings(records)
    assert [(each.kind, each.severity, each.text) for each in found] == [
        ("short", "warning", "2 of 3 runs (first: rsm 1): First. Look."),
        ("drift", "warning", "1 of 3 runs (first: rsm 1): Drift. Look."),
    ]
    assert run_warnings({"9 mm": record("c")}) == []


def test_warnings_that_the_verdict_reports_are_not_repeated() -> None:
    records = {"8 mm": record("a", note("stroke_too_short", "Short."), note("own", "Own."))}
    doubted = Verdict.of([Note("physics", "warning", "Doubtful.")], None)
    assert [each.kind for each in run_warnings(records, doubted)] == ["own"]
    assert [each.kind for each in run_warnings(records, Verdict.of([], None))] == ["stroke_too_short", "own"]


def test_provenance_of_runs_on_two_machines() -> None:
    first = {"stemcal": "1.0", "python": "3.12", "host": "a", "started": "2026-01-02T03:04:05.6", "wall_seconds": 60.0}
    first |= {"finished": "2026-01-02T04:00:00"}
    later = {**first, "host": "b", "started": "2026-01-03T00:00:00", "finished": "2026-01-05T06:07:08.9"}
    records = {
        "rsm 1": record("a", version="v2", **first),
        "rsm 2": record("b", version="v1", **later),
        "8 mm": record("b", version="v1", **later),
        "9 mm": record("c", wall_seconds=None),
    }
    assert provenance_rows(records) == [
        ("Distinct runs", "3"),
        ("stemcal", "1.0"),
        ("Python", "3.12"),
        ("Host", "a, b"),
        ("Program", "v1; v2"),
        ("Computed", "2026-01-02 03:04:05 to 2026-01-05 06:07:08 UTC"),
        ("Computing time for all runs", "2 min"),
    ]
    assert provenance_rows({}) == [("Distinct runs", "0"), ("Computing time for all runs", "under 1 s")]


def test_the_spec_has_its_hash(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_bytes(b"abc")
    study: Any = SimpleNamespace(source=tmp_path / "s.yaml", solver=SimpleNamespace(program_name="lsdyna"))
    assert spec_hash(study).startswith("ba7816bf8f01cfea") and len(spec_hash(study)) == 64
    rows = dict(made_with(study, "77"))
    assert (rows["Spec"], rows["Solver"]) == ("s.yaml, SHA-256 77", "lsdyna")
    assert list(rows) == ["Spec", "Solver", "Written by", "Cite"] and rows["Written by"].startswith("stemcal ")
    (tmp_path / "s.yaml").unlink()
    assert spec_hash(study) == "" and dict(made_with(study, ""))["Spec"] == "s.yaml"


@pytest.mark.parametrize(
    ("content", "last"),
    [
        ("a\nb\n", "b"),
        ("a\n" + "x" * 300, "x" * 200),
        ("", ""),
        ("only", "only"),
        ("x\n" + "y" * 198 + "\n", "y" * 198),
    ],
)
def test_the_last_line_of_a_page(tmp_path: Path, content: str, last: str) -> None:
    (tmp_path / "p.html").write_text(content, encoding="utf-8", newline="")
    assert _last_line(tmp_path / "p.html") == last
    assert _last_line(tmp_path / "missing.html") == ""


# ---- outcome


def stage_of(*runs: tuple[str, bool, str, str], notes: tuple[Note, ...] = ()) -> Any:
    outcomes = [(label, SimpleNamespace(ok=ok, reason=reason, message=text)) for label, ok, reason, text in runs]
    return SimpleNamespace(name="rsm", runs=lambda: iter(outcomes), notes=notes)


def test_failures_have_their_number_reasons_and_first_message() -> None:
    assert failures_of(stage_of(("rsm 1", True, "", ""))) == ""
    runs = [
        *(("rsm 1", False, "nan", ""), ("rsm 2", True, "", ""), ("rsm 3", False, "nan", "two\nlines")),
        ("rsm 4", False, "", "later"),
    ]
    assert failures_of(stage_of(*runs)) == (
        "rsm: 3 of 4 runs failed: nan (2), no reason given (1); first message (rsm 3): two lines; see rsm.json"
    )
    assert failures_of(stage_of(("rsm 1", False, "nan", ""))) == "rsm: 1 of 1 run failed: nan (1); see rsm.json"


def test_notes_on_intervals_are_those_of_a_calibrated_study() -> None:
    known, other = Note("known", "info", "Known."), Note("other", "info", "Other.")
    stage = stage_of(notes=(known, other))
    assert shown_notes(stage, True) == [known, other]
    first, withheld = shown_notes(stage, False)
    assert first == other and (withheld.kind, withheld.severity) == ("withheld", "warning")
    assert "The study is not calibrated" in withheld.text
    assert shown_notes(stage_of(notes=(other,)), False) == [other]


def test_the_most_severe_note_of_each_kind_is_first() -> None:
    order = ["info", "warning", "caution", "error", "warning"]
    notes = [(f"stage {n}", Note(f"kind {n % 4}", severity, "")) for n, severity in enumerate(order)]  # type: ignore[arg-type]
    found = [(title, each.kind) for title, each in read_first(notes)]
    assert found == [("stage 3", "kind 3"), ("stage 1", "kind 1"), ("stage 4", "kind 0"), ("stage 2", "kind 2")]


def test_a_long_table_names_the_file_with_the_most_common_columns() -> None:
    columns = (Column("run"), Column("yield"), Column("response"))
    rows = tuple((n, n, n) for n in range(MOST_ROWS + 1))
    files = {"rsm_other": Table((Column("run"),), ()), "rsm_runs": Table((Column("yield"), Column("run")), ())}
    stage: Any = SimpleNamespace(tables=lambda: files, naming=CUTTING)
    short = shortened(stage, Table(columns, rows))
    assert len(short.rows) == MOST_ROWS and short.foot[-1].endswith("`rsm_runs.csv` contains all rows.")
    whole = Table(columns, rows[:-1])
    assert shortened(stage, whole) is whole
    assert outcome.MOST == 5


# ---- the head of the page


@pytest.mark.parametrize(("interval", "limited"), [("1 to 2", False), ("≤ 1 to 2", True), ("1 to ≥ 2", True)])
def test_a_card_says_whether_its_interval_ends_with_the_region(interval: str, limited: bool) -> None:
    assert Card("a", "1.5", "MPa", interval).limited is limited


def test_the_first_remedy_or_what_to_do_without_one() -> None:
    look, own = Note("a", "error", "A."), Note("b", "warning", "B.", Remedy("Do this."))
    assert first_remedy(Verdict.of([look, own], None)).text == "Do this."
    assert first_remedy(Verdict.of([look], None)).text == "See the reasons below."
    assert first_remedy(Verdict.of([], None)).text.startswith("Report the parameter values, their confidence intervals")


OWN = """\
name: own
factors: [{name: k, label: Stiffness, low: 1, high: 3}, {name: b, label: Width, low: 1, high: 2}]
responses: [{name: y, label: Deflection, unit: mm}, {name: z, label: Mass, unit: g}]
solver: {kind: sheet}
"""


def test_the_question_of_an_optimisation_names_factors_and_goals(tmp_path: Path) -> None:
    cutter = load_study(CONFIGS / "chrysanthemum-cutter.yaml")
    assert quantity_calibrated(cutter).startswith("Optimisation of a ")
    asked = question(cutter)
    assert asked.startswith("Which ") and asked.endswith("?") and "minimise the" in asked
    factors = [factor.label.lower() for factor in cutter.factors]
    assert all(label in asked for label in factors)
    own = OWN + "conditions: []\ngoal: {minimise: [z], maximise: [y]}\nscreen: {design: none}\nrsm: {factors: [k, b]}\n"
    (tmp_path / "own.yaml").write_text(own, encoding="utf-8")
    study = load_study(tmp_path / "own.yaml")
    assert quantity_calibrated(study) == "Optimisation of a simulated response"
    assert question(study) == "Which stiffness and width minimise the mass and maximise the deflection?"


def test_the_question_of_a_calibration_names_what_is_fitted_and_where(tmp_path: Path) -> None:
    own = OWN + "conditions: [{name: load, label: Load, unit: N}]\n"
    own += "targets: [{load: 5, y: 3, z: 4, sd: {y: 1, z: 1}}]\ninvert: {responses: [y, z]}\n"
    (tmp_path / "own.yaml").write_text(own, encoding="utf-8")
    study = load_study(tmp_path / "own.yaml")
    fitted = "deflection and mass"
    assert quantity_calibrated(study) == f"Calibration of a simulation against the measured {fitted}"
    assert question(study) == f"Which parameter values reproduce the measured {fitted} at load 5 N?"
    assert quantity_calibrated(make_study(tmp_path)) == "Calibration of a stem-cutting model"
    assert headline.question(make_study(tmp_path)).endswith(" of stems with a diameter of 8 mm?")


# ---- tables of a study


def test_a_table_of_runs_has_the_first_eight_letters_of_a_key() -> None:
    row = LedgerRow("rsm", 3, "0123456789abcdef", "ok", 123.456, "", "", False, 8.0, {}, wall_seconds=2.25)
    failed = replace(row, status="failed", response=None, reason="nan", wall_seconds=None)
    table = runs_table([row, failed], Wording(CUTTING), "Runs")
    assert table.heads == ("Stage", "Key", "Status", "Reason", "Run", "Diameter, mm", "Force, N", "Time, s")
    assert table.cells[0] == ("rsm", "01234567", "ok", "", "3", "8", "123.5", "2.2")
    assert table.cells[1] == ("rsm", "01234567", "failed", "nan", "3", "8", "–", "–")
    assert (table.foot, runs_table([], Wording(CUTTING), "Runs").foot) == ((), ("None.",))


def test_factors_have_their_keys_on_the_page_and_not_in_publications(tmp_path: Path) -> None:
    study = make_study(tmp_path)
    table, published = factors_table(study), factors_table(study, keys=False)
    assert table.heads == ("Symbol", "Factor", "Meaning", "Unit", "Low", "High")
    assert published.heads == ("Symbol", "Factor", "Unit", "Low", "High")
    assert table.cells[3] == ("X4", "yield_stress", "yield stress", "MPa", "10", "20")
    assert published.cells[0] == ("X1", "density", "kg/m³", "1000", "1200")


def measured_of(folder: Path, targets: str, more: str = "") -> Table:
    (folder / "m.yaml").write_text(f"{TWO_FACTORS}targets:\n{targets}{more}", encoding="utf-8")
    return setting_tables(load_study(folder / "m.yaml"))[1]


def test_measured_values_in_bold_are_those_of_the_fit(tmp_path: Path) -> None:
    targets = "  - {diameter: 7 mm, force: 120 N, sd: 9 N, n: 6}\n  - {diameter: 8 mm, force: 159.2 N}\n"
    table = measured_of(tmp_path, targets)
    assert (table.title, table.heads) == ("Measured maximum force", ("Diameter, mm", "Measured, N", "SD, N", "n"))
    assert table.cells == (("7", "120", "9", "6"), ("8", "159.2", "–", "–"))
    assert table.strong == {1} and table.foot == ("The values in bold (8 mm) were used in the fit.",)
    joint = measured_of(tmp_path, targets, "invert: {diameters: all}\n")
    assert (joint.strong, joint.foot) == (set(), ("The parameters are fitted jointly to all measurements.",))


def test_measured_travel_and_its_scatter_have_columns(tmp_path: Path) -> None:
    both = "  - {diameter: 8 mm, force: 159.2 N, travel: 2 mm, work: 90 mJ, sd: {force: 9 N, travel: 0.3 mm}, n: 6}\n"
    table = measured_of(tmp_path, both)
    assert table.heads == ("Diameter, mm", "Force, N", "SD, N", "Travel, mm", "SD, mm", "Work, mJ", "n")
    assert table.cells[0] == ("8", "159.2", "9", "2", "0.3", "90", "6")
    assert table.title == "Measured maximum force, travel at maximum force and work up to maximum force"


@pytest.mark.parametrize(("varied", "crowded"), [(4, False), (5, True)])
def test_more_than_four_factors_have_symbols(varied: int, crowded: bool) -> None:
    from stemcal.stages.result import DesignRuns
    from stemcal.storage.rows import Rows

    names = [f"factor_{n}" for n in range(varied)]
    levels = {name: 0.5 + n for n, name in enumerate(names)}
    fields = {"run": 1, "levels": levels, "coded": dict.fromkeys(names, 0.0)}
    outcomes = SimpleNamespace(of=lambda name: 7.0, response=100.0)
    run = SimpleNamespace(**fields, condition=None, outcome=outcomes)
    design = DesignRuns("x", Rows([run]))  # type: ignore[list-item]
    assert design.varied == tuple(names)
    naming = Vocabulary(DIAMETER, (CUTTING.response, *CUTTING.further, Variable("angle", "Angle", "φ", "deg")))
    result: Any = SimpleNamespace(design=design, naming=naming, name="rsm")
    (table,) = design_tables(result, {name: f"X{n}" for n, name in enumerate(names)}, {"factor_0": "First"})
    heads = [f"X{n}" for n in range(varied)] if crowded else ["First", *names[1:]]
    assert list(table.heads) == ["Run", *heads, "Force, N", "Angle, °"]
    assert table.title == "Response surface runs" and table.detail
    assert table.foot == (("The symbols are defined in the table of factors.",) if crowded else ())
    assert design_tables(SimpleNamespace(design=None), {}) == []  # type: ignore[arg-type]


# ---- the terminal


def simulated(**changes: Any) -> Any:
    fields = {
        **{"peak_force": 123.456, "peak_force_raw": 130.0, "peak_time": 0.25, "peak_travel": 0.4167},
        **{"element_steps_per_second": 12.34e6, "elements": 100, "deleted_elements": 3, "steps": 5000},
        **{"wall_seconds": 61.0, "energy_drift_percent": 0.1234, "contact_energy_percent": -0.5},
        **{"kinetic_ratio_percent": 2.0, "break_travel": None, "severed": None, "first_fracture_force": None},
        **{"first_fracture_travel": None, "severed_travel": None, "cutting_energy": None, "stroke_was_enough": True},
    }
    return SimpleNamespace(**{**fields, **changes})


def rows_of(result: Any) -> dict[str, str]:
    lines = printed(simulation_table(result), width=120).splitlines()
    return dict(line.strip().split("  ", 1) for line in lines if "  " in line.strip())


def test_a_simulation_is_printed_with_its_numbers() -> None:
    rows = {name: value.strip() for name, value in rows_of(simulated()).items()}
    assert rows == {
        "Maximum force": "123.5 N",
        "before the filter": "130.0 N",
        "at": "0.2500 s, 0.417 mm of travel",
        "Elements": "100 (3 deleted before the peak force)",
        "Steps": "5000 in 61 s, 12.3 M element-steps/s",
        "Energy drift": "0.123 %",
        "Contact energy": "at least −0.500 % of the work, without friction",
        "Kinetic energy": "at most 2.000 % of the internal energy",
    }


@pytest.mark.parametrize(
    ("changes", "rows"),
    [
        ({"break_travel": 0.5}, {"First fracture at": "0.500 mm of travel"}),
        (
            {"severed": True, "severed_travel": 4.0, "cutting_energy": 321.4},
            {"Cut through at": "4.000 mm of travel", "Cutting energy": "321.4 mJ"},
        ),
        (
            {"severed": False, "first_fracture_force": 88.88, "first_fracture_travel": 1.5},
            {"First fracture at": "1.500 mm of travel, 88.88 N", "Cut through at": "not within the stroke"},
        ),
    ],
)
def test_fractures_are_printed(changes: dict[str, Any], rows: dict[str, str]) -> None:
    found = {name: value.strip() for name, value in rows_of(simulated(**changes)).items()}
    assert {name: found.get(name) for name in rows} == rows
    assert ("First fracture at" in found) is ("First fracture at" in rows)


def test_a_table_on_the_terminal_has_its_foot_indented_and_its_numbers_at_the_right() -> None:
    columns = (Column("name", "Name"), Column("value", "Value, N", form=str))
    drawn = table_drawn(Table(columns, (("a", 1), ("bb", 22)), "Title", ("A foot.",), ("Claimed.",), frozenset({1})))
    assert printed(*drawn).splitlines()[1] == "Name  Value, N"  # no blanks at the edges
    lines = [line.rstrip() for line in printed(*drawn).splitlines()]
    assert lines[0].strip() == "Title"
    assert lines[3:5] == ["a            1", "bb          22"]
    assert lines[5:] == ["  A foot.", "  Claimed.", ""]
    out = io.StringIO()
    Console(file=out, width=80, color_system="standard", force_terminal=True).print(drawn[0])
    assert "\x1b[1mbb" in out.getvalue() and "\x1b[1ma " not in out.getvalue()


def test_notes_on_intervals_are_printed_with_a_heading_only_if_the_study_is_calibrated() -> None:
    stage = stage_of(
        notes=(Note("known", "info", "Both."), Note("other", "info", "Other."), Note("known", "info", "a."))
    )
    assert printed(*identifiability(stage)) == "Identifiability\n  Both.\n  a.\n\n"
    assert identifiability(stage, False) == [] and identifiability(stage_of()) == []


@pytest.mark.parametrize(("columns", "gap"), [(7, 2), (8, 1)])
def test_eight_columns_and_more_are_closer_together(columns: int, gap: int) -> None:
    table = Table(tuple(Column(f"c{n}") for n in range(columns)), (("aa",) * columns,))
    heading = printed(*table_drawn(table), width=200).splitlines()[0]
    assert heading.rstrip() == (" " * gap).join(f"c{n}" for n in range(columns))


# ---- progress


def at(done: int, **changes: Any) -> Progress:
    return replace(Progress("screen", done, 12, 0, 0, None), **changes)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({}, "Screening: 5/12 runs"),
        ({"points": 12}, "Screening: 5/12 runs"),
        ({"points": 13}, "Screening: 5/12 runs for 13 design points"),
        ({"cached": 2}, "Screening: 5/12 runs, 2 from earlier"),
        ({"failed": 1}, "Screening: 5/12 runs, 1 failed"),
        ({"last_response": 120.43, "last_condition": 8.0}, "Screening: 5/12 runs, last 120.4 N at 8 mm"),
        ({"last_response": 120.43}, "Screening: 5/12 runs, last 120.4 N"),
        ({"stage": "material"}, "Failure strain for this element size: 5/12 runs"),
        ({"stage": "unknown"}, "unknown: 5/12 runs"),
        ({"preparing": True}, "Screening: compiling the solver for this machine"),
    ],
)
def test_a_line_of_progress(changes: dict[str, Any], line: str) -> None:
    found = describe(at(5, **changes))
    assert found == line or (changes.get("preparing") and found.startswith(line))
    bare = Vocabulary(None, (Variable("y", "Y", "y", "mm"),))
    assert describe(at(5, last_response=2.0, last_condition=8.0), bare) == "Screening: 5/12 runs, last 2.000 mm"


def test_lines_are_printed_each_half_minute_and_at_both_ends_of_a_stage() -> None:
    out, now = io.StringIO(), [0.0]
    watch = _Lines(Console(file=out, width=200), clock=lambda: now[0])
    for second, progress_ in (
        *((0.0, at(0)), (1.0, at(1)), (29.9, at(2)), (30.0, at(3)), (30.1, at(4)), (31.0, at(12))),
        *((31.0, at(12, failed=1)), (62.0, at(12, failed=1)), (93.0, at(12, failed=2))),
        *((94.0, at(0, stage="rsm")), (95.0, at(13, stage="rsm", total=13))),
    ):
        now[0] = second
        watch(progress_)
    assert out.getvalue().splitlines() == [
        *("Screening: 0/12 runs", "Screening: 3/12 runs", "Screening: 12/12 runs"),
        *("Screening: 12/12 runs, 1 failed", "Screening: 12/12 runs, 2 failed"),
        *("Response surface: 0/12 runs", "Response surface: 13/13 runs"),
    ]


def test_where_progress_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Console(file=io.StringIO(), force_terminal=True)
    file = Console(file=io.StringIO())
    kinds = [type(make_watch(console)) for console in (terminal, file, None)]
    assert kinds == [_Bar, _Lines, Watcher]
    assert type(notebook_watch(True)) is _Bar and type(notebook_watch(False)) is Watcher
    monkeypatch.setattr("rich.console.Console", lambda **_: file)
    assert type(notebook_watch()) is Watcher
    monkeypatch.setattr("rich.console.Console", lambda **_: terminal)
    assert type(notebook_watch()) is _Bar and progress.COMPILING.startswith("compiling")


def test_a_bar_has_its_number_of_runs_once_the_solver_is_compiled() -> None:
    bar = _Bar(Console(file=io.StringIO(), force_terminal=True, width=100))
    with bar:
        bar(at(0, preparing=True))
        assert (bar.bars.tasks[0].total, bar.bars.tasks[0].fields["tail"]) == (None, "compiling, once")
        bar(at(5, failed=1))
        assert (bar.bars.tasks[0].total, bar.bars.tasks[0].completed) == (12, 5)
        assert bar.bars.tasks[0].fields["tail"] == "1 failed"
        bar.busy("drawing the report")
    assert [task.description for task in bar.bars.tasks] == ["Screening", "drawing the report"]
    texts = [getattr(column, "text_format", type(column).__name__) for column in bar.bars.columns]
    assert texts == [
        *("{task.description}", "BarColumn", "MofNCompleteColumn", "TimeElapsedColumn", "TimeRemainingColumn"),
        "{task.fields[tail]}",
    ]


# ---- files for publication

PAPER = Table(
    (Column("name", "Name"), Column("value", "Simulated maximum force, N", form=str)),
    (("a_b", 1.5), ("", 2.5)),
    "A & B",
    ("One", "two."),
    ("Claimed",),
    frozenset({0, 1}),
)


def test_a_table_in_latex_and_markdown_word_for_word() -> None:
    """Rows in bold, but no empty cell; the long heading in lines of at most 16 characters."""
    _, paper = numbered([PAPER, PAPER])
    lines = [line for line in document([paper]).splitlines() if line]
    assert lines[lines.index(r"\begin{document}") :] == [
        *(r"\begin{document}", r"\setcounter{table}{1}", r"\begin{table}[htbp]", r"\centering\small"),
        *(r"\caption{A \& B.}", r"\label{tab:2}", r"\begin{tabular}{lr}", r"\toprule"),
        r"Name & \shortstack[r]{\strut Simulated\\maximum force, N} \\",
        r"\midrule",
        r"\textbf{a\_b} & \textbf{1.5} \\",
        r" & \textbf{2.5} \\",
        *(r"\bottomrule", r"\end{tabular}"),
        r"\par\smallskip\parbox{\linewidth}{\footnotesize One. two. Claimed.}",
        *(r"\end{table}", r"\end{document}"),
    ]
    assert _markdown(paper) == (
        "**Table 2.** A & B.\n\n| Name | Simulated maximum force, N |\n|---|--:|\n"
        "| **a\\_b** | **1.5** |\n|  | **2.5** |\n\nNote: One. two. Claimed.\n"
    )


def test_names_of_csv_files_have_at_most_sixty_letters(tmp_path: Path) -> None:
    tables = [replace(PAPER, title=title) for title in ("A & B", "x" * 80, "Ünder: 100 %")]
    names = [path.name for path in export_tables(tables, "csv", tmp_path)]
    assert names == ["table01-a-b.csv", f"table02-{'x' * 60}.csv", "table03-ünder-100.csv"]
    content = (tmp_path / names[0]).read_bytes()
    assert content.startswith(b"\xef\xbb\xbfName,") and content.decode("utf-8-sig").splitlines()[1] == "a_b,1.5"


# ---- the Word file


def test_the_page_of_the_word_file_and_its_text(tmp_path: Path) -> None:
    import docx
    from docx.enum.text import WD_ALIGN_PARAGRAPH

    columns = (Column("name", "Name"), Column("value", "Value, N", form=str))
    table = Table(columns, (("a", 1.5), ("b", 2.5)), "A title", ("One", "two."), strong=frozenset({1}))
    bare = Table(columns[:1], (("c",),), "Bare")
    (path,) = export_tables([table, bare], "docx", tmp_path)
    document = docx.Document(str(path))
    page = document.sections[0]
    assert (round(page.page_width.cm, 1), round(page.page_height.cm, 1)) == (21.0, 29.7)
    margins = (page.left_margin, page.right_margin, page.top_margin, page.bottom_margin)
    assert [round(margin.cm, 1) for margin in margins] == [2.5] * 4
    assert document.styles["Normal"].font.size.pt == 9.0
    assert document.core_properties.title == "Tables and figures from a stemcal study"
    captions = [line for line in document.paragraphs if line.style.name == "Caption"]
    assert captions[0].paragraph_format.keep_with_next and captions[0].text.endswith("A title.")
    assert captions[0].runs[0].text == "Table " and captions[0].runs[-1].bold is False
    assert {run.font.size.pt for caption in captions for run in caption.runs} == {9.0}
    assert {str(run.font.color.rgb) for caption in captions for run in caption.runs} == {"000000"}
    grid = document.tables[0]
    assert [[cell.text for cell in row.cells] for row in grid.rows] == [
        ["Name", "Value, N"],
        ["a", "1.5"],
        ["b", "2.5"],
    ]
    bold = [[cell.paragraphs[0].runs[0].bold for cell in row.cells] for row in grid.rows]
    assert bold == [[None, None], [None, None], [True, True]]
    assert [column.width.cm for column in grid.columns] == pytest.approx([1.4, 2.3], abs=0.01)  # 0.5 and 0.225 a letter
    left, right = (cell.paragraphs[0] for cell in grid.rows[1].cells)
    assert (left.alignment, right.alignment) == (WD_ALIGN_PARAGRAPH.LEFT, WD_ALIGN_PARAGRAPH.RIGHT)
    assert (left.paragraph_format.space_before.pt, left.paragraph_format.space_after.pt) == (1.5, 1.5)
    feet = [line for line in document.paragraphs if line.style.name == "Normal"]
    assert [line.text for line in feet] == ["Note: One. two.", ""]
    assert [line.paragraph_format.space_before.pt for line in feet] == [3.0, 3.0]
    assert not any('w:firstColumn="1"' in grid._tbl.tblPr.xml for grid in document.tables)


@pytest.mark.parametrize(
    ("size", "width", "height"), [((3.0, 2.0), 7.62, 5.08), ((8.0, 2.0), 16.0, 4.0), ((4.0, 16.0), 5.0, 20.0)]
)
def test_a_figure_is_reduced_to_the_page_but_not_enlarged(
    tmp_path: Path, size: tuple[float, float], width: float, height: float
) -> None:
    """16 cm wide and 20 cm high at most."""
    import docx
    from docx.enum.text import WD_ALIGN_PARAGRAPH
    from matplotlib.figure import Figure

    from stemcal.drawing.plot import Plot
    from stemcal.report.docx import write_word

    plot = Plot("p", "runs", "A caption.", lambda: Figure(figsize=size))
    write_word([], [plot], tmp_path / "a.docx")
    document = docx.Document(str(tmp_path / "a.docx"))
    (picture,) = document.inline_shapes
    assert (picture.width.cm, picture.height.cm) == (pytest.approx(width, rel=0.01), pytest.approx(height, rel=0.02))
    line, caption = document.paragraphs
    assert line.alignment == WD_ALIGN_PARAGRAPH.CENTER and line.paragraph_format.keep_with_next
    assert caption.text.endswith("A caption.") and 'descr="A caption."' in line._p.xml
