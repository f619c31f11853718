"""A response surface whose coefficients are known, in full: tables, sentences, figures, profiler.

At 8 mm F = 100 + 20a + 8b + 3b² + 2ab, with a and b ±1 at the ends of the ranges, which are ±√2 in the design: X1 has
20/√2, X2 8/√2, X1X2 1 and X2² 1.5. The design has Σx² = 8, so the sum of squares of X1 is 8·200 = 1600.
"""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from known_results import Known, known, spec_of
from planting import Law

from stemcal.doe.regression.anova import AnovaRow
from stemcal.drawing.table import Table
from stemcal.notes import Note, Remedy
from stemcal.runs.record import Outcome
from stemcal.stages.fitting import ConditionAxis, fitted_surfaces, measured_means
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results
from stemcal.stages.rsm import figures
from stemcal.stages.rsm.analysis import _notes, _pure_error_of
from stemcal.stages.rsm.figures import Solution, levels_of, rsm_plots
from stemcal.stages.rsm.over import notes_of
from stemcal.stages.rsm.profiler import profiler_data
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.rsm.showing import RsmShowing, _coded_condition, canonical_table, equation
from stemcal.storage.rows import Rows
from stemcal.vocabulary import CUTTING, FIRST, Variable, Vocabulary, Wording

LAW = Law(growth=0.3, crossed=2.0)
MEASURED = {d: LAW.at(0.2, 0.3, d)[0] for d in (7.0, 8.0, 10.0)}
SHOWING, NAMES = RsmShowing(), Wording()
ROOT = 2.0**0.5


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory) -> Known:
    extra = "invert: {diameters: all}\n"
    return known(tmp_path_factory.mktemp("joint"), spec_of(MEASURED, extra, ", sd: 3 N, n: 9"), LAW)


@pytest.fixture(scope="module")
def surface(joint: Known) -> RsmResult:
    result: RsmResult = joint.of(RsmResult)
    return result


def cells(table: Table) -> list[tuple[str, ...]]:
    return [tuple(cell.strip() for cell in row) for row in table.cells]


# ---- tables and sentences


def test_the_coefficients_and_the_equation(surface: RsmResult) -> None:
    _, table, *_ = SHOWING.tables(surface, NAMES)
    assert table.title == "Response surface in coded units" and table.detail
    assert table.heads == ("Term", "Coefficient, N", "Std. error, N", "95 % low, N", "95 % high, N")
    assert [row[:2] for row in cells(table)] == [
        ("1", "100.000"), ("X1", "14.142"), ("X2", "5.657"), ("X1·X2", "1.000"), ("X1²", "0.000"), ("X2²", "1.500"),
    ]  # fmt: skip
    assert table.foot[0].startswith("F = 100.00 + 14.14·X1 + 5.66·X2 + 1.00·X1·X2 ")
    assert table.foot[0].endswith(" 0.00·X1² + 1.50·X2²")
    assert table.foot[1] == "X1 = (yield_stress − 15) / 3.53553; X2 = (failure_strain − 0.03) / 0.0141421"


def test_an_equation_with_signs() -> None:
    def term(name: str, value: float) -> Any:
        return SimpleNamespace(term=name, value=value)

    rows = [term("1", -20.0), term("a", -3.25), term("b", 1.0), term("a:b", -0.004), term("b^2", 0.0)]
    assert equation(rows, {"a": "A"}) == "F = −20.00 − 3.25·A + 1.00·b − 0.00·A·b + 0.00·b²"
    angle = Variable("angle", "Angle", "θ", "deg")
    assert equation(rows[:2], {}, angle) == "θ = −20.00 − 3.25·a"


def test_the_analysis_of_variance(surface: RsmResult) -> None:
    table, *_ = SHOWING.tables(surface, NAMES)
    assert table.title == "Analysis of variance" and table.strong == frozenset()
    assert table.heads == ("Source", "Sum of squares", "df", "Mean square", "F", "p")
    assert [row[:3] for row in cells(table)][1:4] == [
        ("X1", "1600.00", "1"),
        ("X2", "256.00", "1"),
        ("X1·X2", "4.00", "1"),
    ]
    assert table.foot == (
        "** p < 0.01, * p < 0.05.",
        "Lack of fit cannot be tested without an estimate of pure error.",
    )
    row = AnovaRow("yield_stress", 12.5, 1, 12.5, 7.254, 0.0123, "*")
    other = replace(row, source="failure_strain", f=0.5, p=0.4567, stars="")
    tested = replace(surface, anova=Rows([other, row]), lack_of_fit_testable=True)
    table, *_ = SHOWING.tables(tested, NAMES)
    assert cells(table) == [
        ("X2", "12.50", "1", "12.50", "0.5000", "0.4567"), ("X1", "12.50", "1", "12.50", "7.25", "0.0123 *"),
    ]  # fmt: skip
    assert table.strong == {1} and len(table.foot) == 1


def test_the_goodness_of_fit(surface: RsmResult) -> None:
    fit = replace(
        surface, r2=0.98765, adjusted_r2=0.97654, predicted_r2=0.95432, adequate_precision=23.456, press=123.456789,
        cv_percent=1.234,
    )  # fmt: skip
    _, _, table, *_ = SHOWING.tables(fit, NAMES)
    assert table.title == "Goodness of fit" and table.heads == ("Statistic", "Value")
    assert cells(table) == [
        ("R²", "0.9877"),
        ("Adjusted R²", "0.9765"),
        ("Predicted R²", "0.9543"),
        ("Adequate precision", "23.46"),
        ("PRESS", "123.457"),
        ("Coefficient of variation, %", "1.23"),
    ]


def test_the_fits_at_all_diameters(surface: RsmResult) -> None:
    *_, table = SHOWING.tables(surface, NAMES)
    assert table.title == "Fit quality of all response surfaces"
    assert table.heads[:3] == ("Response", "Diameter, mm", "R²") and table.heads[-1] == "Coefficient of variation, %"
    assert [row[:2] for row in cells(table)] == [("force", "7"), ("force", "8"), ("force", "10")]
    assert all(row[2] == "1.0000" for row in cells(table))
    alone = replace(surface, conditions=Rows([]))
    assert "Fit quality of all response surfaces" not in [table.title for table in SHOWING.tables(alone, NAMES)]


def test_the_canonical_axes(surface: RsmResult) -> None:
    shape = surface.canonical
    assert shape is not None
    table = canonical_table(surface, shape, NAMES)
    assert table.title == "Canonical analysis"
    assert table.heads == ("Axis", "Curvature, N", "yield_stress", "failure_strain")
    # the eigenvalues of [[0, 0.5], [0.5, 1.5]]: 0.75 ± √(0.75² + 0.25)
    big, small = (0.75 + sign * math.hypot(0.75, 0.5) for sign in (1, -1))
    assert [row[:2] for row in cells(table)] == [("1", f"{big:.3f}"), ("2", f"−{abs(small):.4f}")]
    assert table.foot[0].startswith("The stationary point is a ") and table.foot[0].endswith(
        f" outside the experimental region, at a coded distance of {shape.coded_radius:.2f} from the design centre."
    )
    assert table.foot[1].startswith("Along an axis of negative curvature, the maximum force decreases in both")
    inside = replace(shape, inside=True, coded_radius=0.5, predicted=98.76, natural={
        "yield_stress": 16.77, "failure_strain": 0.02293})  # fmt: skip
    assert (
        canonical_table(surface, inside, NAMES)
        .foot[0]
        .endswith(
            " inside the experimental region, at a coded distance of 0.50 from the design centre. The "
            "predicted maximum force there is 98.76 N (yield_stress 16.77 MPa, failure_strain 0.02293)."
        )
    )
    none = replace(shape, natural=None, predicted=None)
    assert (
        canonical_table(surface, none, NAMES).foot[0].startswith("The response surface has no unique stationary point")
    )


@pytest.mark.parametrize(
    ("extra", "deterministic", "text"),
    [
        (0, True, ""),
        (1, True, " 1 replicate run of the deterministic solver adds no information."),
        (2, True, " 2 replicate runs of the deterministic solver add no information."),
        (2, False, ""),
    ],
)
def test_the_outcome(surface: RsmResult, extra: int, deterministic: bool, text: str) -> None:
    runs = list(surface.design.runs)
    failed = replace(runs[0], outcome=Outcome(response=None, status="failed"))
    design = replace(surface.design, runs=Rows([*runs, *runs[:extra], failed]))
    low, high = (f"{end([run.response for run in runs]):.4g}" for end in (min, max))
    result = replace(surface, design=design, deterministic=deterministic)
    assert SHOWING.outcome(result, NAMES) == [
        "A quadratic response surface in yield_stress and failure_strain was fitted to 9 runs with responses from "
        f"{low} N to {high} N.{text}"
    ]


# ---- the result


def test_what_a_surface_answers(surface: RsmResult) -> None:
    at = {"yield_stress": 17.5, "failure_strain": 0.02}  # a = 0.5, b = −0.5
    assert surface.predict(at).response == pytest.approx(100.0 + 10.0 - 4.0 + 0.75 - 0.5)
    assert surface.response_at({"yield_stress": np.array([0.0, ROOT]), "failure_strain": 0.0}) == pytest.approx(
        [100, 120]
    )
    assert [surface.sign_of(name) for name in ("yield_stress", "failure_strain", "density")] == ["+", "+", None]
    rows = [replace(row, low=-row.value, high=3 * row.value) if row.term == "yield_stress" else row
            for row in surface.coefficients]  # fmt: skip
    assert replace(surface, coefficients=Rows(rows)).sign_of("yield_stress") is None
    falling = [replace(row, value=-row.value, low=-row.high, high=-row.low) for row in surface.coefficients]  # type: ignore[operator]
    assert replace(surface, coefficients=Rows(falling)).sign_of("yield_stress") == "-"
    unknown = [replace(row, low=None) for row in surface.coefficients]
    assert replace(surface, coefficients=Rows(unknown)).sign_of("yield_stress") is None
    assert surface.symbols() == {"yield_stress": "X1", "failure_strain": "X2"}


def test_the_ends_of_an_axis_include_the_runs(surface: RsmResult) -> None:
    assert surface.drawn_between("yield_stress") == (pytest.approx(-ROOT), pytest.approx(ROOT))
    wide = replace(surface, radius=3.0)  # no further than the range of the factor
    assert wide.drawn_between("yield_stress") == (pytest.approx(-ROOT), pytest.approx(ROOT))
    runs = [replace(run, levels={**run.levels, "yield_stress": 22.0}) if run.run == 1 else run
            for run in surface.design.runs]  # fmt: skip
    further = replace(surface, design=replace(surface.design, runs=Rows(runs)))
    assert further.drawn_between("yield_stress") == (pytest.approx(-ROOT), pytest.approx(7.0 / 5.0 * ROOT))
    near = replace(surface, radius=1.0)
    assert near.drawn_between("failure_strain") == (pytest.approx(-ROOT), pytest.approx(ROOT))  # of the axial runs
    assert replace(surface, radius=0.0).drawn_between("failure_strain")[1] == pytest.approx(ROOT)


def test_files_and_runs(surface: RsmResult) -> None:
    tables = surface.tables()
    assert list(tables) == ["rsm", "rsm_runs"]
    first, model, stress = tables["rsm"].rows[:3]
    heads = tables["rsm"].heads
    assert first[heads.index("source")] == "1" and first[heads.index("value")] == pytest.approx(100.0)
    assert model[heads.index("source")] == "Model" and model[heads.index("value")] is None
    assert stress[heads.index("sum_of_squares")] == pytest.approx(1600.0)
    assert stress[heads.index("value")] == pytest.approx(20.0 / ROOT)
    labels = [label for label, _ in surface.runs()]
    assert labels[0] == "rsm 1 at a diameter of 7 mm" and labels[-1] == "rsm 9" and len(labels) == 4 * 9


# ---- notes of the analysis


def test_the_notes_on_terms_and_scatter(surface: RsmResult) -> None:
    steps: Any = (SimpleNamespace(term="a^2"), SimpleNamespace(term="a:b"))
    unreduced, empty, two = ([note.text for note in _notes(replace(surface, reduction=n))] for n in (None, (), steps))
    assert unreduced == [] and empty == ["Backward elimination removed no terms."]
    assert two == [
        "Backward elimination removed a^2 and a:b. The p-values and intervals are slightly optimistic because the same "
        "runs were used to select the terms."
    ]
    scatter, equal = Note("scatter", "caution", "s"), Note("equal_repeats", "caution", "e")
    assert list(_notes(replace(surface, pure_error=scatter))) == [scatter]
    assert list(_notes(replace(surface, pure_error=equal))) == []
    advised = replace(equal, remedy=Remedy("r"))
    assert list(_notes(replace(surface, pure_error=advised))) == [advised]


def repeats(*forces: float | None) -> Any:
    """Return runs at one point, and a run at another point."""
    runs = [SimpleNamespace(response=force, coded={"a": 0.0}) for force in forces]
    return SimpleNamespace(runs=[*runs, SimpleNamespace(response=55.0, coded={"a": 1.0})])


@pytest.mark.parametrize(
    ("forces", "replicated", "kind", "text", "remedy"),
    [
        ((100.0,), True, None, "", None),
        ((100.0, None), True, None, "", None),
        ((100.0, 100.0), False, "equal_repeats", "The replicate runs agree exactly, so the pure error is zero.", None),
        (
            (100.0, 100.0 + 9e-8),
            True,
            "equal_repeats",
            "The replicate runs agree exactly, so the pure error is zero.",
            "Remove `replicates`, or pass {{seed}} to the program.",
        ),
        (
            (99.0, 100.0, 101.0),
            True,
            "scatter",
            "The standard deviation of the replicate runs is 1 N (2 degrees of freedom).",
            None,
        ),
        (
            (99.0, None, 101.0),
            False,
            "scatter",
            "The standard deviation of the replicate runs is 1.41 N (1 degree of freedom).",
            None,
        ),
    ],
)
def test_the_scatter_of_repeated_runs(
    forces: tuple[float | None, ...], replicated: bool, kind: str | None, text: str, remedy: str | None
) -> None:
    found = _pure_error_of(repeats(*forces), NAMES, replicated)
    if kind is None:
        assert found is None
    else:
        assert found is not None and (found.kind, found.severity, found.text) == (kind, "caution", text)
        assert (found.remedy and found.remedy.text) == remedy


@pytest.mark.parametrize(
    ("errors", "logarithms", "text"),
    [
        ((1.234, 0.567), (FIRST,), "a quadratic of the logarithm of the maximum force"),
        ((0.567, 1.234), (), "a quadratic of maximum force"),
        ((None, 1.0), (), None),
        ((1.0, None), (), None),
    ],
)
def test_the_scale_of_the_response(
    errors: tuple[float | None, float | None], logarithms: tuple[str, ...], text: str | None
) -> None:
    axis = ConditionAxis("diameter", 2.0, 0.1, True, 8.0, {}, logarithms, {FIRST: errors})
    found = [note.text for note in notes_of(axis, NAMES)]
    assert found == ([] if text is None else [
        f"The response surface is {text}: when each run in turn is left out, its error is {errors[0]:.2g} % for the "
        f"maximum force and {errors[1]:.2g} % for its logarithm (root mean square)."
    ])  # fmt: skip


# ---- the profiler


def test_the_data_of_the_profiler(joint: Known, surface: RsmResult) -> None:
    levels = joint.of(InvertResult).parameters
    data = profiler_data(joint.study, surface, levels, True)
    stress, strain = data["factors"]
    assert stress == {
        "name": "yield_stress",
        "label": stress["label"],
        "unit": " MPa",
        "center": pytest.approx(15.0),
        "half": pytest.approx(5.0 / ROOT),
        "low": 10.0,
        "high": 20.0,
        "ends": [pytest.approx(10.0), pytest.approx(20.0)],
        "at": levels["yield_stress"],
    }
    assert strain["unit"] == "" and strain["at"] == levels["failure_strain"]
    assert {key: data[key] for key in ("called", "holds", "kept", "against", "first", "more")} == {
        "called": "Calibrated",
        "holds": True,
        "kept": [],
        "against": ["Measured", "too low", "too high"],
        "first": 1,
        "more": 0,
    }
    assert not profiler_data(joint.study, surface, levels, False)["holds"]
    assert data["radius"] == pytest.approx(ROOT)
    seven, eight, _ = data["surfaces"]
    assert (seven["label"], seven["unit"]) == ("Maximum force at a diameter of 7 mm", " N")
    assert eight["beta"] == pytest.approx([100.0, 20.0 / ROOT, 8.0 / ROOT, 1.0, 0.0, 1.5], abs=1e-6)
    assert (seven["measured"], seven["sd"]) == (pytest.approx(MEASURED[7.0]), 3.0)
    assert seven["error"] == pytest.approx(2.306, abs=1e-3)  # t(0.975; 8)·3/√9
    assert seven["simulate"] == "stemcal simulate SPEC --diameter 7"
    assert seven["t"] == pytest.approx(3.1824, abs=1e-4) and len(seven["covariance"]) == 6  # 9 runs, 6 terms
    assert seven["runs"][0][:2] == [-1.0, -1.0] and len(seven["runs"]) == 9
    assert profiler_data(joint.study, surface, {}, True)["called"] == "Centre"


@pytest.mark.parametrize(
    ("sd", "n", "error"), [(3.0, None, 5.88), (3.0, 1, 5.88), (3.0, 2, 12.706 * 3.0 / 2**0.5), (None, 9, 0.0)]
)
def test_the_error_of_the_measured_mean(
    joint: Known, surface: RsmResult, sd: float | None, n: int | None, error: float
) -> None:
    means = tuple(t.model_copy(update={"sd": sd, "n": n}) for t in joint.study.targets.means)
    study = joint.study.model_copy(update={"targets": joint.study.targets.model_copy(update={"means": means})})
    found = profiler_data(study, surface, {}, True)["surfaces"][0]
    assert (found["error"], found["sd"]) == (pytest.approx(error, rel=1e-4), sd or 0.0)


def test_a_surface_through_all_runs_has_no_interval(joint: Known, surface: RsmResult) -> None:
    six = [run for run in surface.design.runs if run.run in (1, 2, 3, 5, 7, 9)]
    small = replace(surface, design=replace(surface.design, runs=Rows(six)), conditions=Rows([]))
    study: Any = SimpleNamespace(
        joint_targets=(), calibration_target=joint.study.calibration_target, fitted_responses=(FIRST,), naming=CUTTING,
        goal=None, kind=SimpleNamespace(simulates_stems=False),
    )  # fmt: skip
    found = profiler_data(study, small, {}, True)["surfaces"][0]
    assert found["simulate"] == "" and found["error"] > 0.0
    assert found["covariance"] is found["own"] is found["t"] is None


# ---- figures


def solution(joint: Known, *further: Any) -> Solution:
    return Solution(joint.of(InvertResult).parameters, MEASURED[8.0], further)


def test_captions(joint: Known, surface: RsmResult) -> None:
    plots = rsm_plots(surface, None, {})
    assert [plot.name for plot in plots] == [
        "observed-predicted",
        "diagnostics",
        "contour-yield_stress-failure_strain",
        "surface-yield_stress-failure_strain",
    ]
    over = "as a function of yield_stress and failure_strain"
    assert plots[2].caption == f"Contours of the maximum force (N) {over}. The white dots are design points."
    assert plots[3].caption == (
        f"Response surface of the maximum force {over}. The contours are projected onto the base of the plot."
    )
    marked = rsm_plots(surface, solution(joint), {"yield_stress": "Stress"})[2].caption
    assert "as a function of stress and failure_strain" in marked
    assert " The orange line marks the measured maximum force; the star marks the calibrated point. " in marked
    assert " Each orange line marks a measured mean on its own response surface" in (
        rsm_plots(surface, solution(joint, ("mean", "fit")), {})[2].caption
    )
    no_runs = replace(surface, runs_diagnostics=Rows([]))
    assert "diagnostics" not in [plot.name for plot in rsm_plots(no_runs, None, {})]


@pytest.mark.parametrize(
    ("names", "solved", "text"),
    [
        (("a", "b", "c"), False, ", with the remaining factor fixed at its centre value"),
        (("a", "b", "c"), True, ", with the remaining factor fixed at its calibrated value"),
        (("a", "b", "c", "d"), True, ", with the remaining factors fixed at their calibrated values"),
        (("a", "b", "c", "d"), False, ", with the remaining factors fixed at their centre values"),
    ],
)
def test_what_is_held_in_a_figure_of_two_factors(names: tuple[str, ...], solved: bool, text: str) -> None:
    rsm: Any = SimpleNamespace(names=names, naming=CUTTING, runs_diagnostics=())
    plots = rsm_plots(rsm, Solution({}, 1.0) if solved else None, {})
    assert len(plots) == 1 + 2 * len(names) * (len(names) - 1) // 2
    assert f"of a and b{text}." in plots[1].caption
    score = Vocabulary(None, (Variable("angle", "Angle of repose", "θ", "1"),))
    rsm.naming = score
    assert "Contours of the angle of repose as a function" in rsm_plots(rsm, None, {})[1].caption


def test_observed_over_predicted(surface: RsmResult) -> None:
    axes = figures.observed_predicted(surface).axes[0]
    line, dots = axes.lines
    forces = [run.response for run in surface.design.runs]
    assert dots.get_ydata() == pytest.approx(forces) and dots.get_xdata() == pytest.approx(forces, abs=1e-6)
    assert line.get_xdata() == pytest.approx([min(forces), max(forces)], abs=1e-6)
    assert axes.get_xlabel() == "predicted by the surface, N"
    assert axes.get_ylabel() == "simulated, N"


def test_the_diagnostics(surface: RsmResult) -> None:
    """Normal scores of (i − ½)/n; a run without a studentised residual counts as 0."""
    rows = [
        replace(row, studentised=value, cooks_distance=None if value is None else 0.1 * i)
        for i, (row, value) in enumerate(zip(surface.runs_diagnostics, [2.0, -1.0, None, 0.5] + [0.1] * 5, strict=True))
    ]
    normal, over, influence = figures.diagnostics(replace(surface, runs_diagnostics=Rows(rows))).axes
    line, dots = normal.lines
    assert dots.get_ydata().tolist() == sorted([2.0, -1.0, 0.0, 0.5, *[0.1] * 5])
    assert dots.get_xdata()[4] == pytest.approx(0.0, abs=1e-12) and dots.get_xdata()[0] == pytest.approx(
        -1.5932, abs=1e-3
    )
    assert line.get_xdata() == pytest.approx(line.get_ydata()) and line.get_xdata()[1] == pytest.approx(
        1.5932, abs=1e-3
    )
    assert over.lines[1].get_ydata()[:3].tolist() == [2.0, -1.0, 0.0]
    assert over.lines[0].get_ydata()[0] == 0.0 and influence.lines[0].get_ydata()[0] == 1.0
    bars = influence.patches
    assert [bar.get_height() for bar in bars] == pytest.approx([0.1 * i if i != 2 else 0.0 for i in range(9)])
    assert [bar.get_x() + 0.5 * bar.get_width() for bar in bars] == pytest.approx(list(range(1, 10)))
    assert (normal.get_xlabel(), influence.get_xlabel(), influence.get_ylabel()) == (
        "normal score", "run", "Cook's distance",
    )  # fmt: skip


def test_contour_levels_are_round() -> None:
    assert levels_of(np.array([80.0, 122.0])).tolist() == [80.0 + 5.0 * i for i in range(10)]
    assert levels_of(np.array([0.0, 1.0])).tolist() == pytest.approx([0.1 * i for i in range(11)])


def test_the_contours(joint: Known, surface: RsmResult) -> None:
    pair = ("yield_stress", "failure_strain")
    figure = figures.contours(surface, pair, solution(joint), {"yield_stress": "Stress"})
    axes, bar = figure.axes
    dots, star = axes.lines[0], axes.lines[-1]
    assert sorted(zip(dots.get_xdata(), dots.get_ydata(), strict=True))[0] == (pytest.approx(10.0), pytest.approx(0.03))
    assert len(dots.get_xdata()) == 9
    levels = joint.of(InvertResult).parameters
    assert (star.get_xdata()[0], star.get_ydata()[0]) == (levels["yield_stress"], levels["failure_strain"])
    assert axes.get_xlabel() == "Stress, MPa" and axes.get_ylabel() == "failure_strain"
    assert bar.get_ylabel() == "force, N"
    assert list(bar.get_yticks())[:3] == [70.0, 90.0, 110.0]  # every second level
    x, y, z = figures._section_of(surface, pair, None)
    assert x.shape == y.shape == z.shape == (41, 41)
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((10.0, 20.0, 0.01, 0.05))
    a, b = (x - 15.0) / 5.0, (y - 0.03) / 0.02
    assert z == pytest.approx(100.0 + 20.0 * a + 8.0 * b + 3.0 * b * b + 2.0 * a * b)


def test_repeated_points_are_counted_and_targets_drawn(joint: Known, surface: RsmResult) -> None:
    pair = ("yield_stress", "failure_strain")
    runs = Rows([*surface.design.runs, *list(surface.design.runs)[-1:] * 2])
    repeated = replace(surface, design=replace(surface.design, runs=runs))
    axes = figures.contours(repeated, pair, None).axes[0]
    assert [text.get_text() for text in axes.texts if text.get_text() == "3"] == ["3"]
    plain = figures.contours(surface, pair, None).axes[0]
    assert "3" not in [text.get_text() for text in plain.texts] and len(plain.lines) == 1
    inside, outside = solution(joint), replace(solution(joint), target=500.0)
    count = [len(figures.contours(surface, pair, each).axes[0].collections) for each in (inside, outside)]
    assert count[0] == count[1] + 1


def test_a_joint_fit_has_a_line_for_each_mean(joint: Known, surface: RsmResult) -> None:
    each = list(zip(measured_means(joint.study), fitted_surfaces(joint.study, surface), strict=True))
    further = (each[0], each[2])
    figure = figures.contours(surface, ("yield_stress", "failure_strain"), solution(joint, *further))
    axes = figure.axes[0]
    labels = [line.get_label() for line in axes.lines if not line.get_label().startswith("_")]
    assert labels == ["runs", "7 mm", "10 mm"]
    styles = [line.get_linestyle() for line in axes.lines if line.get_label() in ("7 mm", "10 mm")]
    assert styles == ["--", ":"]


def test_the_relief(joint: Known, surface: RsmResult) -> None:
    """The base lies 0.35 of the height below the lowest level."""
    figure = figures.relief(surface, ("yield_stress", "failure_strain"), solution(joint), {"yield_stress": "Stress"})
    (axes,) = figure.axes
    levels = levels_of(figures._section_of(surface, ("yield_stress", "failure_strain"), solution(joint))[2])
    base = levels[0] - 0.35 * (levels[-1] - levels[0])
    assert axes.get_zlim() == (pytest.approx(base), pytest.approx(levels[-1]))
    assert list(axes.get_zticks()) == pytest.approx(levels[::2].tolist())
    assert (axes.get_zlabel(), axes.get_xlabel()) == ("force, N", "Stress, MPa")
    assert {axis.label.get_size() for axis in (axes.xaxis, axes.yaxis, axes.zaxis)} == {8.0}
    (star,) = axes.lines
    at = joint.of(InvertResult).parameters
    assert [float(each[0]) for each in star.get_data_3d()] == pytest.approx(
        [at["yield_stress"], at["failure_strain"], MEASURED[8.0]], rel=1e-4
    )
    assert (axes.elev, axes.azim) == (24, -128)


def test_the_figures_of_a_study_mark_its_first_levels(joint: Known, surface: RsmResult) -> None:
    setting: Any = SimpleNamespace(study=joint.study, results=joint.results, labels={})
    assert " Each orange line marks a measured mean " in SHOWING.figures(surface, setting)[2].caption
    setting.results = Results((surface,))
    assert "orange" not in SHOWING.figures(surface, setting)[2].caption


# ---- one surface over factors and diameter


@pytest.fixture(scope="module")
def over(tmp_path_factory: pytest.TempPathFactory) -> Known:
    """The same law in 15 runs over a, b and the diameter; its logarithm is fitted."""
    spec = spec_of(MEASURED, "invert: {diameters: all}\n", ", sd: 3 N, n: 9")
    spec = spec.replace("centre_points: 1", "over: conditions, centre_points: 1")
    return known(tmp_path_factory.mktemp("over"), spec, LAW)


def test_the_surface_over_the_diameter_in_words(over: Known) -> None:
    """The centre is ln d = 2.124, where ln F = ln 100 + 2·(2.124 − ln 8) = 4.695; the slope is 2·0.106."""
    surface: RsmResult = over.of(RsmResult)
    assert SHOWING.outcome(surface, NAMES)[0].startswith(
        "A quadratic response surface of the logarithm of the maximum force in yield_stress, failure_strain and "
        "diameter was fitted to 15 runs"
    )
    tables = {table.title: table for table in SHOWING.tables(surface, NAMES)}
    coefficients = tables["Response surface in coded units"]
    assert coefficients.heads[:2] == ("Term", "Coefficient")
    assert [row[:2] for row in cells(coefficients) if row[0] in ("1", "D")] == [("1", "4.695"), ("D", "0.212")]
    assert coefficients.foot[0].startswith("ln F = 4.695 + ")
    assert coefficients.foot[1].endswith("; D = (ln diameter − 2.12425) / 0.10604")
    assert "Canonical analysis" not in tables
    assert "Fit quality of all response surfaces" not in tables
    assert surface.symbols() == {"yield_stress": "X1", "failure_strain": "X2", "diameter": "D"}
    assert [label for label, _ in surface.runs()] == [f"rsm {n}" for n in range(1, 16)]
    at = surface.response_at({"yield_stress": 0.0, "failure_strain": 0.0})
    assert float(at) == pytest.approx(100.0, rel=1e-3)


def test_the_growth_of_a_parameter_in_words(over: Known) -> None:
    surface: RsmResult = over.of(RsmResult)
    assert surface.over is not None
    grown = replace(surface, over=replace(surface.over, growing={"yield_stress": ("failure_strain", 8.0)}))
    assert list(_coded_condition(grown, NAMES)) == [
        "D = (ln diameter − 2.12425) / 0.10604",
        "yield_stress is multiplied by (diameter / 8 mm)^(failure_strain − 0.03)",
    ]
    linear = replace(surface, over=replace(surface.over, logarithmic=False, center=9.0, half_step=1.5))
    assert list(_coded_condition(linear, NAMES)) == ["D = (diameter − 9) / 1.5"]


def test_the_profiler_of_a_surface_over_the_diameter(over: Known) -> None:
    data = profiler_data(over.study, over.of(RsmResult), {}, True)
    seven, eight, _ = data["surfaces"]
    assert eight["label"] == "Maximum force at a diameter of 8 mm" and eight["runs"] == []
    axis = over.of(RsmResult).over
    assert seven["place"] == {
        "factors": [0, 1], "start": [0.0, 0.0], "rate": [0.0, 0.0], "exponents": [0, 1],
        "condition": pytest.approx(axis.coded(7.0)), "logarithm": True,
    }  # fmt: skip
    assert len(seven["beta"]) == 10 and seven["beta"][0] == pytest.approx(4.695, abs=1e-3)
    assert seven["t"] == pytest.approx(2.5706, abs=1e-4)  # 15 runs, 10 terms


def test_the_runs_at_all_diameters_over_their_predictions(over: Known) -> None:
    surface: RsmResult = over.of(RsmResult)
    dots = figures.observed_predicted(surface).axes[0].lines[1]
    assert dots.get_ydata() == pytest.approx([math.log(run.response or 0.0) for run in surface.design.runs])
    assert dots.get_xdata() == pytest.approx(dots.get_ydata(), abs=0.01)
