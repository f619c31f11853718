"""What is not known of the testing machine moves the responses of all diameters together: generalised least squares.

Planted: surfaces without error, y = 100 + Jx, two responses at each of five diameters, moved by the machine by u and w.
Each answer beside is of the whole covariance matrix, V = diag(v) + uuᵀ + wwᵀ, put together by hand.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from stemcal.doe.calibration.misfit import Misfit, Observation, best_fit, misfit_of
from stemcal.doe.calibration.profile import profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.composite import central_composite
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import fit_surface

REGION = Region(np.full(2, -20.0), np.full(2, 20.0), None)
RUNS = central_composite(2, centre_points=1)
ALIKE = np.tile([[10.0, 2.0], [3.0, -8.0]], (5, 1))
RANDOM = np.random.default_rng(27)
APART = ALIKE * RANDOM.uniform(0.7, 1.3, ALIKE.shape)
SD = RANDOM.uniform(2.0, 4.0, 10)
U, W = RANDOM.uniform(-10.0, 10.0, (2, 10))
MEASURED = 100.0 + RANDOM.normal(0.0, 5.0, 10)


def misfit(j: Array, n: int | None = None, u: Array = U, w: Array = W, sd: Array = SD) -> Misfit:
    """Return the misfit; without `n` each standard deviation of a mean counts as known."""
    observed = []
    for i, (row, mean, spread) in enumerate(zip(j, MEASURED, sd, strict=False)):
        surface = fit_surface(RUNS, 100.0 + RUNS @ row, ("x", "y"))
        specimens, alike = ("" if n is None else f"d{i // 2}"), {"stiffness": u[i], "toe": w[i]}
        wide = spread * (n or 1) ** 0.5
        observed.append(Observation(surface, mean, wide, n, f"r{i % 2}", specimens, alike))
    return misfit_of(observed)


def covariance(count: int = 10) -> Array:
    u, w = U[:count], W[:count]
    return np.asarray(np.diag(SD[:count] ** 2) + np.outer(u, u) + np.outer(w, w))


def half_widths(found: Misfit) -> Array:
    return np.array([0.5 * (one.high - one.low) for one in profiles_of(found, REGION, best_fit(found, REGION))])


@pytest.mark.parametrize("count", [2, 6, 10])
def test_intervals_are_those_of_generalised_least_squares(count: int) -> None:
    """θ̂ = (JᵀV⁻¹J)⁻¹JᵀV⁻¹r ± 1.96 √(JᵀV⁻¹J)⁻¹ⱼⱼ."""
    found, j, inverse = misfit(APART[:count]), APART[:count], np.linalg.inv(covariance(count))
    spread = np.linalg.inv(j.T @ inverse @ j)
    np.testing.assert_allclose(
        best_fit(found, REGION), spread @ j.T @ inverse @ (MEASURED[:count] - 100.0), rtol=1e-5, atol=1e-6
    )
    np.testing.assert_allclose(half_widths(found), stats.norm.ppf(0.975) * np.sqrt(np.diag(spread)), rtol=1e-4)


def test_at_one_diameter_it_is_an_error_of_each_score() -> None:
    """Where each moves a response of its own the variances add up, as for errors that are not shared."""
    u, w = np.array([7.0, 0.0]), np.array([0.0, -5.0])
    points = np.array([[0.3, -0.2], [2.0, 1.0]])
    gap = MEASURED[:2] - 100.0 - points @ ALIKE[:2].T
    expected = (gap**2 / (SD[:2] ** 2 + u**2 + w**2)).sum(axis=1)
    np.testing.assert_allclose(misfit(ALIKE[:2], u=u, w=w).many(points), expected, rtol=1e-12)


def test_more_diameters_do_not_make_the_machine_known() -> None:
    """All diameters alike and next to no other error: 1.96 √(J⁻¹(uuᵀ + wwᵀ)J⁻ᵀ)ⱼⱼ, of one diameter as of five."""
    u, w = np.tile(U[:2], 5), np.tile(W[:2], 5)
    inverse = np.linalg.inv(ALIKE[:2])
    floor = stats.norm.ppf(0.975) * np.hypot(inverse @ U[:2], inverse @ W[:2])
    for count in (2, 10):
        found = misfit(ALIKE[:count], u=u, w=w, sd=np.full(10, 0.01))
        np.testing.assert_allclose(half_widths(found), floor, rtol=1e-3)


def test_what_is_told_of_the_machine_is_that_of_a_fit_with_it_as_a_parameter() -> None:
    """Least squares over (x, z) with a row z = 0 ± 1 for each of u and w."""
    x = best_fit(misfit(APART), REGION)
    rows = np.vstack([np.column_stack([APART, U, W]) / SD[:, None], np.eye(4)[2:]])
    solution = np.linalg.lstsq(rows, np.append((MEASURED - 100.0) / SD, [0.0, 0.0]), rcond=None)[0]
    spread = np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    for i, name in enumerate(("stiffness", "toe"), 2):
        assert misfit(APART).told_of(name, x) == pytest.approx((solution[i], spread[i]), rel=1e-4)
    assert misfit(APART).told_of("speed", x) is None


def test_the_likelihood_has_the_whole_covariance() -> None:
    """Of each diameter a covariance matrix, estimated from so many specimens that it is known."""
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 2))
    found = misfit(APART, 10**6).log_likelihood(points)
    gap = MEASURED - 100.0 - points @ APART.T
    known = stats.multivariate_normal(np.zeros(10), covariance()).logpdf(gap)
    np.testing.assert_allclose(found - found[0], known - known[0], rtol=2e-3, atol=0.02)
