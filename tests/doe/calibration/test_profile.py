"""Profile likelihood: exact on straight lines, honest about what is free, right coverage."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import exact, region, surfaces

from stemcal.doe.calibration.misfit import Observation, best_fit, misfit_of
from stemcal.doe.calibration.profile import holds, profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.surface import Surface, fit_surface

TRUTH = np.array([0.3, -0.2])
BOX = Region(np.full(2, -2.0), np.full(2, 2.0), None)


def line(a: float, b: float) -> Surface:
    coded = central_composite(2, 1, "rotatable")
    return fit_surface(coded, [100.0 + a * x + b * y for x, y in coded], ["a", "b"])


def test_straight_lines_give_the_textbook_interval() -> None:
    """ŷ₁ = 100 + 20a, ŷ₂ = 100 + 10b with sd 2 and 3: a = ±1.96·2/20, b = ±1.96·3/10 about the middle."""
    data = misfit_of([Observation(line(20, 0), 110.0, 2.0, 1), Observation(line(0, 10), 105.0, 3.0, 1)])
    a, b = profiles_of(data, BOX, best_fit(data, BOX))
    assert (a.low, a.high) == pytest.approx((0.5 - 0.196, 0.5 + 0.196), abs=1e-4)
    assert (b.low, b.high) == pytest.approx((0.5 - 0.588, 0.5 + 0.588), abs=1e-4)
    assert a.bounded == b.bounded == (True, True)
    assert a.share == pytest.approx(0.392 / 4, abs=1e-4)


def test_unknown_scale_gives_the_t_interval_of_regression() -> None:
    """Four measurements of 100·(1 + a/10) at equal weight: a/10 is their relative mean, t with 3 df.

    Both factors count as fixed by the data, so df = 4 − 2 = 2 and t = 4.303.
    """
    measured = [100.0, 102.0, 104.0, 106.0]
    lines = [line(10, 0), line(10, 0), line(10, 0), line(10, 0)]
    data = misfit_of([Observation(s, y) for s, y in zip(lines, measured, strict=True)])
    assert data.scatter == "misfit"
    (a, b) = profiles_of(data, BOX, best_fit(data, BOX))
    # weights 1/y²; exact weighted line through the origin of 100/y − 1 + (10/y)·a
    y = np.array(measured)
    slope, right = 10.0 / y, 1.0 - 100.0 / y
    centre = float(slope @ right / (slope @ slope))
    error = float(np.sqrt(((right - slope * centre) ** 2).sum() / 2 / (slope @ slope)))
    assert (a.low, a.high) == pytest.approx((centre - 4.3027 * error, centre + 4.3027 * error), abs=1e-4)
    assert b.free and b.share == pytest.approx(1.0)


def test_one_force_leaves_the_other_factor_free() -> None:
    data = misfit_of([Observation(line(20, 2), 110.0, 1.0, 1)])
    a, b = profiles_of(data, BOX, best_fit(data, BOX))
    assert b.free and not a.free
    assert (a.low, a.high) == pytest.approx((0.3 - 0.098, 0.7 + 0.098), abs=1e-4)  # b from −2 to 2 moves a by ∓0.2


def test_sphere_and_single_factor() -> None:
    ball = Region(np.full(2, -2.0), np.full(2, 2.0), 0.6)
    data = misfit_of([Observation(line(20, 2), 110.0, 1.0, 1)])
    a, b = profiles_of(data, ball, best_fit(data, ball))
    assert a.high == pytest.approx(0.5988, abs=2e-3) and -0.6 <= b.low < b.high <= 0.6
    coded = np.array([[-1.0], [-0.5], [0.0], [0.5], [1.0]])
    single = fit_surface(coded, 100.0 + 10.0 * coded[:, 0], ["a"])
    one = misfit_of([Observation(single, 105.0, 1.0, 1)])
    box = Region(np.array([-1.0]), np.array([1.0]), None)
    (profile,) = profiles_of(one, box, best_fit(one, box))
    assert (profile.low, profile.high) == pytest.approx((0.304, 0.696), abs=1e-4)


def test_few_specimens_give_the_t_interval() -> None:
    """ŷ = 100 + 20a, two means of three: sd 2 of 110 and 4 of 110, pooled (4 + 16)/2 = 10 with 4 df.

    Welch: the mean of both has (4/3 + 16/3)/4, Satterthwaite's df (4 + 16)²/((16 + 256)/2) = 2.941, t = 3.220, so that
    a = 0.5 ± 3.220·√(10/3/2)/20, and b = 0 with D = 0: the misfit says nothing against it.
    """
    data = misfit_of([Observation(line(20, 0), 110.0, 2.0, 3), Observation(line(20, 0), 110.0, 4.0, 3)])
    assert data.scale_df == pytest.approx(4.0, rel=1e-6)
    a, _ = profiles_of(data, BOX, best_fit(data, BOX))
    assert (a.low, a.high) == pytest.approx((0.5 - 0.20777, 0.5 + 0.20777), abs=1e-4)
    assert holds(data, BOX, np.array([0.287, 0.0])) == [False, True]
    assert holds(data, BOX, np.array([0.297, 0.0])) == [True, True]


def test_a_value_without_sd_beside_others_takes_theirs() -> None:
    """cv 0.02 of five specimens: 4 df; the other mean of 220 has (4.4)²/2."""
    data = misfit_of([Observation(line(20, 0), 110.0, 2.2, 5), Observation(line(10, 5), 220.0, None, 2)])
    assert data.variance == pytest.approx([2.2**2 / 5, 4.4**2 / 2]) and data.scale_df == pytest.approx(4.0, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, 6])
def test_coverage_of_profile_intervals(n: int) -> None:
    """400 laboratories of n specimens at five diameters: 93 to 97 % of the 95 % intervals hold the truth."""
    fitted, rng, sd = surfaces(), np.random.default_rng(7), 0.03
    middle = exact(fitted, TRUTH)
    held = np.zeros(2)
    for _ in range(400):
        broken = middle[:, None] * (1.0 + sd * rng.standard_normal((5, n)))
        told = zip(fitted, broken.mean(axis=1), broken.std(axis=1, ddof=1), strict=True)
        data = misfit_of([Observation(surface, m, s, n) for surface, m, s in told])
        held += holds(data, region(), TRUTH)
    assert np.all((held / 400 >= 0.93) & (held / 400 <= 0.97)), held / 400
