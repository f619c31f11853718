"""Copies of a deterministic run: runs of one point that agree exactly are one answer, and count once.

A solver that computes gives its answer again however often it is asked. Counted as replicates, its copies would add
degrees of freedom of pure error without an error: six equal centre runs of a composite of two factors turn 3 residual
degrees of freedom into 8, and intervals with a nominal coverage of 95 % cover two thirds.
"""

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.regression.least_squares import NEGLIGIBLE, Array

# Design points closer than this in coded units are the same point.
_SAME_POINT = 1e-6


def same_points(coded: Array) -> NDArray[np.int64]:
    """Return the number of the distinct point of each of (n, k) runs; (n,)."""
    _, group = np.unique(np.round(coded / _SAME_POINT).astype(np.int64), axis=0, return_inverse=True)
    return np.asarray(group.reshape(-1), dtype=np.int64)


def copies_of(coded: Array, response: Array) -> NDArray[np.bool_]:
    """Return for each of n runs whether it only repeats an earlier run of its point; failed runs do not.

    If any two runs of a point differ, repeats have scatter and no run is a copy.
    """
    present, copies = np.isfinite(response), np.zeros(len(response), dtype=bool)
    y = response[present]
    if not y.size:
        return copies
    group = same_points(coded[present])
    means = np.bincount(group, weights=y) / np.bincount(group)
    if float(np.sum((y - means[group]) ** 2)) > NEGLIGIBLE * float(np.sum((y - y.mean()) ** 2)):
        return copies
    repeats = np.ones(len(y), dtype=bool)
    repeats[np.unique(group, return_index=True)[1]] = False
    copies[present] = repeats
    return copies
