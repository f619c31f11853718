"""Curves as a few numbers: what is the same however they are sampled, and what their scatter is.

The planted curve is F(u) = F* (1 − (1 − u/u*)^m) up to u* = its travel, then nothing.
"""

from __future__ import annotations

import numpy as np
import pytest

from stemcal.measured.curve_modes import Curve, Machine, modes_of

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


CURVES = [trimmed(planted(*shape)) for shape in SHAPES]


def scores_of(curves: list[Curve], machine: Machine = Machine()) -> np.ndarray:
    modes = modes_of(curves, machine)
    return np.array([modes.scores(*planted(*shape)) for shape in SHAPES])


def test_scores_lie_about_the_mean_force_and_vary_with_nothing_else() -> None:
    """Mean F̄; no correlation with the maximum nor with each other; their SD is that of the modes, without the widening.

    Twelve specimens tell a scatter of m = 10 degrees of freedom in three directions: variance 10/8 of rᵀr/10.
    """
    modes, scores = modes_of(CURVES), scores_of(CURVES)
    forces = np.array([force for force, _, _ in SHAPES])
    assert modes.force == pytest.approx(forces.mean(), rel=1e-9)
    np.testing.assert_allclose(scores.mean(axis=0), forces.mean(), rtol=1e-9)
    together = np.corrcoef(np.column_stack([forces, scores]).T)
    np.testing.assert_allclose(together, np.eye(1 + scores.shape[1]), atol=1e-9)
    squares = ((scores - forces.mean()) ** 2).sum(axis=0)
    np.testing.assert_allclose(np.square(modes.scatter), squares / 8.0, rtol=1e-9)


def test_two_ways_to_differ_beside_the_maximum_are_two_modes() -> None:
    """Travel and shape; the third direction is what is not linear in them."""
    modes = modes_of(CURVES)
    assert len(modes.weights) == 2
    np.testing.assert_allclose(np.array(modes.weights) @ np.array(modes.weights).T, np.eye(2), atol=1e-12)


def test_twice_the_points_say_no_more() -> None:
    fine = [trimmed(planted(*shape, points=799)) for shape in SHAPES]
    np.testing.assert_allclose(modes_of(fine).scatter, modes_of(CURVES).scatter, rtol=0.02)
    np.testing.assert_allclose(modes_of(fine).force, modes_of(CURVES).force, rtol=1e-12)


def test_the_known_give_of_the_machine_is_taken_out() -> None:
    soft = [(travel + (force - force[0]) / 1500.0, force) for travel, force in CURVES]
    known = modes_of(soft, Machine(stiffness=1500.0))
    np.testing.assert_allclose(known.weights, modes_of(CURVES).weights, atol=1e-9)
    np.testing.assert_allclose(known.scatter, modes_of(CURVES).scatter, rtol=1e-9)
    assert modes_of(soft).travel > known.travel + 0.1


def test_what_is_not_known_of_the_machine_moves_all_specimens_alike() -> None:
    """A toe of a known SD: however many specimens there are, the mean is not known better than it lets."""
    toe = Machine(toe_sd=0.05)
    few, many = modes_of(CURVES, toe), modes_of(CURVES * 8, toe)
    without = modes_of(CURVES * 8)
    errors = [modes.scatter[0] / np.sqrt(modes.specimens) for modes in (few, many, without)]
    assert errors[1] > 0.8 * errors[0]
    assert errors[2] < 0.5 * errors[0]
    # all travels longer by 0.05 mm: the first score is off by about one standard error of the mean
    late = [modes_of(CURVES * 8, toe).scores(u + np.where(u > 0.0, 0.05, 0.0), f)[0] for u, f in map(_bare, SHAPES)]
    off = abs(np.mean(late) - many.force) / errors[1]
    assert 0.7 < off < 1.4


def _bare(shape: tuple[float, float, float]) -> Curve:
    return trimmed(planted(*shape))


def test_a_stiffness_of_little_use_widens_as_its_spread_says() -> None:
    soft = [(travel + (force - force[0]) / 1500.0, force) for travel, force in CURVES]
    known = modes_of(soft, Machine(1500.0, 0.0))
    unsure = modes_of(soft, Machine(1500.0, 300.0))
    assert sum(np.square(unsure.scatter)) > 1.5 * sum(np.square(known.scatter))


def test_few_specimens_have_few_modes() -> None:
    assert len(modes_of(CURVES[:5]).weights) == 1
    assert len(modes_of(CURVES[:6]).weights) == 2


def test_the_band_is_that_of_the_forces() -> None:
    modes = modes_of(CURVES)
    travel, mean, sd = modes.band
    assert travel[-1] == pytest.approx(modes.travel)
    assert mean[-1] == pytest.approx(0.98 * modes.force, rel=0.002)
    assert sd[-1] == pytest.approx(0.98 * np.std([force for force, _, _ in SHAPES], ddof=1), rel=0.02)
    again = np.mean([modes.at_shares(*planted(*shape)) for shape in SHAPES], axis=0)
    np.testing.assert_allclose(again, mean, rtol=1e-9)
