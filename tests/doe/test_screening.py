import json

import numpy as np
import pandas as pd
import pytest
from printed import agrees
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm

from stemcal.doe.designs import plackett_burman
from stemcal.doe.effects import lenth
from stemcal.errors import RunsFailed, UsageError
from stemcal.stages.screen.analysis import analyse_screening
from stemcal.stages.screen.result import Screening
from stemcal.storage.typed import to_json

NAMES = [f"X{i}" for i in range(1, 10)]


def kinds(found: Screening) -> list[str]:
    """Return the kinds of the notes."""
    return [note.kind for note in found.notes]


def test_sums_of_squares_are_a_quarter_n_effect_squared(pb):
    for effect in pb.effects:
        assert effect.sum_of_squares == pytest.approx(3.0 * effect.effect**2, rel=1e-12)


def test_lenth_leaves_x7_out_where_the_paper_has_f_with_two_degrees_of_freedom(pb):
    """The paper keeps X7 by p = 0.046 of F(1, 2). Lenth: ME = t(0.975; 3)·7.475 = 23.79 N, beyond the 16.92 N of X7."""
    assert pb.significant == ("X4", "X9")
    assert pb.lenth.pse == pytest.approx(7.475, abs=1e-9)
    assert pb.lenth.me == pytest.approx(3.18245 * 7.475, rel=1e-5)
    assert pb.lenth.sme == pytest.approx(53.283514, rel=1e-6)
    assert [e.factor for e in pb.effects if e.p < 0.05] == ["X4", "X7", "X9"]
    assert pb.effects[6].effect == pytest.approx(16.9167, abs=1e-4)
    assert pb.effects[3].lenth_t == pytest.approx(79.41666667 / 7.475, rel=1e-9)


def test_notes_say_which_test_decides_where_both_disagree_and_the_aliases(pb):
    decides, disagree, aliases = pb.notes
    assert decides.kind == "lenth_decides" and "freedom is only 2" in decides.text
    assert disagree.kind == "methods_disagree"
    assert "X7 is" in disagree.text and "p = 0.0462" in disagree.text and f"{pb.lenth.me:.4g} N" in disagree.text
    assert aliases.kind == "partly_aliased" and "up to 0.33" in aliases.text


@pytest.mark.parametrize(("factors", "by_f"), [(8, True), (9, False)])
def test_the_f_test_decides_from_three_degrees_of_freedom(factors, by_f):
    """Of twelve runs eight factors leave three, nine factors two."""
    design, random = plackett_burman(factors), np.random.default_rng(1)
    found = analyse_screening(design, 10.0 + 2.0 * design[:, 0] + random.standard_normal(12), NAMES[:factors])
    significant = [e.p < 0.05 if by_f else abs(e.effect) > found.lenth.me for e in found.effects]
    assert found.significant == tuple(e.factor for e, chosen in zip(found.effects, significant, strict=True) if chosen)
    assert ("lenth_decides" in kinds(found)) is not by_f


def test_repeated_runs_are_in_the_residual(pb_runs):
    """Twice the same design, 3 N apart: 12·4.5 of scatter beside twice the residual of one; 24 − 10 df."""
    once = analyse_screening(pb_runs.coded, pb_runs.force, NAMES)
    coded, force = np.vstack([pb_runs.coded, pb_runs.coded]), np.concatenate([pb_runs.force, pb_runs.force + 3.0])
    found = analyse_screening(coded, force, NAMES)
    assert found.residual.df == 14
    assert found.residual.sum_of_squares == pytest.approx(2.0 * once.residual.sum_of_squares + 12 * 4.5)


def test_lenth_published_example():
    """A hand-worked example: median 2 → s₀ = 3; |c| < 7.5 leaves 1, 1, 2, 2, 3 → PSE = 3."""
    size = lenth(np.array([1.0, -1.0, 2.0, -2.0, 3.0, 30.0, -40.0]))
    assert size.pse == pytest.approx(3.0)
    assert (size.me, size.sme) == pytest.approx((3.0 * 3.76427, 3.0 * 9.00860), rel=1e-4)


def test_a_saturated_design_has_lenth_alone():
    design = plackett_burman(11)
    noise = np.random.default_rng(1).normal(0.0, 1.0, 12)
    result = analyse_screening(design, 100.0 + 30.0 * design[:, 2] + noise, [f"f{i}" for i in range(11)])
    assert result.residual.df == 0
    assert all(effect.f is None and effect.p is None for effect in result.effects)
    assert result.significant == ("f2",)
    assert result.effects[2].effect == pytest.approx(60.0, abs=2.0)
    assert "lenth_decides" in kinds(result)
    json.dumps(to_json(result.effects), allow_nan=False)


def test_an_exact_response_gives_no_f():
    design = plackett_burman(5, runs=8)
    result = analyse_screening(design, 10.0 + 3.0 * design[:, 0] + 1.0 * design[:, 1], list("abcde"))
    assert all(effect.f is None for effect in result.effects)
    assert "lenth_decides" in kinds(result)
    assert result.effects[0].effect == pytest.approx(6.0)
    assert [effect.effect for effect in result.effects[2:]] == [0.0, 0.0, 0.0]
    assert result.significant == ("a", "b")
    assert result.effects[0].contribution_percent == pytest.approx(90.0)


def test_a_flat_response_has_no_effects():
    result = analyse_screening(plackett_burman(5, runs=8), np.full(8, 0.1), list("abcde"))
    assert [effect.contribution_percent for effect in result.effects] == [0.0] * 5
    assert result.significant == ()
    assert "flat_response" in kinds(result)
    json.dumps(to_json(result.effects), allow_nan=False)


def test_a_failed_run_is_left_out_and_said(pb_runs):
    force = pb_runs.force.copy()
    force[3] = np.nan
    result = analyse_screening(pb_runs.coded, force, NAMES)
    assert (result.runs_used, result.runs_failed, result.residual.df) == (11, 1, 1)
    lost = result.notes[0]
    assert lost.kind == "screening_runs_failed" and "1 of 12 runs" in lost.text and "1 residual df" in lost.text
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
    with pytest.raises(UsageError, match="b, d cannot be estimated"):
        analyse_screening(np.column_stack([design, design[:, 1]]), np.arange(4.0), list("abcd"))


def test_two_effects_are_too_few_for_lenth():
    result = analyse_screening(plackett_burman(2), [1.0, 2.0, 4.0, 8.0], ["a", "b"], ["X1", "X2"])
    assert result.lenth.pse is None
    assert [effect.symbol for effect in result.effects] == ["X1", "X2"] and "too_few_effects" in kinds(result)
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
    assert agrees("1.4059457", result.residual.sum_of_squares)
    assert round(result.effects[5].contribution_percent) == 45  # R² = 0.45 of F alone
    assert {tuple(row) for row in design} == {tuple(row) for row in plackett_burman(11)}
