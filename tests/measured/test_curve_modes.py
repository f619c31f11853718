"""Curves as a few numbers: what is the same however they are sampled, and what their scatter is.

The planted curve is F(u) = F* (1 − (1 − u/u*)^m) up to u* = its travel, then nothing.
"""

import numpy as np
import pytest

from stemcal.measured.curve_modes import Curve, from_preload, modes_of, without_noise

RANDOM = np.random.default_rng(5)
SHAPES = [(180.0 + 10.0 * a, 0.7 + 0.05 * b, 2.0 + 0.3 * c) for a, b, c in RANDOM.standard_normal((12, 3))]


def planted(force: float, travel: float, power: float, points: int = 400) -> Curve:
    u = np.linspace(0.0, travel, points)
    f = force * (1.0 - (1.0 - u / travel) ** power)
    return np.append(u, travel + 0.01), np.append(f, 0.0)


def trimmed(curve: Curve) -> Curve:
    """Return a curve from where it passes 5 N, as the laboratory's are read."""
    travel, force = curve
    begin = int(np.flatnonzero(force <= 5.0)[:-1][-1])
    return travel[begin:] - travel[begin], force[begin:]


CURVES = [without_noise(*trimmed(planted(*shape))) for shape in SHAPES]


def scores_of(curves: list[Curve], stiffness: float | None = None) -> np.ndarray:
    modes = modes_of(curves, stiffness)
    return np.array([modes.scores(*curve) for curve in curves])


def test_scores_lie_about_the_mean_force_and_vary_with_nothing_else() -> None:
    """Mean F̄; no correlation with the maximum nor with each other; their SD over the specimens is that of the modes."""
    modes, scores = modes_of(CURVES), scores_of(CURVES)
    forces = np.array([force.max() for _, force in CURVES])
    np.testing.assert_allclose(forces, [force for force, _, _ in SHAPES], rtol=0.002)
    assert modes.force == pytest.approx(forces.mean(), rel=1e-9)
    np.testing.assert_allclose(scores.mean(axis=0), forces.mean(), rtol=1e-9)
    together = np.corrcoef(np.column_stack([forces, scores]).T)
    np.testing.assert_allclose(together, np.eye(1 + scores.shape[1]), atol=1e-9)
    np.testing.assert_allclose(modes.scatter, scores.std(axis=0, ddof=1), rtol=1e-9)


def test_two_ways_to_differ_beside_the_maximum_are_two_modes() -> None:
    """Travel and shape; the third direction is what is not linear in them."""
    modes = modes_of(CURVES)
    assert len(modes.weights) == 2
    np.testing.assert_allclose(np.array(modes.weights) @ np.array(modes.weights).T, np.eye(2), atol=1e-12)


def test_twice_the_points_say_no_more() -> None:
    fine = [without_noise(*trimmed(planted(*shape, points=799))) for shape in SHAPES]
    np.testing.assert_allclose(modes_of(fine).scatter, modes_of(CURVES).scatter, rtol=0.02)
    np.testing.assert_allclose(modes_of(fine).force, modes_of(CURVES).force, rtol=1e-4)


@pytest.mark.parametrize("noise", [0.5, 2.0])
def test_noise_at_the_points_does_not_raise_the_maximum(noise: float) -> None:
    """Of 400 points with noise the largest is 1.2 or 1.5 SD of it too high; of the smoothed curve it is not."""
    random = np.random.default_rng(8)
    raw, smooth = [], []
    for _ in range(100):
        travel, force = planted(180.0, 0.7, 2.0)
        noisy = force + noise * random.standard_normal(len(force))
        raw.append(noisy.max() - 180.0)
        smooth.append(without_noise(travel, noisy)[1].max() - 180.0)
    assert np.mean(raw) > 1.2 * noise
    assert abs(np.mean(smooth)) < 0.4 * noise


def test_a_curve_that_breaks_at_its_maximum_keeps_it() -> None:
    """A quadratic is its own smoothed curve; the fall behind the maximum is no part of it."""
    travel, force = planted(180.0, 0.7, 2.0)
    np.testing.assert_allclose(without_noise(travel, force)[1], force, atol=1e-9)


@pytest.mark.parametrize("noise", [0.0, 0.5])
@pytest.mark.parametrize("offset", [-0.5, 0.5, 2.0])
def test_the_way_through_the_air_is_not_smoothed_over(offset: float, noise: float) -> None:
    """However long it is, and whatever little the sensor reads there, the curve is that of one that begins at touch."""
    travel, force = planted(180.0, 0.7, 2.0)
    before = np.arange(0.0, 5.0, travel[1])
    noisy = offset + noise * np.random.default_rng(3).standard_normal(len(before) + len(force))
    late = np.append(before, travel + before[-1] + travel[1]), np.append(np.zeros_like(before), force) + noisy
    touch = travel, force + noisy[len(before) :]
    (far, strong), (near, plain) = (from_preload(*without_noise(*curve)) for curve in (late, touch))
    assert strong.max() == pytest.approx(plain.max(), abs=0.05)
    assert strong.max() == pytest.approx(180.0 + offset, abs=0.5)
    ends = [float(np.interp(170.0, f[:300], u[:300])) for u, f in ((far, strong), (near, plain))]
    assert ends[0] == pytest.approx(ends[1], abs=travel[1])


def test_a_curve_trimmed_already_begins_a_step_earlier_at_most() -> None:
    """Its first two rows, 6.00 and 6.01 N, would have it begin a hundred steps earlier."""
    travel = np.linspace(0.0, 1.0, 101)
    force = np.append([6.0, 6.01], 6.0 + 100.0 * travel[2:])
    begun, _ = from_preload(travel, force)
    np.testing.assert_allclose(begun[1:], travel + travel[1])


def test_a_curve_begins_where_it_passes_the_preload() -> None:
    """A straight line of 100 N/mm, from rows on either side of 5 N or from the first above it: 0.05 mm."""
    travel = np.linspace(0.0, 1.0, 31)
    for first in (0, 2):
        begun, force = from_preload(travel[first:], 100.0 * travel[first:])
        assert (begun[0], force[0]) == (0.0, 5.0)
        np.testing.assert_allclose(begun[1:] + 0.05, travel[2:], atol=1e-12)


def test_the_known_give_of_the_machine_is_taken_out() -> None:
    soft = [(travel + (force - force[0]) / 1500.0, force) for travel, force in CURVES]
    known = modes_of(soft, 1500.0)
    np.testing.assert_allclose(known.weights, modes_of(CURVES).weights, atol=1e-5)
    np.testing.assert_allclose(known.scatter, modes_of(CURVES).scatter, rtol=1e-4)
    assert modes_of(soft).travel > known.travel + 0.1


def test_scores_do_not_vary_together() -> None:
    modes = modes_of(CURVES)
    scores = np.array([modes.scores(*curve) for curve in CURVES])
    np.testing.assert_allclose(np.corrcoef(scores.T), np.eye(len(modes.weights)), atol=0.02)


def test_few_specimens_have_few_modes() -> None:
    assert len(modes_of(CURVES[:5]).weights) == 2
    assert len(modes_of(CURVES[:6]).weights) == 2


def test_the_band_is_that_of_the_forces() -> None:
    modes = modes_of(CURVES)
    travel, mean, sd = modes.band
    assert travel[-1] == pytest.approx(modes.travel)
    assert mean[-1] == pytest.approx(0.95 * modes.force, rel=0.002)
    assert sd[-1] == pytest.approx(0.95 * np.std([force for force, _, _ in SHAPES], ddof=1), rel=0.02)
    again = np.mean([modes.at_shares(*curve) for curve in CURVES], axis=0)
    np.testing.assert_allclose(again, mean, rtol=1e-9)
