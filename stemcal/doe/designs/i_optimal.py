"""I-optimal designs: distinct runs that make the mean variance of prediction small, over a region cut by constraints.

The mean of φᵀ(XᵀX)⁻¹φ over the region is tr[(XᵀX)⁻¹M], M the mean of φφᵀ there. From a D-optimal start runs are
exchanged for candidates as long as that falls. Runs are distinct: a solver that computes tells nothing new when it is
asked again.

Sources: V. V. Fedorov, Theory of Optimal Experiments (1972); P. Goos and B. Jones, Optimal Design of Experiments
(2011), ch. 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from stemcal.doe.designs.d_optimal import d_optimal_runs
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.terms import term_columns
from stemcal.errors import UsageError

_FIVE, _THREE = (-1.0, -0.5, 0.0, 0.5, 1.0), (-1.0, 0.0, 1.0)
_MOST_FOR_FIVE, _MOST_FOR_THREE = 4, 8
_REGION = 12  # log2 of the points that stand for the region
_ROUNDING = 1e-9


@dataclass(frozen=True)
class HalfSpace:
    """All coded x with normal·x ≤ limit."""

    normal: tuple[float, ...]
    limit: float

    def holds(self, points: Array) -> Array:
        """Tell for each of (m, k) points whether it lies inside."""
        return np.asarray(points @ np.array(self.normal) <= self.limit + _ROUNDING)

    def where(self, j: int, value: float, slack: float) -> HalfSpace:
        """Return what it is for the other factors where xⱼ = value, wider by a little."""
        others = (*self.normal[:j], *self.normal[j + 1 :])
        return HalfSpace(others, self.limit - self.normal[j] * value + slack)


def i_optimal(k: int, runs: int, within: tuple[HalfSpace, ...] = ()) -> Array:
    """Choose the runs of a full quadratic in k factors among a grid of the cube, as far as the constraints hold.

    Raises
    ------
    UsageError
        If the constraints leave fewer points than runs, or none that carry a quadratic.
    """
    if k > _MOST_FOR_THREE:
        raise UsageError(f"rsm.design: i-optimal takes {_MOST_FOR_THREE} factors at most, not {k}")
    candidates = inside(np.array(list(product(_FIVE if k <= _MOST_FOR_FIVE else _THREE, repeat=k))), within)
    if len(candidates) < runs:
        raise UsageError(f"rsm.constraints: they leave {len(candidates)} points for {runs} runs; loosen them")
    if np.linalg.matrix_rank(term_columns(candidates)) < (k + 1) * (k + 2) // 2:
        raise UsageError("rsm.constraints: what they leave cannot carry a quadratic; loosen them")
    design = d_optimal_runs(np.empty((0, k)), runs, candidates)
    rows = [int(np.flatnonzero(np.all(candidates == run, axis=1))[0]) for run in design]
    return np.asarray(candidates[_exchanged(rows, term_columns(candidates), moments(k, within))])


def inside(points: Array, within: tuple[HalfSpace, ...]) -> Array:
    """Return the points where every constraint holds."""
    for half in within:
        points = points[half.holds(points)]
    return points


def moments(k: int, within: tuple[HalfSpace, ...]) -> Array:
    """Return M, the mean of φφᵀ over the part of the cube where the constraints hold."""
    from scipy.stats.qmc import Sobol

    phi = term_columns(inside(2.0 * Sobol(k, scramble=False).random_base2(_REGION) - 1.0, within))
    return np.asarray(phi.T @ phi / len(phi))


def mean_variance(design: Array, region: Array) -> float:
    """Return tr[(XᵀX)⁻¹M], the mean variance of prediction in units of s²."""
    phi = term_columns(design)
    return float(np.trace(np.linalg.solve(phi.T @ phi, region)))


def _exchanged(rows: list[int], phi: Array, region: Array) -> list[int]:
    """Exchange the run and the candidate that gain most, until none gains.

    With A = (XᵀX − xxᵀ)⁻¹, taking z in adds zzᵀ: tr[A M] − zᵀAMAz/(1 + zᵀAz).
    """
    chosen = list(rows)
    while True:
        best = (float(np.trace(np.linalg.solve(phi[chosen].T @ phi[chosen], region))) * (1.0 - 1e-9), -1, -1)
        for place in range(len(chosen)):
            left = phi[chosen[:place] + chosen[place + 1 :]]
            information = left.T @ left
            if np.linalg.matrix_rank(information) < len(information):
                continue
            a = np.linalg.inv(information)
            gained = np.einsum("ij,jk,ik->i", phi, a @ region @ a, phi) / (1.0 + np.einsum("ij,jk,ik->i", phi, a, phi))
            value = float(np.trace(a @ region)) - gained
            value[chosen] = np.inf
            best = min(best, (float(value.min()), place, int(value.argmin())))
        if best[1] < 0:
            return chosen
        chosen[best[1]] = best[2]
