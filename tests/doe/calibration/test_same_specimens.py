"""Several responses of the same specimens: one covariance matrix, estimated from n of them.

Planted: surfaces without error, y = y₀ + Jx, so that what C. R. Rao has for growth curves is exact. Uncorrelated as the
scores of curves are: S = diag(s²).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t

from stemcal.doe.calibration.misfit import Misfit, Observation, best_fit, misfit_of
from stemcal.doe.calibration.profile import allowed_rises, profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.composite import central_composite
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import fit_surface
from stemcal.errors import UsageError

REGION = Region(np.full(2, -20.0), np.full(2, 20.0), None)
RUNS = central_composite(2, centre_points=1)
J = np.array([[10.0, 2.0], [1.0, 8.0], [4.0, -5.0], [3.0, 1.0]])
MEASURED = np.array([104.0, 97.0, 101.0, 95.0])
SD = np.array([9.0, 6.0, 7.0, 4.0])
N = 9


def fitted(responses: int, systematic: Array = np.zeros((0, 4))) -> Misfit:
    surfaces = [fit_surface(RUNS, 100.0 + RUNS @ J[i], ("x", "y")) for i in range(responses)]
    rows = zip(surfaces, MEASURED, SD, strict=False)
    alike = [{f"m{k}": u[i] for k, u in enumerate(systematic)} for i in range(responses)]
    return misfit_of([Observation(*row, N, f"r{i}", "8", alike[i]) for i, row in enumerate(rows)])


@pytest.mark.parametrize("p", [2, 3, 4])
def test_an_interval_is_that_of_a_growth_curve(p: int) -> None:
    """θ̂ ± t(n − 1 − p + k)·√((n − 1)/(n − 1 − p + k)·(1 + T²/(n − 1))·Cⱼⱼ/n), T² of what the fit leaves."""
    misfit = fitted(p)
    j, gap = J[:p], (MEASURED - 100.0)[:p]
    c = np.linalg.inv(j.T @ (j / SD[:p, None] ** 2))
    solution = c @ j.T @ (gap / SD[:p] ** 2)
    left = N * float(np.sum(((gap - j @ solution) / SD[:p]) ** 2))
    df = N - 1 - p + 2
    half = t.ppf(0.975, df) * np.sqrt((N - 1) / df * (1.0 + left / (N - 1)) * np.diag(c) / N)
    found = profiles_of(misfit, REGION, best_fit(misfit, REGION))
    np.testing.assert_allclose([one.low for one in found], solution - half, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose([one.high for one in found], solution + half, rtol=1e-4, atol=1e-4)


def test_intervals_of_several_diameters_hold_the_truth() -> None:
    """Five covariance matrices, each of ten specimens of its own. Without what they give too much weight: 91 %."""
    random, held = np.random.default_rng(9), []
    plane = fit_surface(RUNS, 100.0 + RUNS @ J[0], ("x", "y"))
    for _ in range(600):
        observed = []
        for group in range(5):
            specimens = random.standard_normal((10, 4)) * SD
            values, axes = np.linalg.eigh(np.cov(specimens.T))
            j, mean = axes.T @ np.roll(J, group, axis=0), axes.T @ specimens.mean(axis=0)
            for i in range(4):
                surface = replace(plane, beta=np.array([100.0, *j[i], 0.0, 0.0, 0.0]))
                observed.append(Observation(surface, 100.0 + mean[i], values[i] ** 0.5, 10, f"r{i}", str(group)))
        misfit = misfit_of(observed)
        spread = np.linalg.inv(misfit.information(np.zeros(2)))
        best = -0.5 * spread @ misfit.gradient(np.zeros(2))
        held.append(best**2 / np.diag(spread) <= allowed_rises(misfit, best))
    assert 0.935 < np.mean(held) < 0.97


def test_fewer_of_the_responses_are_known_better() -> None:
    """What is left of four responses is the same as if two had been measured."""
    whole, two = fitted(4).only([0, 1]), fitted(2)
    ends = [[(one.low, one.high) for one in profiles_of(m, REGION, best_fit(m, REGION))] for m in (whole, two)]
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-6)


def test_the_likelihood_is_that_of_an_unknown_covariance() -> None:
    """(1 + T²(x)/(n − 1))^(−n/2)."""
    points = np.array([[0.0, 0.0], [1.0, -1.0], [3.0, 2.0]])
    gap = MEASURED - 100.0 - points @ J.T
    squares = N * np.sum((gap / SD) ** 2, axis=1)
    expected = -0.5 * N * np.log1p(squares / (N - 1))
    found = fitted(4).log_likelihood(points)
    np.testing.assert_allclose(found - found[0], expected - expected[0], rtol=1e-6)


def test_what_moves_all_specimens_alike_is_not_averaged_away() -> None:
    """With p = k and an error of all alike far above the scatter: ± 1.96 of it, whatever n."""
    misfit = fitted(2, 50.0 * np.eye(4))
    half = 1.96 * 50.0 * np.sqrt(np.diag(np.linalg.inv(J[:2].T @ J[:2])))
    found = profiles_of(misfit, REGION, best_fit(misfit, REGION))
    np.testing.assert_allclose([0.5 * (one.high - one.low) for one in found], half, rtol=0.01)


def test_a_response_of_which_the_machine_tells_nothing_is_as_if_not_measured() -> None:
    """The fourth, moved by the machine by 10⁵: the intervals are those of a growth curve of three."""
    misfits = fitted(4, 1e5 * np.eye(4)[3:]), fitted(3)
    ends = [[(one.low, one.high) for one in profiles_of(m, REGION, best_fit(m, REGION))] for m in misfits]
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-4)


def test_specimens_that_are_not_the_same_keep_their_scatter_apart() -> None:
    """A force with specimens of its own beside scores of others: two sources, each with its degrees of freedom."""
    surfaces = [fit_surface(RUNS, 100.0 + RUNS @ row, ("x", "y")) for row in J[:3]]
    force = Observation(surfaces[0], 104.0, 9.0, 30, "force")
    scores = [Observation(s, 100.0, 6.0, N, f"curve_{i}", "8") for i, s in enumerate(surfaces[1:], 1)]
    sources = [source for source in misfit_of([force, *scores]).sources if source.name == "laboratory"]
    assert [(source.df, source.matrix) for source in sources] == [(29.0, False), (N - 2, True)]
    np.testing.assert_allclose(sources[0].variance, [81.0 / 30, 0.0, 0.0])
    np.testing.assert_allclose(sources[1].variance, [0.0, *[36.0 * 8 / (7 * N)] * 2])


def test_as_many_responses_as_specimens_are_refused() -> None:
    surfaces = [fit_surface(RUNS, 100.0 + RUNS @ row, ("x", "y")) for row in J[:3]]
    with pytest.raises(UsageError, match="3 specimens do not tell how 3 responses vary together; 4 do"):
        misfit_of([Observation(s, 100.0, 6.0, 3, f"r{i}", "8") for i, s in enumerate(surfaces)])
