"""Which terms the runs that are left can still estimate, and how far they have lost their orthogonality."""

from collections.abc import Sequence

import numpy as np

from stemcal.doe.regression.least_squares import Array, not_estimable


def still_estimable(matrix: Array, terms: Sequence[str]) -> list[int]:
    """Return the places of the terms that stay when those that cannot be told apart any more are left out.

    Of the entangled terms every product and square goes: none of them can be estimated by itself. Linear terms and
    the mean stay, so hierarchy is kept; the answer may still not be estimable, if linear terms are entangled.
    """
    kept = list(range(len(terms)))
    while kept:
        lost = not_estimable(matrix[:, kept], [terms[i] for i in kept])
        leaving = {term for term in lost if ":" in term or term.endswith("^2")}
        if not leaving:
            break
        kept = [i for i in kept if terms[i] not in leaving]
    return kept


def largest_inflation(matrix: Array) -> float:
    """Return the largest variance inflation of the columns after the first: the diagonal of their R⁻¹.

    1 where all are orthogonal, infinite where one is made of others.
    """
    columns = matrix[:, 1:] - matrix[:, 1:].mean(axis=0)
    size = np.linalg.norm(columns, axis=0)
    if columns.shape[1] == 0 or np.any(size == 0.0):
        return 1.0 if columns.shape[1] == 0 else float("inf")
    unit = columns / size
    correlation = unit.T @ unit
    if np.linalg.matrix_rank(correlation) < len(correlation):
        return float("inf")
    return float(np.diag(np.linalg.inv(correlation)).max())
