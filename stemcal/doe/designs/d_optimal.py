"""Adding runs to a design already run: what is there is kept.

Source: T. J. Mitchell, An Algorithm for the Construction of D-Optimal Experimental Designs, Technometrics 16 (1974),
203–210.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.terms import term_columns
from stemcal.errors import UsageError

_SAME_POINT = 1e-6
_RIDGE = 1e-8  # lets a design that cannot estimate every term yet be augmented until it can
_MOST_CANDIDATES = 20_000
_MOST_STEPS, _SETTLED = 20_000, 1e-7  # of the shares


def rows_missing(have: Array, want: Array) -> Array:
    """Return the rows of `want` that `have` lacks; a row wanted twice and there once is missing once."""
    left = Counter(map(tuple, _keys(have)))
    missing = []
    for row, key in zip(want, map(tuple, _keys(want)), strict=True):
        if left[key] > 0:
            left[key] -= 1
        else:
            missing.append(row)
    return np.array(missing).reshape(-1, want.shape[1])


def d_optimal_shares(each: Array, known: Array, beside: int = 0) -> Array:
    """Return the shares w, Σw = 1, that make |Σ wᵢMᵢ + M₀| greatest: how to divide an effort over experiments.

    wᵢ ← wᵢ·tr(M⁻¹Mᵢ), scaled to Σw = 1, never lowers it: Silvey, Titterington and Torsney, Comm. Statist. A 7 (1978)
    1379–1389. Of parameters that are unknown but not asked for, z, what tells of them alone is taken off: |M|/|M_zz|.

    Parameters
    ----------
    each : array (m, k, k)
        Information Mᵢ if all effort went into experiment i.
    known : array (k, k)
        Information M₀ that is there anyway; with the sum of all Mᵢ it is not singular.
    beside : int
        The last so many of the k parameters are not asked for.

    Examples
    --------
    Two factors, each told by an experiment of its own: half of the effort for either, however sharp they are.

    >>> d_optimal_shares(np.array([np.diag([1.0, 0.0]), np.diag([0.0, 9.0])]), np.zeros((2, 2)))
    array([0.5, 0.5])
    """
    shares, asked = np.full(len(each), 1.0 / len(each)), len(known) - beside
    for _ in range(_MOST_STEPS):
        information = np.tensordot(shares, each, 1) + known
        gains = shares * (_gains(information, each) - _gains(information[asked:, asked:], each[:, asked:, asked:]))
        before, shares = shares, gains / gains.sum()
        if np.abs(shares - before).max() < _SETTLED:
            break
    return shares


def log_determinant(information: Array, beside: int = 0) -> float:
    """Return log |M|/|M_zz|, z the last so many parameters, which are not asked for."""
    asked = len(information) - beside
    return float(np.linalg.slogdet(information)[1] - np.linalg.slogdet(information[asked:, asked:])[1])


def _gains(information: Array, each: Array) -> Array:
    return np.asarray(np.einsum("ij,mji->m", np.linalg.inv(information), each))


def _keys(coded: Array) -> list[list[int]]:
    return [[int(value) for value in row] for row in np.round(np.asarray(coded) / _SAME_POINT)]


def d_optimal_runs(
    coded: Array,
    count: int,
    candidates: Array | None = None,
    columns: Callable[[Array], Array] = term_columns,
) -> Array:
    """Choose the `count` runs that, added to a design, raise |XᵀX| of its model most.

    Runs are taken one by one where the variance of prediction is largest, then exchanged while that helps. No
    point is taken that is in the design or was taken already: a solver that computes would tell nothing new.

    Parameters
    ----------
    candidates : array (m, k), optional
        Points to choose from; by default the grid −1, 0, +1 of every factor.
    columns : callable
        Evaluates the terms of the model; by default the full quadratic.
    """
    k = coded.shape[1]
    if count < 1:
        return np.empty((0, k))
    points = rows_missing(coded, _grid(k) if candidates is None else np.asarray(candidates, dtype=float))
    if len(points) < count:
        raise UsageError(
            f"rsm.extra_runs: {count} further runs asked for, the design leaves room for {len(points)}; ask for no more"
        )
    phi, base = columns(points), columns(np.asarray(coded, dtype=float))
    information = base.T @ base + _RIDGE * np.eye(base.shape[1])
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(_most_uncertain(phi, information, chosen))
        information = information + np.outer(phi[chosen[-1]], phi[chosen[-1]])
    return np.asarray(points[_exchanged(chosen, phi, information)])


def _grid(k: int) -> Array:
    if 3**k > _MOST_CANDIDATES:
        raise UsageError(f"augmentation: {k} factors have too many candidate points; give candidates")
    return np.array(list(product((-1.0, 0.0, 1.0), repeat=k)))


def _most_uncertain(phi: Array, information: Array, taken: Sequence[int]) -> int:
    variance = np.einsum("ij,jk,ik->i", phi, np.linalg.inv(information), phi)
    variance[list(taken)] = -np.inf
    return int(np.argmax(variance))


def _exchanged(chosen: list[int], phi: Array, information: Array) -> list[int]:
    """Drop each chosen run and take the best in its place, until nothing changes."""
    for _ in range(20):
        before = list(chosen)
        for place, index in enumerate(chosen):
            without = information - np.outer(phi[index], phi[index])
            best = _most_uncertain(phi, without, [other for other in chosen if other != index])
            gain = phi[best] @ np.linalg.solve(without, phi[best])
            if gain > phi[index] @ np.linalg.solve(without, phi[index]) * (1.0 + 1e-9):
                chosen[place] = best
                information = without + np.outer(phi[best], phi[best])
        if chosen == before:
            break
    return chosen
