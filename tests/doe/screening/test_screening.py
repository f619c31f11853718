from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from printed import agrees
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm

from stemcal.doe.designs.aliases import UniformlyAliased
from stemcal.doe.designs.catalogue import plackett_burman
from stemcal.doe.designs.plackett_burman import cyclic_design
from stemcal.doe.regression.surface_notes import FlatResponse
from stemcal.doe.screening.analysis import analyse_screening
from stemcal.doe.screening.holm import adjusted_p
from stemcal.doe.screening.lenth import FoldOverPays, critical_t, lenth, null_t
from stemcal.doe.screening.notes import (
    ExactResidual,
    InteractionOfStrongest,
    NoResidual,
    NotAfterHolm,
    ScreeningRunsFailed,
    UnusedContrasts,
    WeakError,
)
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.typed import to_json

NAMES = [f"X{i}" for i in range(1, 10)]
FIELDS = {"effect": "effect", "contribution_pct": "contribution_percent", "sum_of_squares": "sum_of_squares"}


def test_full_precision(pb, expected):
    answer = expected["pb"]
    for ours, theirs in [
        ("effect", "effect"),
        ("contribution_percent", "contribution_pct"),
        ("sum_of_squares", "ss"),
        ("f", "F"),
        ("p", "p"),
    ]:
        values = [getattr(effect, ours) for effect in pb.effects]
        assert values == pytest.approx(answer[theirs], rel=1e-10, abs=1e-12)
    assert pb.total_sum_of_squares == pytest.approx(31434.889166666668, rel=1e-12)
    assert pb.residual_sum_of_squares / pb.residual_df == pytest.approx(answer["mse"], rel=1e-10)
    assert pb.residual_df == 2


def test_sums_of_squares_are_a_quarter_n_effect_squared(pb):
    for effect in pb.effects:
        assert effect.sum_of_squares == pytest.approx(3.0 * effect.effect**2, rel=1e-12)


def test_x7_lies_just_beyond_the_margin_but_not_among_all(pb):
    """Over all 11 contrasts ME = 16.54 N and X7 has 16.917 N; over the 9 factors alone ME is 2.25·7.475 = 16.8 N."""
    assert pb.significant == ("X4", "X7", "X9")
    factors_alone = lenth(np.array([effect.effect for effect in pb.effects]))
    assert factors_alone.pse == pytest.approx(7.475, abs=1e-9)
    assert factors_alone.me == pytest.approx(16.82, abs=0.05)
    assert pb.lenth.m == 11
    assert pb.lenth.me == pytest.approx(16.54, abs=0.02)
    active = [effect.factor for effect in pb.effects if abs(effect.effect) > pb.lenth.me]
    assert active == ["X4", "X7", "X9"]
    assert [effect.factor for effect in pb.effects if abs(effect.effect) > pb.lenth.sme] == ["X4", "X9"]
    assert pb.effects[6].effect == pytest.approx(16.9167, abs=1e-4)
    assert pb.effects[6].p_holm == pytest.approx(0.324, abs=1e-3)
    assert pb.effects[3].lenth_t == pytest.approx(79.41666667 / pb.lenth.pse, rel=1e-9)
    assert [effect.factor for effect in pb.ranked()[:3]] == ["X4", "X9", "X7"]


def test_adjusted_p_by_hand(pb):
    p = sorted((effect.p, i) for i, effect in enumerate(pb.effects))
    holm = np.maximum.accumulate([min(1.0, (9 - rank) * value) for rank, (value, _) in enumerate(p)])
    bh = np.minimum.accumulate([value * 9 / (rank + 1) for rank, (value, _) in reversed(list(enumerate(p)))])[::-1]
    for rank, (_, i) in enumerate(p):
        assert pb.effects[i].p_holm == pytest.approx(holm[rank], rel=1e-12)
        assert pb.effects[i].p_bh == pytest.approx(bh[rank], rel=1e-12)
    assert adjusted_p([0.01, None], "holm") == [None, None]


def test_notes_name_the_weak_error_the_many_tests_and_the_aliases(pb):
    weak, tests, aliases, interaction, unused, fold = pb.notes
    assert weak == WeakError(2)
    assert tests == NotAfterHolm(("X7",), 0.05, 9, pytest.approx(37.0, abs=0.1))
    assert aliases == UniformlyAliased(12, pytest.approx(1 / 3))
    assert isinstance(interaction, InteractionOfStrongest) and (interaction.first, interaction.second) == ("X4", "X9")
    assert isinstance(unused, UnusedContrasts) and unused.count == 11
    assert unused.decides and 5.32 in np.round(unused.contrasts, 2)
    assert isinstance(fold, FoldOverPays) and fold.runs == 12


def test_lenth_published_example():
    """A hand-worked example: median 2 → s₀ = 3; |c| < 7.5 leaves 1, 1, 2, 2, 3 → PSE = 3."""
    size = lenth(np.array([1.0, -1.0, 2.0, -2.0, 3.0, 30.0, -40.0]))
    assert size.pse == pytest.approx(3.0)
    assert (size.me, size.sme) == pytest.approx((3.0 * 2.298, 3.0 * 4.873), rel=5e-3)
    assert size.p_value(-3.0 * 2.298) == pytest.approx(0.05, abs=3e-4)


# R package DoE.base 1.2-5 (U. Grömping), tables crit.ME and crit.SME: each from a million draws by its author.
CRITICAL = {
    7: (2.2983, 5.0708, 4.8735, 9.7293),
    8: (2.2021, 4.6962, 4.8630, 8.6604),
    9: (2.2496, 4.4574, 4.6223, 8.3229),
    11: (2.2105, 4.0686, 4.4392, 7.4470),
    15: (2.1568, 3.6242, 4.2309, 6.4067),
    19: (2.1230, 3.3836, 4.1053, 5.8522),
    31: (2.0652, 3.0466, 3.9238, 5.0929),
    47: (2.0312, 2.8775, 3.8360, 4.7203),
}


@pytest.mark.parametrize("m", CRITICAL)
def test_critical_values_of_lenths_method(m):
    """At 5 and 1 %, of one effect and of the largest; simulation leaves a few thousandths, both here and there."""
    single_5, single_1, largest_5, largest_1 = CRITICAL[m]
    assert critical_t(m, 0.05) == pytest.approx((single_5, largest_5), rel=6e-3)
    assert critical_t(m, 0.01) == pytest.approx((single_1, largest_1), rel=1.2e-2)


def test_critical_values_of_three_effects_by_integration():
    """P(|c₁|/PSE > t) for three effects, by quadrature over the median: nothing of the simulation is used.

    With sizes a < b < c: PSE = 1.5·b if c < 3.75·b, else 1.5·(a + b)/2. Summed over which of the three exceeds t.
    """
    from scipy.integrate import dblquad
    from scipy.special import erf

    def density(x):
        return np.sqrt(2.0 / np.pi) * np.exp(-0.5 * x * x)

    def beyond(lowest):
        return 1.0 - erf(lowest / np.sqrt(2.0))

    def largest_exceeds(t):
        def at(a, b):
            near = max(beyond(max(1.5 * t * b, b)) - beyond(3.75 * b), 0.0)
            far = beyond(max(0.75 * t * (a + b), 3.75 * b))
            return 6.0 * density(a) * density(b) * (near + far)

        return dblquad(at, 0.0, 12.0, 0.0, lambda b: b, epsabs=1e-7)[0]

    # above t = 4/3 no other than the largest can exceed t·PSE: b = PSE/1.5 or, far off, b ≤ 2·PSE/1.5 = 1.333·PSE
    single, largest = critical_t(3, 0.05)
    assert largest_exceeds(single) / 3.0 == pytest.approx(0.05, abs=2e-4)
    assert largest_exceeds(largest) == pytest.approx(0.05, abs=4e-4)


def test_the_null_distribution_is_always_the_same():
    first = critical_t(5, 0.05)
    critical_t.cache_clear(), null_t.cache_clear()
    assert critical_t(5, 0.05) == first


def test_a_saturated_design_has_lenth_alone():
    design = plackett_burman(11)
    noise = np.random.default_rng(1).normal(0.0, 1.0, 12)
    result = analyse_screening(design, 100.0 + 30.0 * design[:, 2] + noise, [f"f{i}" for i in range(11)])
    assert result.residual_df == 0
    assert all(effect.f is None and effect.p is None and effect.p_holm is None for effect in result.effects)
    assert result.significant == ("f2",)
    assert result.effects[2].effect == pytest.approx(60.0, abs=2.0)
    assert NoResidual() in result.notes
    json.dumps(to_json(result.effects), allow_nan=False)


def test_an_exact_response_gives_no_f():
    design = plackett_burman(5, "plackett-burman", runs=8)
    result = analyse_screening(design, 10.0 + 3.0 * design[:, 0] + 1.0 * design[:, 1], list("abcde"))
    assert all(effect.f is None for effect in result.effects)
    assert ExactResidual() in result.notes
    assert result.effects[0].effect == pytest.approx(6.0)
    assert [effect.effect for effect in result.effects[2:]] == [0.0, 0.0, 0.0]
    assert result.significant == ("a", "b")
    assert result.effects[0].contribution_percent == pytest.approx(90.0)


def test_a_flat_response_has_no_effects():
    result = analyse_screening(plackett_burman(5, runs=8), np.full(8, 0.1), list("abcde"))
    assert [effect.contribution_percent for effect in result.effects] == [0.0] * 5
    assert result.significant == ()
    assert FlatResponse() in result.notes
    json.dumps(to_json(result.effects), allow_nan=False)


def test_a_failed_run_is_left_out_and_said(pb_runs):
    force = pb_runs.force.copy()
    force[3] = np.nan
    result = analyse_screening(pb_runs.coded, force, NAMES)
    assert (result.runs_used, result.runs_failed, result.residual_df) == (11, 1, 1)
    assert result.notes[0] == ScreeningRunsFailed(1, 12, 1)
    keep = np.isfinite(force)
    frame = pd.DataFrame(pb_runs.coded[keep], columns=NAMES).assign(y=force[keep])
    table = anova_lm(ols("y ~ " + " + ".join(NAMES), frame).fit(), typ=3)
    for effect in result.effects:
        assert effect.sum_of_squares == pytest.approx(table.loc[effect.factor, "sum_sq"], rel=1e-9)
        assert effect.p == pytest.approx(table.loc[effect.factor, "PR(>F)"], rel=1e-9)


@pytest.mark.parametrize("failed", [[0, 1], [0, 1, 2, 3]])
def test_too_few_runs_are_refused(pb_runs, failed):
    force = pb_runs.force.copy()
    force[failed] = np.nan
    with pytest.raises(RunsFailed, match=f"{len(failed)} of 12 runs failed"):
        analyse_screening(pb_runs.coded, force, NAMES)


def test_a_design_that_cannot_estimate_is_refused():
    design = plackett_burman(3)
    with pytest.raises(UsageError, match="cannot estimate b, d"):
        analyse_screening(np.column_stack([design, design[:, 1]]), np.arange(4.0), list("abcd"))
    with pytest.raises(UsageError, match="does not go with"):
        analyse_screening(design, np.arange(5.0), list("abc"))


def test_two_effects_are_too_few_for_lenth():
    result = analyse_screening(plackett_burman(2), [1.0, 2.0, 4.0, 8.0], ["a", "b"], ["X1", "X2"])
    assert result.lenth.pse is None
    assert [effect.symbol for effect in result.effects] == ["X1", "X2"]
    assert all(effect.lenth_t is None for effect in result.effects)


def test_plackett_burman_of_the_weld_repaired_castings():
    """Hunter, Hodi and Eagar (1982), in Hamada and Wu, J. Quality Technology 24 (1992), 130–137.

    Data after them. The estimates have not been compared with the page; they are differences of two means of six runs,
    computed again here. Only F stands out. The analysis of variance is what R 4.2.2 prints for anova(lm(y ~ .)).
    """
    generator = "++-+++---+-"
    design = np.array([[1.0 if c == "+" else -1.0 for c in generator[i:] + generator[:i]] for i in range(11)])
    design = np.vstack([design, -np.ones(11)])
    life = [6.058, 4.733, 4.625, 5.899, 7.000, 5.752, 5.682, 6.607, 5.818, 5.917, 5.863, 4.809]
    known = ["0.326", "0.294", "-0.246", "-0.516", "0.150", "0.915", "0.183", "0.446", "0.453", "0.081", "-0.242"]
    every = analyse_screening(design, life, [*"ABCDEFG", *"hijk"])
    assert all(agrees(cell, effect.effect) for cell, effect in zip(known, every.effects, strict=True))
    by_hand = [np.mean(np.array(life)[column > 0]) - np.mean(np.array(life)[column < 0]) for column in design.T]
    assert [effect.effect for effect in every.effects] == pytest.approx(by_hand, rel=1e-12)
    result = analyse_screening(design[:, :7], life, list("ABCDEFG"))
    printed_by_r = {
        "A": "0.3185021 0.90616 0.395041",
        "B": "0.2590141 0.73691 0.439048",
        "C": "0.1813021 0.51582 0.512346",
        "D": "0.7992841 2.27401 0.206048",
        "E": "0.0673501 0.19162 0.684175",
        "F": "2.5125901 7.14847 0.055594",
        "G": "0.1006501 0.28636 0.620930",
    }
    for effect in result.effects:
        cells = printed_by_r[effect.factor].split()
        assert all(map(agrees, cells, (effect.sum_of_squares, effect.f, effect.p))), effect
    assert agrees("1.4059457", result.residual_sum_of_squares)
    assert result.ranked()[0].factor == "F"
    assert round(result.ranked()[0].contribution_percent) == 45  # R² = 0.45 of F alone
    assert {tuple(row) for row in design} == {tuple(row) for row in cyclic_design(11)}


def test_an_effect_beyond_the_simultaneous_margin_needs_no_holm():
    """Coefficients 30 and 25, one of 7 in an unused column: t = 30·√2/7 = 6.1 with two df, Holm above 5 %.

    The other effects are noise of 0.5, which SME passes by far: both matter, and nothing is said of chance.
    """
    every = plackett_burman(11)
    design, unused = every[:, :9], every[:, 9]
    noise = np.random.default_rng(0).normal(0.0, 0.5, 12)
    result = analyse_screening(design, 100.0 + 30.0 * design[:, 0] + 25.0 * design[:, 1] + 7.0 * unused + noise, NAMES)
    strong = result.effects[:2]
    assert all(effect.p < 0.05 and effect.p_holm > 0.05 and effect.effect > result.lenth.sme for effect in strong)
    assert all(effect.conclusion.standing == "active" for effect in strong)
    assert not any(isinstance(note, NotAfterHolm) for note in result.notes)
