"""The posterior: normal where the theory says so, inside its priors, the same samples every time."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy import stats
from synthetic import exact, misfit, region, surfaces

from stemcal.doe.calibration.misfit import Observation, best_fit, misfit_of
from stemcal.doe.calibration.posterior import log_posterior, sample_posterior
from stemcal.doe.calibration.profile import profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import UsageError

TRUTH = np.array([0.3, -0.2])
BOX = Region(np.full(2, -2.0), np.full(2, 2.0), None)


def line(a: float, b: float) -> Surface:
    coded = central_composite(2, 1, "rotatable")
    return fit_surface(coded, [100.0 + a * x + b * y for x, y in coded], ["a", "b"])


def test_straight_lines_give_normal_posteriors() -> None:
    """a ~ N(0.5, 2/20), b ~ N(0.5, 3/10), independent."""
    pytest.importorskip("emcee")
    data = misfit_of([Observation(line(20, 0), 110.0, 2.0, 1), Observation(line(0, 10), 105.0, 3.0, 1)])
    found = sample_posterior(data, BOX)
    assert found.mean == pytest.approx([0.5, 0.5], abs=0.01)
    assert found.sd == pytest.approx([0.1, 0.3], rel=0.04)
    assert found.interval() == pytest.approx(np.array([[0.304, 0.696], [-0.088, 1.088]]), abs=0.03)
    assert abs(found.correlation[0, 1]) < 0.07 and found.effective > 1000 and found.length > 50


def test_one_force_leaves_a_uniform_prior_as_it_was() -> None:
    """ŷ = 100 + 20a knows nothing of b: uniform on ±2, sd 4/√12, 95 % within ±1.9."""
    pytest.importorskip("emcee")
    found = sample_posterior(misfit_of([Observation(line(20, 0), 110.0, 2.0, 1)]), BOX)
    assert found.sd[1] == pytest.approx(4 / np.sqrt(12), rel=0.03)
    assert found.interval()[1] == pytest.approx([-1.9, 1.9], abs=0.05)
    assert np.all(np.abs(found.samples) <= 2.0)


def test_unknown_scale_gives_t() -> None:
    """With the scale integrated out the density is D^(−m/2): ratios of densities are powers of ratios of D."""
    measured = exact(surfaces(), TRUTH) * [1.0, 1.02, 0.99, 1.01, 0.98]
    data = misfit(measured, None)
    points = np.array([[0.1, 0.2], [0.5, -0.4], [9.0, 0.0]])
    logs = log_posterior(data, region(), points)
    d = data.many(points)
    assert logs[0] - logs[1] == pytest.approx(-2.5 * np.log(d[0] / d[1])) and logs[2] == -np.inf


def test_few_specimens_give_t() -> None:
    """Six specimens: 5 degrees of freedom of sd behind one mean, the density (1 + D/5)^(−3) is Student's t."""
    data = misfit_of([Observation(line(20, 0), 110.0, 2.0, 6)])
    points = np.array([[0.5, 0.0], [0.7, 0.0]])
    logs = log_posterior(data, BOX, points)
    assert data.many(points) == pytest.approx([0.0, 24.0], abs=1e-6)  # (4/(2/√6))²
    assert logs[0] - logs[1] == pytest.approx(3.0 * np.log(1.0 + 24.0 / 5.0), rel=1e-6)


def test_surfaces_of_two_kinds_give_a_t_each() -> None:
    """A force and a travel taken as exact: the density is the product of Student's t of both surfaces, 3 df each."""
    random, coded = np.random.default_rng(3), central_composite(2, 1, "rotatable")
    fitted = [
        fit_surface(coded, coded @ slopes + 100.0 + error * random.standard_normal(len(coded)), ["a", "b"])
        for slopes, error in (([20.0, 0.0], 1.0), ([0.0, 10.0], 4.0))
    ]
    data = misfit_of([Observation(fitted[0], 108.0), Observation(fitted[1], 97.0, kind="travel")])
    points = np.random.default_rng(4).uniform(-0.5, 1.0, (60, 2))
    found = log_posterior(data, BOX, points)
    scale = [(s.mean_square * (1.0 + 6 / len(coded))) ** 0.5 for s in fitted if s.mean_square]
    gaps = np.array([108.0, 97.0]) - np.column_stack([s.predict(points) for s in fitted])
    known = stats.t.logpdf(gaps, fitted[0].df, scale=scale).sum(axis=1)
    near = known > known.max() - 4.0  # the mean over 256 draws is rough far out
    assert fitted[0].df == 3 and near.sum() > 10
    assert (found - found[near][0])[near] == pytest.approx((known - known[near][0])[near], abs=0.1)


def test_many_specimens_tell_each_diameter_its_own_scatter() -> None:
    """1000 of sd 20 and of sd 60: −D/2 with V = 0.4 and 3.6, not 2 each; pooled, 112 and 110 would weigh alike."""
    pairs = (112.0, 20.0), (110.0, 60.0)
    data = misfit_of([Observation(line(20, 0), mean, sd * mean / 111.0, 1000) for mean, sd in pairs])
    a = np.linspace(0.4, 0.75, 8)
    found = log_posterior(data, BOX, np.column_stack([a, np.zeros(8)]))
    known = -0.5 * sum((100.0 + 20.0 * a - mean) ** 2 / ((sd * mean / 111.0) ** 2 / 1000.0) for mean, sd in pairs)
    assert found - found[0] == pytest.approx(known - known[0], rel=0.06)  # 256 draws; pooled it is another curve


@pytest.mark.parametrize(("fifth", "between"), [(1.0, (0.95, 1.1)), (3.0, (1.05, 1.2))])
def test_how_alike_the_diameters_scatter_is_told_by_their_standard_deviations(fifth, between) -> None:
    """Four planes of sd 1 see a, one of sd 1 or 3 sees b alone: the fifth hardly widens a (by 1.6 if pooled)."""
    planes, own = [line(20, 0)] * 4 + [line(0, 20)], [1.0] * 4 + [fifth]
    data = misfit_of([Observation(p, 100.0, sd, 6) for p, sd in zip(planes, own, strict=True)])
    a = np.linspace(-0.2, 0.2, 161)
    density = np.exp(log_posterior(data, BOX, np.column_stack([a, np.zeros(161)])))
    sd = np.sqrt(np.sum(density * a**2) / density.sum())
    assert between[0] < sd / (1.0 / 20.0 / 24.0**0.5) < between[1]


def test_same_data_same_samples() -> None:
    pytest.importorskip("emcee")
    data = misfit_of([Observation(line(20, 5), 110.0, 2.0, 1)])
    first, second = (sample_posterior(data, BOX, steps=50, burn_in=10) for _ in range(2))
    assert np.array_equal(first.samples, second.samples)
    assert len(first.thinned(100)) == 100


def test_agrees_with_the_profile_where_both_are_sharp() -> None:
    pytest.importorskip("emcee")
    fitted = surfaces()
    data = misfit(exact(fitted, TRUTH), 0.03, fitted=fitted)
    profiles = profiles_of(data, region(), best_fit(data, region()))
    found = sample_posterior(data, region()).interval()
    for profile, (low, high) in zip(profiles, found, strict=True):
        width = profile.high - profile.low  # the profile's degrees of freedom are fewer: each diameter's own
        assert (low, high) == pytest.approx((profile.low, profile.high), abs=0.08 * width)


def test_without_emcee_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(UsageError, match=r'pip install "stemcal\[bayes\]"'):
        sample_posterior(misfit_of([Observation(line(20, 5), 110.0, 2.0, 1)]), BOX)


@pytest.mark.slow
def test_coverage_of_credible_intervals() -> None:
    """1000 laboratories of six specimens at five diameters: 93 to 97 % of the 95 % intervals hold the truth."""
    pytest.importorskip("emcee")
    fitted, rng, sd = surfaces(), np.random.default_rng(7), 0.03
    middle = exact(fitted, TRUTH)
    held = np.zeros(2)
    for _ in range(1000):
        broken = middle[:, None] * (1.0 + sd * rng.standard_normal((5, 6)))
        told = zip(fitted, broken.mean(axis=1), broken.std(axis=1, ddof=1), strict=True)
        data = misfit_of([Observation(surface, m, s, 6) for surface, m, s in told])
        low, high = sample_posterior(data, region(), steps=400, burn_in=100).interval().T
        held += (low <= TRUTH) & (high >= TRUTH)
    assert np.all((held / 1000 >= 0.93) & (held / 1000 <= 0.97)), held / 1000
