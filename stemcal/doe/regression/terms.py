"""The terms of a full quadratic: their names, columns and derivatives."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.regression.least_squares import Array


def term_names(names: Sequence[str]) -> tuple[str, ...]:
    """List the terms: the mean, linear, interactions, squares.

    >>> term_names(["a", "b"])
    ('1', 'a', 'b', 'a:b', 'a^2', 'b^2')
    """
    interactions = [f"{a}:{b}" for a, b in combinations(names, 2)]
    return ("1", *names, *interactions, *(f"{name}^2" for name in names))


def term_columns(coded: ArrayLike) -> Array:
    """Evaluate every term at (m, k) coded points; returns (m, p)."""
    x = np.atleast_2d(np.asarray(coded, dtype=float))
    k = x.shape[1]
    products = [x[:, i] * x[:, j] for i, j in combinations(range(k), 2)]
    return np.column_stack([np.ones(len(x)), x, *products, x**2])


def term_gradient(coded: ArrayLike) -> Array:
    """Differentiate every term at one coded point; returns (p, k)."""
    x = np.asarray(coded, dtype=float)
    k = x.size
    pairs = list(combinations(range(k), 2))
    products = np.zeros((len(pairs), k))
    for row, (i, j) in enumerate(pairs):
        products[row, i], products[row, j] = x[j], x[i]
    return np.vstack([np.zeros(k), np.eye(k), products, 2.0 * np.diag(x)])
