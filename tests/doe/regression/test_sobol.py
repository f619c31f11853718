"""Sobol' indices of quadratics: closed forms, and Saltelli's estimate by sampling."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import sobol_indices as by_sampling
from scipy.stats import uniform

from stemcal.doe.regression.sobol import sobol_indices
from stemcal.doe.regression.terms import term_columns

BETA = np.array([120.4, 31.8, 11.2, 4.2, -4.75, -3.25, -1.75, 1.29, -0.83, 2.88])
LOW, HIGH = np.array([-1.68, -2.0, -1.0]), np.array([1.68, 1.0, 1.5])


def test_a_plane_and_a_square() -> None:
    """y = 3a + 4b: 9/25 and 16/25. y = a²: all by itself."""
    plane = sobol_indices(("a", "b"), np.array([1.0, 3.0, 4.0, 0.0, 0.0, 0.0]), -np.ones(2), np.ones(2))
    assert [(i.first, i.total) for i in plane] == [pytest.approx((0.36, 0.36)), pytest.approx((0.64, 0.64))]
    square = sobol_indices(("a",), np.array([1.0, 0.0, 1.0]), -np.ones(1), np.ones(1))
    assert (square[0].first, square[0].total) == pytest.approx((1.0, 1.0))
    product = sobol_indices(("a", "b"), np.array([1.0, 0.0, 0.0, 2.0, 0.0, 0.0]), -np.ones(2), np.ones(2))
    assert [(i.first, i.total) for i in product] == [(0.0, 1.0), (0.0, 1.0)]
    assert sobol_indices(("a",), np.array([1.0, 0.0, 0.0]), -np.ones(1), np.ones(1)) == ()


def test_they_are_those_that_sampling_estimates() -> None:
    found = sobol_indices(("a", "b", "c"), BETA, LOW, HIGH)
    estimate = by_sampling(
        func=lambda x: term_columns(x.T) @ BETA,
        n=2**13,
        dists=[uniform(a, b - a) for a, b in zip(LOW, HIGH, strict=True)],
        rng=np.random.default_rng(1),
    )
    assert [i.first for i in found] == pytest.approx(estimate.first_order, abs=5e-3)
    assert [i.total for i in found] == pytest.approx(estimate.total_order, abs=5e-3)
