"""Runs added to a design: one by one where the variance of prediction is largest, so |XᵀX| grows most.

The first n of more runs are those of n runs, so a larger number reuses every run made before. Source: T. J. Mitchell,
An Algorithm for the Construction of D-Optimal Experimental Designs, Technometrics 16 (1974), 203–210.
"""

import numpy as np

from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.terms import term_columns
from stemcal.errors import UsageError

_SAME_POINT = 1e-6
_RIDGE = 1e-8  # for a design that cannot estimate every term yet


def extra_runs(design: Array, count: int, candidates: Array) -> Array:
    """Choose `count` of the candidates for the quadratic of a design, (count, k).

    No point is taken twice: a deterministic solver would give the same response.

    Raises
    ------
    UsageError
        If the design leaves fewer candidates.
    """
    gaps = np.abs(candidates[:, None] - design[None]).max(axis=2)
    points = candidates[gaps.min(axis=1) > _SAME_POINT]
    if len(points) < count:
        raise UsageError(
            f"rsm.extra_runs: the design has only {len(points)} free points for {count} runs; use fewer runs"
        )
    phi, base = term_columns(points), term_columns(design)
    information = base.T @ base + _RIDGE * np.eye(base.shape[1])
    chosen: list[int] = []
    for _ in range(count):
        variance = np.einsum("ij,jk,ik->i", phi, np.linalg.inv(information), phi)
        variance[chosen] = -np.inf
        chosen.append(int(np.argmax(variance)))
        information = information + np.outer(phi[chosen[-1]], phi[chosen[-1]])
    return np.asarray(points[chosen])
