"""Terms that runs cannot estimate, and the memory that it takes to find them."""

import tracemalloc

import numpy as np

from stemcal.doe.regression.least_squares import not_estimable


def test_columns_that_depend_on_others_are_named() -> None:
    """The fourth column is the sum of the first two; with two runs for three terms all that overlap are named."""
    x = np.random.default_rng(3).standard_normal((9, 3))
    assert not_estimable(np.column_stack([x, x[:, 0] + x[:, 1]]), ["a", "b", "c", "d"]) == ["a", "b", "d"]
    assert not_estimable(x, ["a", "b", "c"]) == []
    assert not_estimable(np.column_stack([x, np.zeros(9)]), ["a", "b", "c", "d"]) == ["d"]
    assert not_estimable(np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]]), ["a", "b", "c"]) == ["c"]


def test_the_memory_grows_with_the_runs_not_with_their_square() -> None:
    """3,000 runs: an n × n matrix of them would be 72 MB, their own 4 columns are 0.1 MB."""
    x = np.random.default_rng(4).standard_normal((3000, 4))
    tracemalloc.start()
    found = not_estimable(x, ["a", "b", "c", "d"])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found == [] and peak < 2e6
