"""A screening whose effects are known, in full: 2³ runs of y = 100 + 10a + 2b + ab.

The effects are 20, 4 and 0. The sum of squares of the residual is 8·1² with 4 degrees of freedom, so F is 800/2 = 400
and 32/2 = 16. Lenth's PSE is 1.5·2 = 3, since 4 and 0 are below 2.5·1.5·4, and t(0.975; 1) is 12.706.
"""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fakes import SpecSolver, make_study

from stemcal.errors import RunsFailed, UsageError
from stemcal.runs.record import Outcome
from stemcal.stages.design import given_design
from stemcal.stages.result import DesignRun, DesignRuns, Head
from stemcal.stages.screen.analysis import analyse_screening, foresee, screening_design
from stemcal.stages.screen.result import Screening, ScreenResult
from stemcal.stages.screen.showing import ScreenShowing, pareto
from stemcal.storage.rows import Rows
from stemcal.vocabulary import CUTTING, Wording

CORNERS = np.array(list(product([-1.0, 1.0], repeat=3)))
A, B, _ = CORNERS.T
Y = 100.0 + 10.0 * A + 2.0 * B + A * B
NAMES, SYMBOLS = ("a", "b", "c"), ("X1", "X2", "X3")


def screened(y: Any = Y, coded: Any = CORNERS, names: tuple[str, ...] = NAMES, alpha: float = 0.05) -> Screening:
    return analyse_screening(coded, y, names, SYMBOLS[: len(names)], alpha)


def result_of(found: Screening, coded: Any = CORNERS, y: Any = Y, **more: Any) -> ScreenResult:
    runs = [
        DesignRun(
            run=n, levels=dict(zip(NAMES, row, strict=False)), coded=dict(zip(NAMES, row, strict=False)),
            outcome=Outcome(response=value),
        )
        for n, (row, value) in enumerate(zip(coded.tolist(), y.tolist(), strict=True), 1)
    ]  # fmt: skip
    return ScreenResult(head=Head(3, "screen", "known"), design=DesignRuns("full", Rows(runs)), **vars(found), **more)


WHOLE = result_of(screened())


def notes(found: Screening) -> dict[str, str]:
    return {note.kind: note.text for note in found.notes}


# ---- numbers


def test_effects_and_their_tests() -> None:
    found = screened()
    assert found.significant == ("a", "b") and found.runs_used == 8 and found.runs_failed == 0
    assert [effect.effect for effect in found.effects] == pytest.approx([20.0, 4.0, 0.0])
    assert [effect.f for effect in found.effects] == pytest.approx([400.0, 16.0, 0.0], abs=1e-9)
    assert (found.residual.sum_of_squares, found.residual.df) == (pytest.approx(8.0), 4)
    assert found.total_sum_of_squares == pytest.approx(840.0) and found.curvature is None
    assert screened(alpha=0.01).significant == ("a",)  # p of F(1, 4) = 16 is 0.0161


def test_the_table() -> None:
    (table,) = ScreenShowing().tables(WHOLE, Wording())
    assert table.title == "Effects on the maximum force" and table.strong == {0, 1}
    assert table.heads == ("", "Factor", "Effect, N", "Share, %", "Sum of squares", "F", "p", "Lenth t")
    assert [tuple(cell.strip() for cell in row) for row in table.cells] == [
        ("X1", "a", "20.00", "95.24", "800.00", "400.00", "<0.0001 **", "6.67"),
        ("X2", "b", "4.00", "3.81", "32.00", "16.00", "0.0161 *", "1.33"),
        ("X3", "c", "0.00", "0.000", "0.00", "0.0000", "1.0000", "0.00"),
        ("", "Residual", "", "0.95", "8.00", "", "", ""),
    ]
    assert table.foot == (
        "The effects of the factors in bold are significant by the F test.",
        "Lenth's method yields a pseudo standard error of 3 N, a margin of error of 38.12 N and a simultaneous "
        f"margin of error of {WHOLE.lenth.sme:.4g} N.",
        "** p < 0.01, * p < 0.05. The share of a factor is its percentage of the total sum of squares.",
    )


def test_the_table_by_lenth_has_another_rule() -> None:
    """Four runs of three factors leave no residual."""
    half = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    y = 100.0 + 10.0 * half[:, 0] + 0.1 * half[:, 1]
    found = result_of(screened(y, half), half, y)
    assert found.by_lenth and found.limit == found.lenth.me
    (table,) = ScreenShowing().tables(found, Wording())
    assert table.foot[0] == "The effects of the factors in bold are significant by Lenth's method."
    assert table.cells[0][4:7] == ("400.00", "", "") and table.cells[-1][3] in ("0.000", "0.00")


def test_the_limit_of_significance() -> None:
    """The standard error of an effect is √(4·2/8) = 1, t(0.975; 4) = 2.776."""
    assert not WHOLE.by_lenth and WHOLE.limit == pytest.approx(2.7764, abs=1e-4)
    assert replace(WHOLE, alpha=0.01).limit == pytest.approx(4.6041, abs=1e-4)
    without_f = [replace(effect, f=None) for effect in WHOLE.effects]
    two = replace(WHOLE, effects=Rows(without_f), lenth=replace(WHOLE.lenth, me=None))
    assert two.limit is None and not two.by_lenth


# ---- sentences


COUNT = "In the screening, 3 factors were varied in 8 runs."


@pytest.mark.parametrize(
    ("result", "text"),
    [
        (
            WHOLE,
            "For the maximum force, the significant factors are a (95.2 % of the variation) and b (3.8 % of the "
            "variation).",
        ),
        (
            replace(WHOLE, significant=("b",)),
            "For the maximum force, the significant factor is b (3.8 % of the variation).",
        ),
        (replace(WHOLE, significant=()), "No factor has a significant effect on the maximum force."),
        (
            replace(
                WHOLE,
                significant=(),
                lenth=replace(WHOLE.lenth, me=None),
                effects=Rows([replace(effect, p=None) for effect in WHOLE.effects]),
            ),
            "The effects on the maximum force cannot be tested without an estimate of the error.",
        ),
        (
            replace(WHOLE, significant=(), lenth=replace(WHOLE.lenth, me=None)),
            "No factor has a significant effect on the maximum force.",
        ),
    ],
)
def test_the_outcome(result: ScreenResult, text: str) -> None:
    assert ScreenShowing().outcome(result, Wording()) == [COUNT, text]


def test_the_strongest_factor_is_named_first() -> None:
    (_, text) = ScreenShowing().outcome(replace(WHOLE, significant=("b", "a")), Wording(CUTTING, {"a": "Stress"}))
    assert text.index("stress (95.2 %") < text.index("b (3.8 %")


def test_centre_runs_show_a_curvature() -> None:
    """Centre runs of 102, 103 and 104 N: SS 9/(1/3 + 1/8) = 19.64; residual 8 + 2 with 6 df, F = 19.64/1.667."""
    coded, y = np.vstack([CORNERS, np.zeros((3, 3))]), np.array([*Y, 102.0, 103.0, 104.0])
    found = screened(y, coded)
    assert found.runs_used == 11 and found.residual.df == 6 and found.curvature is not None
    assert found.curvature.f == pytest.approx(11.78, abs=0.01) and found.curvature.curved
    means = "At the centre, the main effects predict a maximum force of 100 N, and the observed mean is {} N ({})."
    assert notes(found)["curvature"] == (
        f"{means.format(103, '3 runs')} The curvature is significant (F(1, 6) = 11.8, p = 0.0139)."
    )
    flat = screened(np.array([*Y, 99.0, 100.0, 101.0]), coded)
    assert notes(flat)["curvature"] == (
        f"{means.format(100, '3 runs')} The curvature is not significant (F(1, 6) = 0, p = 1.0000)."
    )
    half = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1], [0, 0, 0]], dtype=float)
    unknown = screened(np.array([110.0, 110.0, 90.0, 90.0, 103.0]), half)
    assert notes(unknown)["curvature"] == (
        f"{means.format(103, '1 run')} The curvature cannot be tested without an estimate of the error."
    )


def test_which_method_decides() -> None:
    assert "lenth_decides" not in notes(screened()) and "too_few_effects" not in notes(screened())
    exact = screened(100.0 + 10.0 * A)
    assert notes(exact)["lenth_decides"] == (
        "The significant factors are identified by Lenth's method because the residual sum of squares is zero."
    )
    six = np.vstack([CORNERS[:5], CORNERS[7:]])
    few = screened(np.delete(Y, [5, 6]), six)
    assert few.residual.df == 2 and notes(few)["lenth_decides"] == (
        "The significant factors are identified by Lenth's method because the number of residual degrees of freedom is "
        "only 2."
    )
    two = screened(Y, CORNERS[:, :2], ("a", "b"))
    assert notes(two)["too_few_effects"] == (
        "The significant factors are identified by the F test because Lenth's method requires at least 3 effects."
    )
    assert two.significant == ("a", "b") and two.lenth.me is None
    assert "flat_response" in notes(screened(np.full(8, 100.0)))


def test_methods_that_disagree() -> None:
    """Both effects are below Lenth's margin of 38 N, and significant by F."""
    disagreeing = [note.text for note in screened().notes if note.kind == "methods_disagree"]
    assert disagreeing == [
        "The effect of a is significant by the F test but not by Lenth's method (p < 0.0001; effect +20 N, margin of "
        "error 38.12 N).",
        "The effect of b is significant by the F test but not by Lenth's method (p = 0.0161; effect +4 N, margin of "
        "error 38.12 N).",
    ]


def test_an_effect_at_the_level_of_significance_is_not_significant() -> None:
    p = screened().effects[1].p
    assert p is not None
    exactly = screened(alpha=p)
    assert exactly.significant == ("a",)
    assert [note.text.split(" is ")[0] for note in exactly.notes if note.kind == "methods_disagree"] == [
        "The effect of a"
    ]


def test_failed_runs_are_left_out() -> None:
    y = Y.copy()
    y[7] = np.nan
    found = screened(y)
    assert (found.runs_used, found.runs_failed, found.residual.df) == (7, 1, 3)
    assert notes(found)["screening_runs_failed"] == (
        "1 of 8 runs failed, so the design is no longer orthogonal. The sums of squares (type III, 3 residual df) do "
        "not add up to the total sum of squares. The results of Lenth's method are approximate."
    )
    y = np.where(np.isin(np.arange(8), [1, 2, 4, 7]), Y, np.nan)  # abc = 1 is left, as many runs as coefficients
    with pytest.raises(RunsFailed, match=r"screen: 4 of 8 runs failed, which leaves no residual degrees of freedom"):
        screened(y)


# ---- the result


def test_factors_that_act_on_any_response() -> None:
    """Further responses: b falls by 30, c rises; a has no effect."""
    other = screened(50.0 - 15.0 * B + 5.0 * CORNERS[:, 2] + A * B)
    both = replace(WHOLE, significant=("a",), responses={"work": other})
    assert both.active_factors == ("a", "b", "c")
    shares = both.shares
    assert shares["a"] == pytest.approx(100.0 * 800.0 / 840.0)
    assert shares["b"] == pytest.approx(100.0 * 8 * 225.0 / (8 * (225.0 + 25.0 + 1.0)))
    assert len(both.all_responses) == 2 and both.all_responses[1].naming.response.name == "work"
    assert [table.title for table in ScreenShowing().tables(both, Wording())] == [
        "Effects on the maximum force",
        f"Effects on the {both.all_responses[1].naming.response.long}",
    ]
    assert len(ScreenShowing().findings(both, Wording())) == 1


def test_signs_of_significant_effects() -> None:
    assert [WHOLE.sign_of(name) for name in NAMES] == ["+", "+", None]
    falling = result_of(screened(200.0 - Y), y=200.0 - Y)
    assert [falling.sign_of(name) for name in NAMES] == ["-", "-", None]
    assert [label for label, _ in WHOLE.runs()] == [f"screen {n}" for n in range(1, 9)]
    tables = WHOLE.tables()
    assert list(tables) == ["screen", "screen_runs"] and tables["screen"].rows[0][:2] == ("a", "X1")
    assert tables["screen_runs"].heads == ("run", "a", "b", "c", "force")
    assert tables["screen_runs"].rows[0] == (1, -1.0, -1.0, -1.0, Y[0])


def test_the_chart_has_a_bar_for_each_effect_and_the_limit() -> None:
    falling = result_of(screened(100.0 + 10.0 * A - 2.0 * B + A * B))
    axes = pareto(falling, {"a": "Stress"}).axes[0]
    bars = [patch.get_width() for patch in axes.patches]
    assert bars == pytest.approx([0.0, 4.0, 20.0], abs=1e-9)
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels == ["c  +0.0", "b  −4.0", "Stress  +20.0"]
    assert axes.patches[1].get_facecolor() != axes.patches[2].get_facecolor() == axes.patches[0].get_facecolor()
    (limit,) = axes.lines
    assert limit.get_xdata()[0] == pytest.approx(2.7764, abs=1e-4) and limit.get_label() == "t test, p = 0.05"
    assert axes.get_xlabel() == "|effect| on the maximum force, N"
    assert pareto(WHOLE).get_figheight() == pytest.approx(2.2)
    nine = [replace(effect, factor=f"{effect.factor}{n}") for n in range(3) for effect in WHOLE.effects]
    assert pareto(replace(WHOLE, effects=Rows(nine))).get_figheight() == pytest.approx(0.9 + 9 * 0.24)
    setting: Any = SimpleNamespace(labels={})
    (plot,) = ScreenShowing().figures(WHOLE, setting)
    assert (plot.name, plot.section) == ("pareto", "screen")
    assert "Blue bars show effects that increase the force" in plot.caption


# ---- the design


def test_the_runs_of_the_design(tmp_path: Any) -> None:
    study = make_study(tmp_path, "screen: {centre_points: 2, fold_over: true}\n")
    design = screening_design(study, SpecSolver())
    assert (design.kind, design.order, len(design.coded)) == ("plackett-burman, folded over", 1, 26)
    assert np.array_equal(design.coded[:12], -design.coded[12:24]) and not design.coded[24:].any()
    assert design.levels[24] == study.midlevels()
    low = {f.name: (f.low, f.high)[int(x > 0)] for f, x in zip(study.factors, design.coded[0], strict=True)}
    assert design.levels[0] == pytest.approx(low)
    asked = foresee(study, SpecSolver(), None)
    assert asked.settled and len(asked.requests) == 26 and asked.requests[25].row == 25
    assert {request.condition for request in asked.requests} == {8.0} and asked.design is not None
    none = study.model_copy(update={"screen": study.screen.model_copy(update={"design": "none"})})
    with pytest.raises(UsageError, match=r"screen\.design: the value is `none`\. Choose a design"):
        screening_design(none, SpecSolver())


def test_a_design_in_a_table(tmp_path: Any) -> None:
    """Levels 0 and ±1 within a millionth; columns of other factors are at mid-range."""
    study = make_study(tmp_path)
    coding: Any = screening_design(study, SpecSolver()).coding
    table = [dict(zip(coding.names, coding.to_natural(np.full(9, x)).tolist(), strict=True)) for x in (-1, 1, 0)]
    table[1]["yield_stress"] = 20.0 + 4e-6
    found = given_design("screen", study, coding, table, order=1)
    assert found.coded.tolist() == [[-1.0] * 9, [1.0] * 9, [0.0] * 9] and (found.kind, found.order) == ("given", 1)
    assert given_design("rsm", study, coding, table).coded[1][3] == pytest.approx(1.0 + 8e-7, abs=1e-9)
    table[1]["yield_stress"] = 19.0
    with pytest.raises(UsageError) as error:
        given_design("screen", study, coding, table, order=1)
    assert str(error.value) == (
        "solver.screen row 2: the value 19 is not a level of the factor yield_stress. Set `low` and `high` of "
        "yield_stress to its two levels in the table."
    )
    del table[0]["density"], table[0]["poisson_ratio"]
    with pytest.raises(UsageError, match=r"the solver table has no columns for density, poisson_ratio\. List only"):
        given_design("screen", study, coding, table, order=1)
