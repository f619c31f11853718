"""Sobol' indices of a fitted quadratic: which share of its variation over the region each factor has.

The factors are uniform and independent over the box of their coded ranges. For x = c + h·u with u uniform over −1 … 1
the quadratic is again one in u, and over the orthogonal u, u² − 1/3 and u·v its variance is

    V = Σ bᵢ²/3 + Σ bᵢᵢ²·4/45 + Σ bᵢⱼ²/9

so the indices are known in closed form: first order bᵢ²/3 + bᵢᵢ²·4/45 over V, total with all products of the factor.
Sources: I. M. Sobol', Math. Modelling Comp. Exp. 1 (1993) 407; T. Homma, A. Saltelli, Rel. Eng. Syst. Safety 52
(1996) 1.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from stemcal.doe.regression.least_squares import Array


@dataclass(frozen=True)
class SobolIndex:
    """A factor's share of the surface's variance by itself (`first`) and with all its interactions (`total`)."""

    factor: str
    first: float
    total: float


def sobol_indices(names: tuple[str, ...], beta: Array, low: Array, high: Array) -> tuple[SobolIndex, ...]:
    """Return the indices of β₀ + Σβᵢxᵢ + Σβᵢⱼxᵢxⱼ + Σβᵢᵢxᵢ² over a box; none of a surface that is level.

    Parameters
    ----------
    beta : (terms,)
        Coefficients as `terms.term_names` orders them: mean, linear, products, squares.
    low, high : (k,)
        Coded ends of the box.
    """
    k = len(names)
    pairs = list(combinations(range(k), 2))
    centre, half = 0.5 * (low + high), 0.5 * (high - low)
    products, squares = beta[1 + k : 1 + k + len(pairs)], beta[1 + k + len(pairs) :]
    linear = beta[1 : 1 + k] + 2.0 * squares * centre
    for value, (i, j) in zip(products, pairs, strict=True):
        linear[i] += value * centre[j]
        linear[j] += value * centre[i]
    alone = (half * linear) ** 2 / 3.0 + 4.0 / 45.0 * (half**2 * squares) ** 2
    joint = np.array([(value * half[i] * half[j]) ** 2 / 9.0 for value, (i, j) in zip(products, pairs, strict=True)])
    whole = float(alone.sum() + joint.sum())
    if whole <= 0.0:
        return ()
    shared = [float(sum(v for v, pair in zip(joint, pairs, strict=True) if i in pair)) for i in range(k)]
    return tuple(
        SobolIndex(name, float(own) / whole, (float(own) + with_others) / whole)
        for name, own, with_others in zip(names, alone, shared, strict=True)
    )
