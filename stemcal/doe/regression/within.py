"""Scatter known within each run, as over the mesh phases of a simulation: a pure error without repeated runs.

A run that is the mean of m values with standard deviation s has the variance s²/m with m − 1 degrees of freedom.
Over N runs they are pooled: MS = Σ (m − 1)·s²/m / Σ (m − 1). Where the values themselves are known, and the j-th is
taken at the same place in every run, what the places have in common is no scatter between runs; it is taken out:
MS = Σ (yᵢⱼ − ȳᵢ − ȳⱼ + ȳ)²/m / (N − 1)(m − 1), the interaction of a two-way table. Repeated runs of a solver that
computes tell the same values again and are counted once. See N. R. Draper and H. Smith, Applied Regression Analysis,
3rd ed. (1998), section 2.1, for lack of fit against an error known from replicates; G. W. Snedecor and W. G. Cochran,
Statistical Methods, for the two-way table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.regression.copies import same_points
from stemcal.doe.regression.least_squares import Array


@dataclass(frozen=True, eq=False)
class Within:
    """Per run: the standard deviation of its values (NaN where unknown), how many there are, and the values (n, m)."""

    sd: Array
    count: Array
    values: Array | None = None

    def at(self, keep: NDArray[np.bool_] | NDArray[np.int_]) -> Within:
        """Return the scatter of some of the runs."""
        return Within(self.sd[keep], self.count[keep], None if self.values is None else self.values[keep])

    def pooled(self, coded: Array) -> Pooled:
        """Pool the scatter over the distinct design points."""
        _, first = np.unique(same_points(np.asarray(coded)), return_index=True)
        first = first[np.isfinite(self.sd[first]) & (self.count[first] > 1)]
        if self.values is not None and len(first) > 1 and np.all(np.isfinite(self.values[first])):
            return _interaction(self.values[first])
        m = self.count[first]
        return Pooled(float(np.sum((m - 1) * self.sd[first] ** 2 / m)), int(np.sum(m - 1)), None)


@dataclass(frozen=True)
class Pooled:
    """A sum of squares and its degrees of freedom, for means of runs; `common` is the SD that all runs share."""

    sum_of_squares: float
    df: int
    common: float | None


def _interaction(values: Array) -> Pooled:
    """Take out what the j-th values of all runs have in common."""
    n, m = values.shape
    apart = values - values.mean(axis=1, keepdims=True)
    shared = np.mean(apart, axis=0)
    left = np.sum((apart - shared) ** 2)
    return Pooled(float(left) / m, (n - 1) * (m - 1), float(shared.std(ddof=1)))
