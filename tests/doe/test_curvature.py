"""Centre points beside a two-level design: curvature, and scatter to test effects against."""

import numpy as np
import pytest
import statsmodels.api as sm

from stemcal.doe.designs import screening_runs
from stemcal.stages.screen.analysis import analyse_screening

# D. C. Montgomery, Design and Analysis of Experiments, 8th ed., section 6.8: yield over time and temperature, a 2²
# design and five centre runs. SS of A 2.4025, of B 0.4225, of curvature 0.0027, mean square of pure error 0.0430.
CORNERS = [(-1.0, -1.0, 39.3), (1.0, -1.0, 40.9), (-1.0, 1.0, 40.0), (1.0, 1.0, 41.5)]
CENTRE = [40.3, 40.5, 40.7, 40.2, 40.6]
DESIGN = np.array([row[:2] for row in CORNERS] + [(0.0, 0.0)] * 5)
YIELD = np.array([row[2] for row in CORNERS] + CENTRE)


def test_montgomerys_yield_has_the_residual_of_the_model_with_curvature():
    """The interaction, −0.05, leaves 0.0025 with one df beside the 0.172 (4 · 0.0430) of the centre with four."""
    found = analyse_screening(DESIGN, YIELD, ["A", "B"])
    assert [effect.effect for effect in found.effects] == pytest.approx([1.55, 0.65])
    assert (found.residual.sum_of_squares, found.residual.df) == (pytest.approx(0.1745), 5)
    assert (found.runs_used, found.runs_failed) == (9, 0)
    assert [effect.f for effect in found.effects] == pytest.approx([2.4025 / 0.0349, 0.4225 / 0.0349])
    assert [(note.kind, note.severity) for note in found.notes if "curvature" in note.text] == [
        ("curvature", "caution")
    ]
    curvature = found.curvature
    assert curvature is not None and curvature.runs == 5 and curvature.df == 5 and not curvature.curved
    assert curvature.difference == pytest.approx(40.425 - 40.46)
    assert curvature.sum_of_squares == pytest.approx(0.0027, abs=5e-5)
    assert curvature.f == pytest.approx(0.00272222 / 0.0349, rel=1e-5)


def test_a_curved_response_is_found_and_effects_stay_as_they_were():
    """y = 10 + 3·x₁ − 5·x₂²: twelve corners lie 5 below the centre, effects are those without centre runs."""
    design = screening_runs("plackett-burman", 5)
    noise = np.random.default_rng(3).normal(0.0, 0.2, len(design) + 4)
    whole = np.vstack([design, np.zeros((4, 5))])
    y = 10.0 + 3.0 * whole[:, 0] - 5.0 * whole[:, 1] ** 2 + noise
    names = list("abcde")
    found, without = analyse_screening(whole, y, names), analyse_screening(design, y[:12], names)
    assert [e.effect for e in found.effects] == pytest.approx([e.effect for e in without.effects])
    assert found.curvature is not None and found.curvature.p is not None and found.curvature.p < 1e-6
    assert found.curvature.difference == pytest.approx(-5.0, abs=4 * 0.2 * (1 / 12 + 1 / 4) ** 0.5)
    assert without.curvature is None


def test_centre_runs_of_a_program_without_chance_are_one():
    """Their scatter is none: nothing is added to the error, and the curvature has the weight of a single run."""
    y = YIELD.copy()
    y[4:] = 41.0
    found = analyse_screening(DESIGN, y, ["A", "B"])
    assert found.residual.df == 1
    assert found.curvature is not None and found.curvature.runs == 1
    assert found.curvature.sum_of_squares == pytest.approx(4 * 1 * 0.575**2 / 5)


def test_failed_centre_runs_are_left_out():
    y = YIELD.copy()
    y[5] = np.nan
    found = analyse_screening(DESIGN, y, ["A", "B"])
    assert found.curvature is not None and found.curvature.runs == 4
    assert (found.runs_used, found.runs_failed) == (8, 1)
    assert "screening_runs_failed" not in [note.kind for note in found.notes]


def with_failures(random: np.random.Generator, failures: int, bend: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """2^(5−1) and four centre runs of y = 100 + 20·x₁ + 3·x₂ + noise, lower at the corners by `bend`.

    Runs at the high level of x₁ failed.
    """
    design = np.vstack([screening_runs("fractional-factorial", 5, 16), np.zeros((4, 5))])
    y = 100.0 + 20.0 * design[:, 0] + 3.0 * design[:, 1] - bend * design[:, 0] ** 2 + random.normal(0.0, 2.0, 20)
    y[random.choice(np.flatnonzero(design[:, 0] > 0), failures, replace=False)] = np.nan
    return design, y


@pytest.mark.parametrize("failures", [0, 1, 2, 4])
def test_the_test_is_that_of_a_centre_indicator_in_a_regression(failures: int) -> None:
    """By statsmodels: y on the five factors and a column that is 1 at the centre runs, failed runs left out."""
    design, y = with_failures(np.random.default_rng(failures), failures)
    found = analyse_screening(design, y, list("abcde")).curvature
    indicator = (~design.any(axis=1)).astype(float)
    columns, left = np.column_stack([np.ones(20), design, indicator]), np.isfinite(y)
    fit = sm.OLS(y[left], columns[left]).fit()
    assert found is not None and found.df == fit.df_resid == 13 - failures
    assert found.difference == pytest.approx(-fit.params[-1], rel=1e-9)
    assert found.corners == pytest.approx(fit.params[0], rel=1e-9)
    assert (found.f, found.p) == pytest.approx((fit.tvalues[-1] ** 2, fit.pvalues[-1]), rel=1e-8)


@pytest.mark.parametrize("failures", [0, 1, 2, 4])
def test_failed_corners_of_a_linear_response_are_no_curvature(failures: int) -> None:
    """At 5 % 15 of 300 studies are called curved, ± 4 by chance; a bend of three standard deviations is found."""
    random = np.random.default_rng(100 + failures)
    straight = [analyse_screening(*with_failures(random, failures), list("abcde")).curvature for _ in range(300)]
    assert 4 <= sum(one is not None and one.curved for one in straight) <= 27
    bent = [analyse_screening(*with_failures(random, failures, 6.0), list("abcde")).curvature for _ in range(50)]
    assert sum(one is not None and one.curved for one in bent) >= 45
