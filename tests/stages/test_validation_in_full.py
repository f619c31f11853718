"""Every row, sentence, figure and reason of a validation whose numbers are known."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from known_results import Known, evidence, known, spec_of

from stemcal.doe.comparison import Exponent, Formula, ValidationRow
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.stages.fitting import Measured
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.result import Head, Judged, Prediction
from stemcal.stages.validate import verdict_rules as rules
from stemcal.stages.validate.analysis import _from_table, _result, validate_notes
from stemcal.stages.validate.result import FurtherRow, ValidateResult, ValidateRow
from stemcal.stages.validate.showing import MOST_RESPONSES, ValidateShowing, draw_validation, validate_plots
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.vocabulary import CUTTING, Variable, Vocabulary, Wording


def row(d: float, measured: float, simulated: float | None, role: Any = "held_out", **more: Any) -> ValidateRow:
    error = None if simulated is None else 100.0 * (measured - simulated) / measured
    further = more.pop("further", ())
    outcome = Outcome(response=simulated, key=f"key {d:g}")
    if simulated is None:
        outcome = Outcome(response=None, status="failed", reason="timeout")
    return ValidateRow(
        compared=ValidationRow(d, measured, simulated, error, role, **more), outcome=outcome, further=Rows(further)
    )


WAY = FurtherRow("travel", "mm", 1.0, 0.1, 0.6, 40.0, 5)
ROWS = (
    row(7.0, 80.0, 84.0, further=[WAY]),
    row(8.0, 100.0, 99.0, "fitted", sd=5.0, n=9, left_out_percent=-2.5),
    row(10.0, 160.0, None, sd=8.0),
)
RESULT = ValidateResult(
    head=Head(3, "validate", "known"),
    parameters={"a": 1.0},
    rows=Rows(ROWS),
    worst_percent=5.0,
    mean_abs_error_percent=3.0,
    worst_held_out_percent=5.0,
)
FORMULA = Formula(2.0, 7.125, 1.0)
NAMES = Wording()
SCALE = Vocabulary(None, (Variable("angle", "Angle of repose", "θ", "deg"), Variable("rise", "Rise", "h", "mm")))


# ---- tables and sentences


def test_the_table_of_the_validation() -> None:
    table, further = ValidateShowing().tables(RESULT, NAMES)
    assert table.title == "Measured and simulated maximum force"
    assert table.heads == ("Diameter, mm", "Role", "Measured, N", "Simulated, N", "Error, %", "Cross-val., %")
    assert table.cells == (
        ("7", "held out", "80", "84.00", "5.00 too high", "–"),
        ("8", "fitted", "100", "99.00", "1.00 too low", "2.50 too high"),
        ("10", "held out", "160", "failed (timeout)", "–", "–"),
    )
    assert table.foot == (
        "Largest absolute percentage error: 5.00 %; mean absolute percentage error: 3.00 %. Largest held-out error: "
        "5.00 %.",
        "Error in % = 100·(measured − simulated)/measured.",
    )
    assert further.title == "Responses other than the maximum force"
    assert further.heads == ("Response", "Diameter, mm", "Measured", "Simulated", "Unit", "Error, %")
    assert further.cells == (("travel", "7", "1", "0.6000", "mm", "40.00 too low"),)


def test_what_is_not_there_has_no_column_and_no_table() -> None:
    plain = replace(RESULT, rows=Rows([row(7.0, 80.0, 84.0)]), worst_held_out_percent=None)
    (table,) = ValidateShowing().tables(plain, NAMES)
    assert table.heads[-1] == "Error, %"
    assert table.foot[0] == "Largest absolute percentage error: 5.00 %; mean absolute percentage error: 3.00 %."
    with_formula = replace(RESULT, formula=FORMULA)
    assert (
        ValidateShowing()
        .tables(with_formula, NAMES)[0]
        .foot[0]
        .endswith(" Largest held-out error: 5.00 % (formula F = a·d^2: 7.12 %).")
    )


def test_a_study_of_its_own_responses_has_no_place() -> None:
    own = replace(RESULT, head=replace(RESULT.head, naming=SCALE), rows=Rows([row(0.0, 30.0, 33.0)]))
    table, *_ = ValidateShowing().tables(own, Wording(SCALE))
    assert table.heads == ("Role", "Measured, °", "Simulated, °", "Error, %")
    assert table.foot == ("Error in % = 100·(measured − simulated)/measured.",)


@pytest.mark.parametrize(
    ("result", "names", "text"),
    [
        (
            RESULT,
            NAMES,
            "The simulated maximum force differs from the measurements by at most 5.0 % (3.0 % on average over 3 "
            "values of the stem diameter).",
        ),
        (
            replace(RESULT, rows=Rows(ROWS[:1])),
            NAMES,
            "The simulated maximum force differs from the measurement by at most 5.0 %.",
        ),
        (
            replace(RESULT, rows=Rows(ROWS[:1])),
            Wording(SCALE),
            "The simulated responses differ from the measurements by at most 5.0 %.",
        ),
        (replace(RESULT, worst_percent=None), NAMES, "All validation runs failed."),
    ],
)
def test_the_outcome(result: ValidateResult, names: Wording, text: str) -> None:
    assert ValidateShowing().outcome(result, names) == [text]


def test_the_closing_table_has_one_footnote() -> None:
    setting: Any = SimpleNamespace(study=SimpleNamespace(naming=CUTTING))
    first, second = ValidateShowing().closing(RESULT, setting)
    assert len(first.foot) == 1 and second.title == "Responses other than the maximum force"


def test_files_and_runs() -> None:
    tables = RESULT.tables()
    assert list(tables) == ["validate", "validate_responses"]
    assert tables["validate"].rows[1] == (8.0, 100.0, 99.0, 1.0, "fitted", -2.5, "ok", "", 5.0, 9)
    assert tables["validate_responses"].rows == ((7.0, "travel", 1.0, 0.6, 40.0),)
    assert [label for label, _ in RESULT.runs()] == ["7 mm", "8 mm", "10 mm"]
    own = replace(RESULT, head=replace(RESULT.head, naming=SCALE))
    assert [label for label, _ in own.runs()] == ["validate 1", "validate 2", "validate 3"]
    assert list(replace(RESULT, rows=Rows(ROWS[1:])).tables()) == ["validate"]


# ---- the result


def test_what_was_fitted_held_out_and_predicted() -> None:
    assert RESULT.fitted == (8.0,)
    assert [one.condition for one in RESULT.held_out] == [7.0]  # the run at 10 mm failed
    assert RESULT.prediction == Prediction(5.0, None, (7.0,))
    assert replace(RESULT, worst_held_out_percent=None).prediction is None
    assert replace(RESULT, head=replace(RESULT.head, naming=SCALE)).prediction is None
    table = Note("from_table", "warning", "")
    assert replace(RESULT, notes=(table,)).prediction is None
    assert RESULT.judged(STUDY) == [
        Judged("force", 7.0, -5.0, False),
        Judged("force", 8.0, 1.0, True),
        Judged("force", 10.0, None, False),
    ]
    assert [one.key for one in RESULT.judged(STUDY)] == ["key 7", "key 8", ""]
    assert replace(RESULT, notes=(table,)).judged(STUDY) == []


STUDY: Any = SimpleNamespace(naming=CUTTING, fitted_responses=("response", "rise"))


def test_further_responses_that_the_spec_declares_are_judged() -> None:
    """Those that were fitted are no independent check, nor is any at a condition that was not fitted."""
    rise = FurtherRow("rise", "mm", 10.0, None, 11.0, -10.0, judged=True)
    turn = replace(rise, response="turn", error_percent=3.0)
    result = replace(RESULT, rows=Rows([row(8.0, 100.0, 98.0, "fitted", further=[WAY, rise, turn]),
                                        row(9.0, 100.0, 98.0, further=[rise])]))  # fmt: skip
    assert result.judged(STUDY) == [
        Judged("force", 8.0, 2.0, True),
        Judged("rise", 8.0, -10.0, True),
        Judged("turn", 8.0, 3.0, False),
        Judged("force", 9.0, 2.0, False),
        Judged("rise", 9.0, -10.0, False),
    ]
    assert [one.errors_percent for one in result.rows] == [[2.0, -10.0, 3.0], [2.0, -10.0]]
    assert row(9.0, 100.0, None, further=[rise]).errors_percent == [-10.0]


def test_the_comparison_of_a_further_mean() -> None:
    found = FurtherRow.of(Measured(8.0, "travel", 2.0, 0.2, 5, CUTTING), 1.5)
    assert found == FurtherRow("travel", "mm", 2.0, 0.2, 1.5, 25.0, 5, judged=False)
    assert FurtherRow.of(Measured(8.0, "response", 100.0, None, None, CUTTING), 110.0).judged


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Known:
    return known(
        tmp_path_factory.mktemp("known"), spec_of({7.0: 84.0, 8.0: 110.0, 10.0: 172.0}, more=", sd: 5 N, n: 4")
    )


def test_the_errors_of_all_rows_and_the_formula_through_the_fitted_forces(done: Known) -> None:
    """F = d² exactly at 8 and 10 mm; 7 mm measured 50 instead of 49, known to 5/√4/50 = 5 %."""
    rows = [
        row(7.0, 50.0, 49.5, sd=5.0, n=4),
        row(8.0, 64.0, 65.28, "fitted", sd=1.0, n=4),
        row(10.0, 100.0, 97.0, "fitted"),
        row(11.0, 121.0, None, sd=1.0, n=4),
    ]
    compared: Any = SimpleNamespace(
        rows=[one.compared for one in rows], worst_held_out_percent=1.0, error_slope_percent_per_unit=0.5,
        measured_exponent=Exponent(2.0, 1.9, 2.1), simulated_exponent=None,
    )  # fmt: skip
    found = _result(done.study, RESULT.head, {"a": 1.0}, compared, rows)
    assert found.worst_percent == pytest.approx(3.0) and found.mean_abs_error_percent == pytest.approx(2.0)
    assert found.formula is not None and found.formula.exponent == pytest.approx(2.0, abs=1e-3)
    assert found.formula.worst_held_out_percent == pytest.approx(2.0, abs=0.01)
    assert found.formula.standard_error_percent == pytest.approx(5.0)
    assert (found.tolerance_percent, found.error_slope_percent_per_unit) == (10.0, 0.5)
    nothing = _result(done.study, RESULT.head, {}, compared, [])
    assert nothing.worst_percent is nothing.mean_abs_error_percent is None


# ---- notes


def notes(result: ValidateResult) -> dict[str, str]:
    return {note.kind: note.text for note in validate_notes(result)}


def test_which_errors_are_no_independent_check() -> None:
    fitted = "The error{} is not an independent check because the parameters were fitted to {}."
    assert notes(RESULT)["fitted"] == fitted.format(" at a diameter of 8 mm", "the same measurement")
    both = replace(RESULT, rows=Rows([row(7.0, 80.0, 84.0, "fitted"), ROWS[1]]))
    assert notes(both)["fitted"] == fitted.format(" at diameters of 7 and 8 mm", "these measurements")
    own = replace(both, head=replace(both.head, naming=SCALE))
    assert notes(own)["fitted"] == fitted.format(" of a fitted response", "the same measurement")
    assert "fitted" not in notes(replace(RESULT, rows=Rows(ROWS[:1])))


def test_how_the_forces_grow() -> None:
    lab, model = Exponent(2.512, 2.3, 2.7), Exponent(1.987, 1.9, 2.1)
    grown = replace(RESULT, measured_exponent=lab, simulated_exponent=model)
    assert notes(grown)["growth"] == (
        "The measured force increases with diameter d as d^2.51, and the simulated force as d^1.99."
    )
    for one in (replace(grown, measured_exponent=None), replace(grown, simulated_exponent=None)):
        assert "growth" not in notes(one)


def travelled(*rows: tuple[float, float, float], judged: bool = False) -> ValidateResult:
    each = [replace(WAY, measured=m, simulated=s, error_percent=e, judged=judged) for m, s, e in rows]
    work = replace(WAY, response="work", error_percent=1.0)
    return replace(RESULT, rows=Rows(row(7.0 + i, 80.0, 80.0, further=[way, work]) for i, way in enumerate(each)))


def test_travel_that_means_something_else() -> None:
    """Reported if every error exceeds 25 %."""
    text = "The measured travel at maximum force is {} mm, and the simulated travel is {} mm. Measured travel also "
    one, two = notes(travelled((4.0, 0.7, 82.5))), notes(travelled((4.0, 0.7, 82.5), (5.5, 0.7, -25.1)))
    assert one["travel_differs"].startswith(text.format("4.00", "0.700"))
    assert two["travel_differs"].startswith(text.format("4.00 to 5.50", "0.700"))
    assert "travel_differs" not in notes(travelled((4.0, 0.7, 82.5), (4.0, 3.0, 25.0)))
    assert "travel_differs" not in notes(travelled((4.0, 0.7, 82.5), judged=True))
    assert "travel_differs" not in notes(replace(RESULT, rows=Rows(ROWS[1:])))


@pytest.mark.parametrize(
    ("table", "told"),
    [(None, False), ([], False), ([{"a": 1.0, "b": 2.0}], False), ([{"a": 1.0}], True), ([{}], True)],
)
def test_a_table_without_all_levels(table: Any, told: bool) -> None:
    solver: Any = SimpleNamespace(given_design=lambda stage: table if stage == "validate" else [{}])
    study: Any = SimpleNamespace(factors=("a", "b"), naming=CUTTING)
    found = list(_from_table(study, solver))
    assert [(note.kind, note.severity) for note in found] == [("from_table", "warning")] * told
    assert all(note.text.startswith("The simulated maximum force was read from a table, so ") for note in found)


# ---- figures


def lines_of(figure: Any) -> list[tuple[list[float], list[float]]]:
    return [(list(map(float, line.get_xdata())), list(map(float, line.get_ydata()))) for line in figure.axes[0].lines]


def test_the_figure_has_all_means_and_circles_the_fitted_ones() -> None:
    figure = draw_validation(RESULT, {8.0: 5.0, 10.0: 80.0})
    measured, simulated, *others = lines_of(figure)
    assert measured == ([7.0, 8.0, 10.0], [80.0, 100.0, 160.0]) and simulated == ([7.0, 8.0], [84.0, 99.0])
    assert ([8.0], [100.0]) in others and ([7.0], [80.0]) not in others
    axes = figure.axes[0]
    assert axes.get_xlabel() == "stem diameter, mm" and axes.get_ylabel() == "maximum force, N"
    assert axes.get_ylim()[0] == 0.0
    assert axes.get_ylim()[1] >= 1.03 * 240.0  # 160 + 80 N
    assert list(axes.get_xticks()) == [7.0, 8.0, 10.0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["7", "8", "10"]
    (bars,) = [c for c in axes.collections if hasattr(c, "get_segments")]
    assert [segment[:, 1].tolist() for segment in bars.get_segments()] == [[95.0, 105.0], [80.0, 240.0]]


def test_a_figure_without_bars_is_just_higher_than_its_means() -> None:
    result = replace(RESULT, rows=Rows([row(8.0, 100.0, 10.0)]))
    assert draw_validation(result).axes[0].get_ylim()[1] == pytest.approx(104.5, abs=1.6)
    many = replace(RESULT, rows=Rows(row(5.0 + i, 100.0, 99.0) for i in range(13)))
    assert len(draw_validation(many).axes[0].get_xticks()) < 13  # matplotlib's own
    twelve = replace(RESULT, rows=Rows(row(5.0 + i, 100.0, 99.0) for i in range(12)))
    assert len(draw_validation(twelve).axes[0].get_xticks()) == 12


def test_a_score_is_drawn_about_its_measured_mean() -> None:
    """Differences from the mean, without a floor at 0."""
    score = Variable("score", "Score", "s", "1", apart=True)
    naming = Vocabulary(CUTTING.condition, (*CUTTING.responses[:1], score))
    further = FurtherRow("score", "1", 40.0, None, 43.0, 1.0, judged=True)
    rows = Rows([row(7.0, 80.0, 84.0, further=[further]), row(8.0, 100.0, 99.0)])
    result = replace(RESULT, head=replace(RESULT.head, naming=naming), rows=rows)
    figure = draw_validation(result, {}, score)
    assert lines_of(figure)[:2] == [([7.0], [0.0]), ([7.0], [3.0])]
    assert figure.axes[0].get_ylim()[0] < 0.0


def test_captions(done: Known) -> None:
    (plot,) = validate_plots(done.study, done.of(ValidateResult))
    assert (plot.name, plot.section, plot.on_page) == ("validation", "validate", True)
    assert plot.caption == (
        "Measured and simulated maximum force; the circled values were used in the fit. Bars show the standard "
        "deviation of the measurements."
    )
    means = [t.model_copy(update={"sd": None, "n": None}) for t in done.study.targets.means]
    bare = done.study.model_copy(update={"targets": done.study.targets.model_copy(update={"means": tuple(means)})})
    nothing_fitted = replace(done.of(ValidateResult), rows=Rows(ROWS[:1]))
    assert validate_plots(bare, nothing_fitted)[0].caption == "Measured and simulated maximum force."


def test_many_responses() -> None:
    names = [f"r{n}" for n in range(MOST_RESPONSES + 1)]
    own = Vocabulary(None, tuple(Variable(name, name, name, "mm") for name in names))
    study: Any = SimpleNamespace(naming=own, targets=SimpleNamespace(means=()))
    further = [FurtherRow(name, "mm", 1.0, None, 1.0, 0.0, judged=True) for name in names[1:]]
    result = replace(RESULT, head=replace(RESULT.head, naming=own), rows=Rows([row(0.0, 1.0, 1.0, further=further)]))
    plots = validate_plots(study, result)
    assert [plot.name for plot in plots] == ["validation", *(f"validation-{name}" for name in names[1:])]
    assert [plot.on_page for plot in plots] == [True] * MOST_RESPONSES + [False]
    assert plots[0].caption == "Measured and simulated r0. Of 7 responses, the report shows the first 6."
    fewer = replace(result, rows=Rows([row(0.0, 1.0, 1.0, further=further[:-1])]))
    plots = validate_plots(study, fewer)
    assert len(plots) == 6 and plots[0].caption == "Measured and simulated r0."


# ---- reasons


def seen(study: Study, result: ValidateResult, *others: Any) -> Any:
    return evidence(study, (*others, result))


def test_reasons_of_a_validation(done: Known) -> None:
    far = replace(RESULT, rows=Rows([row(7.0, 80.0, 89.6), ROWS[1], row(10.0, 160.0, 144.0)]))
    (note,) = rules.validation(seen(done.study, far))
    assert (note.kind, note.severity) == ("validation", "warning")
    assert note.text == "The simulated maximum force is 12 % too high at a diameter of 7 mm."
    assert note.remedy is not None and note.remedy.edit == "invert: {diameters: all}"
    assert note.remedy.text.endswith("use the parameters only where simulation and measurement agree.")
    assert not list(rules.validation(seen(done.study, replace(far, rows=Rows([row(7.0, 80.0, 88.0), ROWS[1]])))))
    both = replace(far, rows=Rows([row(7.0, 80.0, 89.6), row(9.0, 100.0, 111.0)]))
    assert [note.severity for note in rules.validation(seen(done.study, both))] == ["error"]
    assert not list(rules.validation(evidence(done.study, [])))


def test_failed_runs_at_held_out_diameters(done: Known) -> None:
    (note,) = rules.validation(seen(done.study, RESULT))
    assert (note.kind, note.severity) == ("validation_failed", "warning")
    assert note.text == "The simulation of the maximum force at a diameter of 10 mm failed."
    assert note.remedy is not None and note.remedy.text == "Repeat the failed runs with `stemcal run SPEC --retry`."


def test_values_from_a_table_are_no_validation(done: Known) -> None:
    (note,) = rules.validation(seen(done.study, replace(RESULT, notes=(Note("from_table", "warning", ""),))))
    assert (note.kind, note.severity) == ("validation_from_table", "warning")
    assert note.remedy is not None and note.remedy.edit is None


@pytest.mark.parametrize(("worst", "checked"), [(None, False), (10.0, True), (10.1, False)])
def test_cross_validation_checks_a_study_without_held_out_values(
    done: Known, worst: float | None, checked: bool
) -> None:
    all_fitted = replace(RESULT, rows=Rows([ROWS[1]]), worst_held_out_percent=None)
    prediction = None if worst is None else Prediction(worst, None, in_turn="stem diameter")
    solved: Any = SimpleNamespace(name="invert", prediction=prediction, judged=lambda _: [], misses=())
    found = list(rules.validation(seen(done.study, all_fitted, solved)))
    assert [(note.kind, note.severity) for note in found] == [("unchecked", "warning")] * (not checked)
    assert all(note.remedy is not None and note.remedy.text.startswith("Measure at another") for note in found)


def test_conditions_that_the_spec_lists_are_not_advised_against(tmp_path: Any, done: Known) -> None:
    chosen = known(tmp_path, spec_of({7.0: 84.0, 8.0: 110.0, 10.0: 172.0}, "invert: {diameters: [8 mm, 10 mm]}\n"))
    far = replace(RESULT, rows=Rows([row(7.0, 80.0, 89.6), ROWS[1]]))
    (note,) = rules.validation(seen(chosen.study, far))
    assert note.remedy is not None and note.remedy.edit is None
    assert note.remedy.text.startswith(
        "Use the parameters only where simulation and measurement agree, or add a factor"
    )


def grown(power: float, *, fails: bool = False) -> ValidateResult:
    """Return measured over simulated forces that grow as the diameter to a power."""
    rows = [row(d, 100.0, 100.0 * (d / 8.0) ** -power) for d in (7.0, 8.0, 9.0, 10.0)]
    return replace(RESULT, rows=Rows([*rows, row(11.0, 100.0, None)] if fails else rows), worst_percent=11.8)


@pytest.mark.parametrize(("power", "how"), [(0.5, "more steeply"), (-0.5, "less steeply"), (0.0, None)])
def test_a_trend_with_the_diameter(done: Known, power: float, how: str | None) -> None:
    solved = done.of(InvertResult)
    sure = replace(solved, certainty=replace(solved.certainty, not_identified=()))
    for result in (grown(power), grown(power, fails=True)):
        found = list(rules.trend(evidence(done.study, (sure, result))))
        assert [note.text for note in found] == [
            f"The error depends on diameter d: the measured force increases {how} than the simulated force, by a "
            "factor of d^0.50. The largest error of the simulation is 11.8 %."
        ] * bool(how)
        assert all(note.remedy and note.remedy.edit == "invert: {diameters: all}" for note in found)
    free = replace(solved, certainty=replace(solved.certainty, not_identified=("yield_stress",)))
    table = replace(grown(0.5), notes=(Note("from_table", "warning", ""),))
    for results in ((free, grown(0.5)), (grown(0.5),), (sure,), (sure, table)):
        assert not list(rules.trend(evidence(done.study, results)))
