"""What a main effect of a screening design may hide: its aliases among the two-factor interactions."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from stemcal.doe.regression.least_squares import Array
from stemcal.notes import Note


class NoInteractions(Note):
    """A single factor has none."""


class ClearOfInteractions(Note):
    """No main effect holds part of a two-factor interaction."""

    runs: int


class UniformlyAliased(Note):
    """Every main effect holds ±`share` of each two-factor interaction that does not contain it."""

    runs: int
    share: float


class PartlyAliased(Note):
    """Main effects hold parts of two-factor interactions, of up to this weight."""

    runs: int
    largest: float


class FullyAliased(Note):
    """These main effects cannot be told from these interactions at all."""

    runs: int
    hidden: dict[str, tuple[str, ...]]


def alias_matrix(coded: Array) -> Array:
    """Return A = (XᵀX)⁻¹XᵀZ without the row of the mean: X the main effects, Z the two-factor interactions.

    Row i, column jk tells how much of interaction jk ends up in the estimate of main effect i. The columns
    run as `itertools.combinations` of the factors.
    """
    n, k = coded.shape
    main = np.column_stack([np.ones(n), coded])
    products = [coded[:, i] * coded[:, j] for i, j in combinations(range(k), 2)]
    interactions = np.column_stack(products) if products else np.empty((n, 0))
    solution, *_ = np.linalg.lstsq(main, interactions, rcond=None)
    return np.asarray(solution[1:])


def aliases_note(coded: Array, names: Sequence[str]) -> Note:
    """Return which two-factor interactions the main effects carry."""
    n, k = coded.shape
    weights = alias_matrix(coded)
    largest = float(np.abs(weights).max(initial=0.0))
    if k < 2:
        return NoInteractions()
    if largest < 1e-9:
        return ClearOfInteractions(n)
    if largest > 1.0 - 1e-9:
        return FullyAliased(n, _full_aliases(weights, names))
    uniform = _uniform_weight(weights, k)
    return PartlyAliased(n, largest) if uniform is None else UniformlyAliased(n, uniform)


def _uniform_weight(weights: Array, k: int) -> float | None:
    """The one |weight| shared by all pairs (effect, interaction not containing it), if there is one."""
    pairs = list(combinations(range(k), 2))
    outside = np.array([[i not in pair for pair in pairs] for i in range(k)])
    sizes = np.abs(weights[outside])
    if sizes.size == 0 or np.ptp(sizes) > 1e-9 or np.abs(weights[~outside]).max(initial=0.0) > 1e-9:
        return None
    return float(sizes[0])


def _full_aliases(weights: Array, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the main effects that cannot be told from an interaction at all, with those interactions."""
    pairs = [f"{a}:{b}" for a, b in combinations(names, 2)]
    rows = ((name, np.flatnonzero(np.abs(row) > 1.0 - 1e-9)) for name, row in zip(names, weights, strict=True))
    return {name: tuple(pairs[c] for c in columns) for name, columns in rows if columns.size}
