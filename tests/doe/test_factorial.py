from itertools import combinations

import numpy as np
import pytest

from stemcal.doe.factorial import GENERATORS, fraction, full_factorial
from stemcal.errors import UsageError

# Words of length 3, 4, 5, … of the minimum aberration fractions (Chen, Sun and Wu 1993, tables of 16 and 32 runs;
# Box, Hunter and Hunter 1978, table 12.15).
PATTERNS = {
    (5, 8): (2, 1),
    (6, 8): (4, 3),
    (7, 8): (7, 7, 0, 0, 1),
    (6, 16): (0, 3),
    (7, 16): (0, 7),
    (8, 16): (0, 14, 0, 0, 0, 1),
    (9, 16): (4, 14, 8, 0, 4, 1),
    (10, 16): (8, 18, 16, 8, 8, 5),
    (7, 32): (0, 1, 2),
    (8, 32): (0, 3, 4),
    (9, 32): (0, 6, 8, 0, 0, 1),
    (10, 32): (0, 10, 16, 0, 0, 5),
    (11, 32): (0, 25, 0, 27, 0, 10, 0, 1),
    (12, 32): (0, 38, 0, 52, 0, 33, 0, 4),
    (8, 64): (0, 0, 2, 1),
    (9, 64): (0, 1, 4, 2),
    (10, 64): (0, 2, 8, 4, 0, 1),
    (11, 64): (0, 4, 14, 8, 0, 3, 2),
}


def words(found):
    """Return the sets of factors whose product is +1 in every run of a fraction."""
    design = found.design()
    sets = (c for r in range(3, found.k + 1) for c in combinations(range(found.k), r))
    return [c for c in sets if np.all(np.prod(design[:, c], axis=1) == 1.0)]


@pytest.mark.parametrize(("size", "pattern"), PATTERNS.items())
def test_word_lengths_are_the_published_ones(size, pattern):
    lengths = [len(word) for word in words(fraction(*size))]
    assert tuple(lengths.count(3 + i) for i in range(len(pattern))) == pattern
    assert max(lengths) <= 2 + len(pattern)
    assert fraction(*size).resolution == min(lengths)


@pytest.mark.parametrize(("runs", "k"), [(n, k) for n, table in GENERATORS.items() for k in table])
def test_every_fraction_is_orthogonal(runs, k):
    design = fraction(k, runs).design()
    assert design.shape == (runs, k)
    assert np.array_equal(design.T @ design, runs * np.eye(k))
    assert not design.sum(axis=0).any()
    assert len(np.unique(design, axis=0)) == runs


@pytest.mark.parametrize(
    ("k", "runs", "resolution"), [(4, 8, 4), (5, 16, 5), (6, 16, 4), (8, 16, 4), (9, 32, 4), (16, 32, 4)]
)
def test_the_usual_size_has_resolution_four(k, runs, resolution):
    assert (fraction(k).runs, fraction(k).resolution) == (runs, resolution)


@pytest.mark.parametrize(("k", "runs"), [(5, 16), (6, 32), (7, 64), (8, 64), (9, 128), (10, 128)])
def test_resolution_five_as_composite_cores_need_it(k, runs):
    found = fraction(k, resolution=5)
    assert found.runs == runs and found.resolution >= 5


def test_the_half_fraction_of_four_factors():
    """Montgomery, Design and Analysis of Experiments, example 8.1: I = ABCD."""
    found = fraction(4, 8)
    assert words(found) == [(0, 1, 2, 3)]
    assert found.resolution == 4 and found.generators == ("ABC",)
    assert fraction(3).resolution is None and fraction(3).runs == 8


def test_full_factorials():
    assert full_factorial(2).tolist() == [[-1, -1], [1, -1], [-1, 1], [1, 1]]


def test_sizes_nobody_tabulates_are_refused():
    with pytest.raises(UsageError, match="available sizes: 8, 16, 32, 64"):
        fraction(6, 12)
    with pytest.raises(UsageError, match="resolution 6"):
        fraction(14, resolution=6)
    with pytest.raises(UsageError, match="1 to 12 factors"):
        full_factorial(13)
