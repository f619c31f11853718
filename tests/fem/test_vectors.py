"""What is spelled out for LLVM does what plain loops would."""

from typing import Any

import numpy as np
import pytest
from numba import njit

from stemcal.fem.kernels import llvm as words
from stemcal.fem.kernels.compile import RUN
from stemcal.fem.lanes import nodal_zeros

STRIDE = 32
Kinds = tuple[type, type]


def nodes(kind: Any, count: int = 60) -> Any:
    """Return values of nodes; of whole numbers some that differ by more than half of all there are."""
    rng = np.random.default_rng(7)
    values = nodal_zeros(count, np.dtype(kind))
    values[:] = rng.integers(-(2**31), 2**31, (count, 3)) if kind is np.int32 else rng.normal(size=(count, 3))
    return values


@pytest.mark.parametrize("kinds", [(np.int32, np.float32), (np.float32, np.float32), (np.float64, np.float64)])
def test_corners_are_read_relative_to_the_first(kinds: Kinds) -> None:
    read_corners = words.read_corners

    @njit
    def read(nodal: Any, unit: Any, runs: Any, values: Any) -> None:
        read_corners(nodal, unit, runs, 0, values, 3, STRIDE)

    of_nodes, of_elements = kinds
    nodal, unit = nodes(of_nodes), np.float32(2.0**-20)
    runs = np.array([[0, 20], [1, 21], [9, 29], [10, 30], [15, 40], [16, 41], [24, 49], [25, 50]], dtype=np.int32)
    values = np.zeros(24 * STRIDE, dtype=of_elements)
    read(nodal, unit, runs, values)
    expected = np.zeros((3, 8, 2, RUN), dtype=of_elements)
    for i, a, r, k in np.ndindex(expected.shape):
        with np.errstate(over="ignore"):
            apart = nodal[runs[a, r] + k, i] - nodal[runs[0, r] + k, i]  # of whole numbers modulo 2³²
        expected[i, a, r, k] = np.float32(apart) * unit if of_nodes is np.int32 else apart
    found = np.array([values[3 + row * STRIDE :][: 2 * RUN] for row in range(24)]).reshape(3, 8, 2, RUN)
    np.testing.assert_array_equal(found[:, 1:], expected[:, 1:])
    assert not values[:3].any() and not found[:, 0].any()


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_forces_of_a_run_are_subtracted(kind: Any) -> None:
    subtract_run = words.subtract_run

    @njit
    def subtract(nodal: Any, values: Any) -> None:
        subtract_run(nodal, 11, values, 5, STRIDE)

    nodal, values = nodes(kind), np.arange(3 * STRIDE, dtype=kind)
    expected = nodal.copy()
    for i in range(3):
        expected[11 : 11 + RUN, i] -= values[5 + i * STRIDE :][:RUN]
    subtract(nodal, values)
    np.testing.assert_array_equal(nodal, expected)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_signs_are_counted(kind: Any) -> None:
    positive, negative = words.counting(">", 32), words.counting("<", 32)

    @njit
    def count(values: Any) -> tuple[int, int]:
        return positive(values, 4), negative(values, 4)

    values = np.tile(np.array([1.0, -1.0, 0.0, np.nan, 2.0, -0.0, np.inf, 3.0], dtype=kind), 5)
    assert count(values) == (16, 4)


def test_places_are_seen_in_whole_units() -> None:
    """Halves go to the even number; what is left of the last 32 bits is what differences need."""
    store_position, store_velocity = words.store_position, words.store_velocity

    @njit
    def see(places: Any, velocities: Any, x: Any, unit: Any) -> None:
        for n in range(x.shape[0]):
            store_position(places, n, x[n], unit)
            store_velocity(velocities, n, x[n])

    unit = np.float32(0.25)
    x = np.array([1.0, -1.0, 0.375, 0.625, 0.1, 0.25 * (2**31 + 5)])
    places, velocities = np.zeros(6, dtype=np.int32), np.zeros(6, dtype=np.float32)
    see(places, velocities, x, unit)
    assert places.tolist() == [4, -4, 2, 2, 0, 5 - 2**31]
    np.testing.assert_array_equal(velocities, x.astype(np.float32))
    same = x.copy()
    see(same, same, x, unit)
    np.testing.assert_array_equal(same, x)


def test_the_larger_number_or_none() -> None:
    maximum = words.maximum

    @njit
    def larger(a: float, b: float) -> float:
        return float(maximum(a, b))

    assert (larger(1.0, 2.0), larger(2.0, 1.0), larger(-np.inf, -1.0)) == (2.0, 2.0, -1.0)
    assert np.isnan([larger(np.nan, 1.0), larger(1.0, np.nan)]).all()
