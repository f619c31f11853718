"""Priors as one more measurement: known answers of the normal model, lognormal moments, coverage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from synthetic import exact, misfit, region, surfaces

from stemcal.doe.calibration.joint_fit import chance_of, fit_jointly
from stemcal.doe.calibration.misfit import Misfit, Observation, best_fit, misfit_of
from stemcal.doe.calibration.prior import Prior
from stemcal.doe.calibration.profile import holds, profiles_of, unseen_directions
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface, fit_surface

BOX = Region(np.full(2, -4.0), np.full(2, 4.0), None)
TRUTH = np.array([0.3, -0.2])


def plane(a: float, b: float) -> Surface:
    coded = central_composite(2, 1, "rotatable")
    return fit_surface(coded, [100.0 + a * x + b * y for x, y in coded], ["a", "b"])


def normal(j: int, mean: float, sd: float) -> Prior:
    return Prior(j, "normal", mean, sd, centre=0.0, half_step=1.0)


def test_a_normal_prior_is_one_more_measurement() -> None:
    """a ~ N(0.5, 0.1) measured, N(0.1, 0.2) before: mean 0.42, sd 0.08944; b from its prior alone, N(1, 0.5)."""
    data = misfit_of([Observation(plane(20, 0), 110.0, 2.0)])
    known = data.with_priors([normal(0, 0.1, 0.2), normal(1, 1.0, 0.5)], BOX)
    best = best_fit(known, BOX)
    assert best == pytest.approx([0.42, 1.0], abs=1e-5)
    a, b = profiles_of(known, BOX, best)
    assert (a.low, a.high) == pytest.approx((0.42 - 1.96 * 0.08944, 0.42 + 1.96 * 0.08944), abs=1e-4)
    assert (b.low, b.high) == pytest.approx((1.0 - 0.98, 1.0 + 0.98), abs=1e-4)
    assert len(unseen_directions(known, best)) == 0 and len(unseen_directions(data, best)) == 1


def test_the_test_of_the_misfit_counts_priors() -> None:
    """a = 0.5 ± 0.1 measured, 1.1 ± 0.2 before, b measured once: D = 0.6²/0.05 = 7.2 with one degree of freedom."""
    data = misfit_of([Observation(plane(20, 0), 110.0, 2.0), Observation(plane(0, 10), 100.0, 2.0)])
    known = data.with_priors([normal(0, 1.1, 0.2)], BOX)
    best = best_fit(known, BOX)
    assert known.tests and known.df == 1 and known.value(best) == pytest.approx(7.2, rel=1e-6)
    assert chance_of(known, best) == pytest.approx(0.00729, rel=0.01)
    few = misfit_of([Observation(plane(20, 0), 110.0, 2.0, 6), Observation(plane(0, 10), 100.0, 2.0, 6)])
    expected, form_df, _ = few.with_priors([normal(0, 1.1, 0.2)], BOX).moments(best)
    assert (expected, form_df) == pytest.approx((1.0, 1.0), rel=0.01)


def test_a_lognormal_prior_has_its_mean_and_sd() -> None:
    """The density over v = 10 + 2x, integrated: mean 10, sd 3."""
    prior = Prior(0, "lognormal", 10.0, 3.0, centre=10.0, half_step=2.0)
    x = np.linspace(-4.99, 30.0, 200_001)
    density, value = np.exp(prior.log_density(x[:, None])), 10.0 + 2.0 * x
    mean = np.sum(value * density) / np.sum(density)
    assert mean == pytest.approx(10.0, rel=1e-3)
    assert np.sqrt(np.sum((value - mean) ** 2 * density) / np.sum(density)) == pytest.approx(3.0, rel=1e-2)


def test_gradients_hold_what_priors_add() -> None:
    priors = [normal(0, 0.1, 0.2), Prior(1, "lognormal", 10.0, 3.0, 10.0, 2.0)]
    known = misfit(exact(surfaces(), TRUTH), 0.05).with_priors(priors, region())
    x, step = np.array([0.4, -0.5]), 1e-6
    slopes = [(known.value(x + step * e) - known.value(x - step * e)) / (2 * step) for e in np.eye(2)]
    assert known.gradient(x) == pytest.approx(slopes, rel=1e-5)
    assert known.df == 5 + 2 - 2


def test_a_misfit_of_unknown_size_is_told_without_the_prior() -> None:
    """No sd anywhere: the forces tell their scatter, s² = D_min/(m − k), before a prior enters."""
    data = misfit(exact(surfaces(), TRUTH) * np.array([1.01, 0.99, 1.0, 1.02, 0.98]), None)
    known = data.with_priors([normal(0, 0.3, 0.1)], region())
    assert known.scale_known and known.scale_df == 3.0 and not known.tests
    assert known.of_data(best_fit(data, region())[None])[0] == pytest.approx(3.0, rel=1e-6)


def test_a_joint_fit_of_too_few_values_keeps_to_its_prior() -> None:
    """One force, 110 ± 2, of three factors, a ~ N(0.2, 0.1): b and c share the rest, 0.4 each."""
    coded = central_composite(3, 1, "rotatable")
    surface = fit_surface(coded, 100.0 + 10.0 * coded.sum(axis=1), ["a", "b", "c"])
    box = Region(np.full(3, -1.5), np.full(3, 1.5), None)
    known = misfit_of([Observation(surface, 110.0, 2.0)]).with_priors([normal(0, 0.2, 0.1)], box)
    assert known.df == -1 and fit_jointly(known, box).coded == pytest.approx([0.2, 0.4, 0.4], abs=2e-3)


def test_a_prior_against_data_that_gave_their_own_scatter() -> None:
    """Forces ± 1 or 2 % and a right prior, and one that is far off: the rise is F(1, 3)."""
    data = misfit(exact(surfaces(), TRUTH) * np.array([1.01, 0.99, 1.0, 1.02, 0.98]), None)
    agreed, apart = (fit_jointly(data.with_priors([normal(0, mean, 0.05)], region()), region()) for mean in (0.3, -1.2))
    assert agreed.df == apart.df == 1 and agreed.p_value > 0.3 and apart.p_value < 0.05
    assert apart.p_value == pytest.approx(stats.f.sf(apart.misfit, 1, 3), rel=1e-9)


def prior_laboratory(random: np.random.Generator) -> tuple[Misfit, Array]:
    """A material drawn from its priors, N(0, 0.4) each; six stems at each of five diameters, cv 10 %."""
    truth = np.clip(0.4 * random.standard_normal(2), -1.5, 1.5)
    fitted = surfaces()
    broken = exact(fitted, truth)[:, None] * (1.0 + 0.1 * random.standard_normal((5, 6)))
    rows = zip(fitted, broken.mean(axis=1), broken.std(axis=1, ddof=1), strict=True)
    data = misfit_of([Observation(s, float(m), float(sd), 6) for s, m, sd in rows], region())
    return data.with_priors([normal(0, 0.0, 0.4), normal(1, 0.0, 0.4)], region()), truth


@pytest.mark.slow
def test_where_the_prior_is_true_intervals_hold_the_material() -> None:
    """Of 200 simulated laboratories; 95 % within three standard errors of the count."""
    random, held = np.random.default_rng(27), np.zeros(2)
    for _ in range(200):
        known, truth = prior_laboratory(random)
        held += holds(known, region(), truth)
    assert np.all(held / 200 >= 0.905) and np.all(held / 200 <= 0.995)


def test_the_prior_enters_the_likelihood() -> None:
    known, truth = prior_laboratory(np.random.default_rng(3))
    points = np.vstack([truth, [0.0, 0.0], [0.5, -0.5]])
    apart = known.log_likelihood(points) - replace(known, priors=()).log_likelihood(points)
    assert apart == pytest.approx(-0.5 * np.sum((points / 0.4) ** 2, axis=1), rel=1e-9)
