"""Several diameters at once: the known point is found, left-out diameters are predicted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import DIAMETERS, exact, misfit, region, surfaces

from stemcal.doe.calibration.contradiction import allowed_by_others
from stemcal.doe.calibration.joint_fit import best_worst_error, fit_jointly, leave_one_out
from stemcal.doe.calibration.misfit import Observation, best_fit, misfit_of
from stemcal.doe.calibration.profile import allowed_rise
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.errors import UsageError

TRUTH = np.array([0.6, -0.4])


def test_finds_the_known_parameters() -> None:
    fitted = surfaces()
    fit = fit_jointly(misfit(exact(fitted, TRUTH), 0.05, fitted=fitted), region())
    assert fit.coded == pytest.approx(TRUTH, abs=1e-5)
    assert fit.max_abs_error_percent < 1e-3 and fit.df == 3 and fit.p_value == pytest.approx(1.0)


def test_left_out_diameters_are_predicted_exactly_where_the_model_is_right() -> None:
    fitted = surfaces()
    assert leave_one_out(misfit(exact(fitted, TRUTH), 0.05, fitted=fitted), region()) == pytest.approx(
        [0] * 5, abs=1e-2
    )


def test_a_left_out_outlier_shows_as_its_own_error() -> None:
    """All but 11 mm are exact, so without 11 mm the truth is found and 11 mm misses by what was added."""
    fitted = surfaces()
    measured = exact(fitted, TRUTH)
    measured[4] *= 1.25
    errors = leave_one_out(misfit(measured, 0.05, fitted=fitted), region())
    assert errors[4] == pytest.approx(100.0 * 0.25 / 1.25, abs=1e-2)


def test_weights_follow_the_measured_scatter() -> None:
    """Two straight lines that contradict: ŷ₁ = 100 + 10a = 105 (sd 1) and 115 (sd 3). Weighted mean a = 0.6."""
    coded = central_composite(2, 1, "rotatable")
    line = fit_surface(coded, [100 + 10 * a for a, _ in coded], ["a", "b"])
    pair = [Observation(line, 105.0, 1.0, 1), Observation(line, 115.0, 3.0, 1)]
    fit = fit_jointly(misfit_of(pair), Region(np.full(2, -2.0), np.full(2, 2.0), None))
    assert fit.coded[0] == pytest.approx((0.5 * 9 + 1.5) / 10, abs=1e-6)


def test_scatter_by_what_is_known() -> None:
    fitted = surfaces()
    measured = exact(fitted, TRUTH)
    full = misfit(measured, 0.05, fitted=fitted)
    assert full.scatter == "measured"
    assert np.sqrt(full.variance) == pytest.approx(0.05 * measured / np.sqrt(6), rel=0.05)
    assert misfit(measured, None, fitted=fitted).scatter == "misfit"
    alone = misfit_of([Observation(fitted[1], 159.2)])
    assert alone.scatter == "surface" and alone.scale_known
    some = [Observation(fitted[1], 100.0, 5.0, 1), Observation(fitted[2], 200.0, None, 1)]
    pooled = misfit_of(some)
    assert pooled.scatter == "pooled" and np.sqrt(pooled.variance[1]) == pytest.approx(10.0, rel=0.02)
    assert misfit(measured, None, fitted=fitted).without(0).scatter == "misfit"


@pytest.mark.parametrize(("cubic", "counts"), [(0.0, False), (4.0, True)])
def test_a_lack_of_fit_counts_where_all_diameters_together_show_one(cubic: float, counts: bool) -> None:
    """Of five surfaces of a plane and noise three show one by themselves, p < 0.25; all of x₀²x₁ do."""
    design, random = np.repeat(central_composite(2, 1, "face"), 3, axis=0), np.random.default_rng(4)
    true = 100.0 + design @ [10.0, 3.0] + cubic * design[:, 0] ** 2 * design[:, 1]
    fitted = [fit_surface(design, true + random.normal(0.0, 1.0, len(true)), ["a", "b"]) for _ in DIAMETERS]
    alone = [s.mean_error.missed > 0.0 for s in fitted if s.mean_error]
    found = misfit_of([Observation(s, 100.0, 5.0, 6) for s in fitted]).observations
    assert sum(alone) == (5 if counts else 3)
    for before, after in zip(fitted, found, strict=True):
        s2, h = before.mean_square or 0.0, before.unscaled_variance(design)
        expected = before.mean_variance(design) if counts else s2 * h
        assert after.surface.mean_variance(design) == pytest.approx(expected)


def test_gradient_is_the_slope_of_the_misfit() -> None:
    fitted = surfaces()
    d = misfit(exact(fitted, TRUTH) * 1.1, 0.05, fitted=fitted)
    x, h = np.array([0.3, -0.7]), 1e-6
    slopes = [(d.value(x + h * e) - d.value(x - h * e)) / (2 * h) for e in np.eye(2)]
    assert d.gradient(x) == pytest.approx(slopes, rel=1e-6)


def test_best_worst_error_is_the_known_one() -> None:
    """Flat surfaces that differ by the factor 1.5 in measured/simulated: the best compromise misses by 20 %.

    With r = simulated/measured of 1 and 1.5 times a common factor, (max r − min r)/(max r + min r) = 0.5/2.5.
    """
    coded = central_composite(2, 1, "rotatable")
    line = fit_surface(coded, [100 + 30 * a for a, _ in coded], ["a", "b"])
    pair = [Observation(line, 100.0, 1.0, 1), Observation(line, 150.0, 1.0, 1)]
    for radius in (None, 2.0):
        worst, x = best_worst_error(misfit_of(pair), Region(np.full(2, -2.0), np.full(2, 2.0), radius))
        assert worst == pytest.approx(20.0, abs=1e-4)
        assert line.predict(x)[0] == pytest.approx(120.0, abs=1e-3)


def test_the_fit_stays_inside_the_region() -> None:
    fitted = surfaces()
    far = misfit(exact(fitted, np.array([4.0, 4.0])), 0.05, fitted=fitted)
    ball = Region(np.full(2, -2.0), np.full(2, 2.0), 1.0)
    assert np.linalg.norm(best_fit(far, ball)) == pytest.approx(1.0, abs=1e-6)


def test_surfaces_must_have_the_same_factors() -> None:
    coded = central_composite(2, 1, "rotatable")
    other = fit_surface(coded, coded[:, 0] + 5.0, ["b", "a"])
    with pytest.raises(UsageError, match="same factors"):
        misfit_of([Observation(surfaces()[0], 1.0), Observation(other, 1.0)])
    assert len(DIAMETERS) == 5


def test_one_alone_takes_the_scatter_that_all_have_told() -> None:
    """Relative variance of one: least misfit over its degrees of freedom, and F in place of χ² in its interval."""
    fitted = surfaces()
    data = misfit(exact(fitted, TRUTH) * [1.0, 1.02, 0.97, 1.01, 0.99], None, fitted=fitted)
    least = data.value(best_fit(data, region()))
    single = data.alone(1, least)
    assert single.scatter == "joint" and single.scale_df == 3
    assert single.variance[0] == pytest.approx(least / 3 * single.measured[0] ** 2)
    assert allowed_rise(single, 0.0) == pytest.approx(10.128, abs=1e-3)
    known = misfit(exact(fitted, TRUTH), 0.05, fitted=fitted)
    assert known.alone(1, 5.0).variance == pytest.approx(known.variance[1:2])


def test_the_others_allow_a_left_out_mean_what_linear_theory_says() -> None:
    """y = x₁, x₂ and x₁ + x₂ with SDs of 1, 1 and 3: the first two allow the third's mean 0 ± 1.96 √(2 + 9)."""
    runs = central_composite(2, 3, "rotatable")
    means = []
    for beta, sd in (((1.0, 0.0), 1.0), ((0.0, 1.0), 1.0), ((1.0, 1.0), 3.0)):
        surface = fit_surface(runs, list(100.0 + runs @ np.array(beta)), ["a", "b"])
        means.append(Observation(surface, 100.0, sd, None))
    far = Region(np.full(2, -50.0), np.full(2, 50.0), None)
    found = misfit_of(means, far)
    low, high = allowed_by_others(found, far, ["first", "second", "third"])[2]
    half = 1.96 * 11.0**0.5
    assert (low - 100.0, high - 100.0) == (pytest.approx(-half, rel=0.01), pytest.approx(half, rel=0.01))
    grouped = allowed_by_others(found, far, ["a", "b", "b"])[2]  # the first alone leaves the second free
    assert grouped[1] - grouped[0] > 90.0
    inside, random = [], np.random.default_rng(8)
    for _ in range(100):
        drawn = (replace(o, measured=float(random.normal(100.0, o.sd))) for o in found.observations)
        study = replace(found, observations=tuple(drawn))
        each = allowed_by_others(study, far, ["first", "second", "third"])
        inside += [low < o.measured < high for o, (low, high) in zip(study.observations, each, strict=True)]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.03)  # of tests that agree
