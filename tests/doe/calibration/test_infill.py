"""Batches proposed by a Gaussian process: its errors, the crossing it finds, and what it leaves possible."""

import numpy as np
import pytest

from stemcal.doe.calibration.infill import crossings, nearest_crossing, next_batch, possible
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.latin_hypercube import latin_hypercube
from stemcal.doe.regression.gaussian_process import fit_process

BOX = Region(np.full(2, -1.0), np.full(2, 1.0), None)


def step(x: np.ndarray) -> np.ndarray:
    """A force that rises in a step: F = 120 for a = 0.3 − 0.2·b, half-way between its plateaus."""
    return 120.0 + 60.0 * np.tanh(3.0 * (x[:, 0] - 0.3 + 0.2 * x[:, 1]))


def test_prediction_and_error_are_those_of_ordinary_kriging() -> None:
    """The best linear unbiased prediction by Lagrange's multiplier: [[K, 1], [1ᵀ, 0]]·[λ, m] = [k, 1]."""
    random = np.random.default_rng(4)
    design = random.uniform(-1, 1, (12, 2))
    process = fit_process(design, step(design))
    gaps = lambda a, b: np.exp(-0.5 * (((a[:, None] - b[None]) / process.scales) ** 2).sum(axis=2))  # noqa: E731
    covariance = gaps(process.design, process.design) + process.nugget * np.eye(12)
    whole = np.block([[covariance, np.ones((12, 1))], [np.ones((1, 12)), np.zeros((1, 1))]])
    points = random.uniform(-1, 1, (20, 2))
    k = gaps(process.design, points)
    weights = np.linalg.solve(whole, np.vstack([k, np.ones(20)]))
    assert process.predict(points) == pytest.approx(weights[:-1].T @ process.response, rel=1e-5)
    variance = 1.0 - np.sum(weights[:-1] * k, axis=0) - weights[-1]
    expected = np.sqrt(np.maximum(variance, 0.0) * process.variance * 12 / 11)
    assert process.standard_error(points) == pytest.approx(expected, rel=1e-3, abs=1e-3)


def test_gradient_by_differences() -> None:
    design = latin_hypercube(2, 15, 1)
    process, x = fit_process(design, step(design)), np.array([0.2, -0.4])
    shifted = [process.predict(x + e)[0] - process.predict(x - e)[0] for e in 1e-5 * np.eye(2)]
    assert process.gradient(x) == pytest.approx(np.array(shifted) / 2e-5, rel=1e-5)


def test_a_few_batches_find_the_step() -> None:
    """The nearest point to the centre of a = 0.3 − 0.2·b is (0.3, 0.06)/1.04; a quadratic through the runs misses."""
    design = latin_hypercube(2, 12, 3)
    forces = step(design)
    for _ in range(3):
        batch = next_batch(fit_process(design, forces), 120.0, BOX, 4)
        assert len(batch) == 4 and bool(np.all(BOX.contains(np.array(batch))))
        design = np.vstack([design, batch])
        forces = step(design)
    process = fit_process(design, forces)
    found = nearest_crossing(process, 120.0, BOX)
    assert found == pytest.approx(np.array([0.3, 0.06]) / 1.04, abs=0.03)
    assert step(found[None])[0] == pytest.approx(120.0, abs=1.0)
    low, high = possible(process, 120.0, BOX)[0]
    assert (low, high) == pytest.approx((0.1, 0.5), abs=0.05)


def test_most_of_a_batch_lies_where_the_target_may_be() -> None:
    design = latin_hypercube(2, 12, 3)
    batch = np.array(next_batch(fit_process(design, step(design)), 120.0, BOX, 6))
    near = np.abs(batch[:, 0] - 0.3 + 0.2 * batch[:, 1])
    assert np.median(near) < 0.25
    apart = np.linalg.norm(batch[:, None] - batch[None], axis=2)[np.triu_indices(6, 1)]
    assert apart.min() > 0.05


def test_a_target_out_of_reach_gives_the_nearest_force() -> None:
    design = latin_hypercube(2, 12, 3)
    process = fit_process(design, step(design))
    found = nearest_crossing(process, 400.0, BOX)
    assert process.predict(found)[0] >= process.predict(BOX.cloud(10)).max() - 1e-6


def test_an_error_of_nothing_raises_no_warning(recwarn: pytest.WarningsRecorder) -> None:
    """Where many runs lie on a plane the error is rounding: the distance to the target over it must not overflow."""
    design = latin_hypercube(2, 40, 2)
    batch = next_batch(fit_process(design, 100.0 + design @ np.array([3.0, 1.0])), 500.0, BOX, 3)
    assert batch and not [w for w in recwarn if issubclass(w.category, RuntimeWarning)]


def test_a_response_that_is_the_same_everywhere_raises_no_warning() -> None:
    """Its variance is rounding, of either sign; a RuntimeWarning of ours is an error in these tests."""
    for seed in range(8):
        design = np.random.default_rng(seed).uniform(-1.0, 1.0, (9, 2))
        process = fit_process(design, np.full(9, 5.0))
        assert 0.0 <= process.variance < 1e-20
        assert process.mean_interval(BOX.cloud(5)) == pytest.approx(5.0)


def test_every_branch_stays_possible() -> None:
    """F = 100 + 20·cos(2πa) is 100 N on four lines, a = ±0.25 and ±0.75; from the middle one looks across two."""
    design = latin_hypercube(2, 40, 5)
    ring = 100.0 + 20.0 * np.cos(2.0 * np.pi * design[:, 0])
    found = crossings(fit_process(design, ring), 100.0, BOX)
    branches = [found[np.abs(found[:, 0] - a) < 0.05] for a in (-0.75, -0.25, 0.25, 0.75)]
    assert all(len(branch) > 20 and np.ptp(branch[:, 1]) > 1.5 for branch in branches)
    low, high = possible(fit_process(design, ring), 100.0, BOX)[0]
    assert (low, high) == pytest.approx((-0.75, 0.75), abs=0.06)
