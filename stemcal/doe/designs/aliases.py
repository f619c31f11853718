"""What a main effect of a screening design may hide: its aliases among the two-factor interactions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations

import numpy as np

from stemcal.doe.regression.least_squares import Array

# Long lists help nobody: name this many, count the rest.
_SHOWN_FACTORS, _SHOWN_ALIASES = 6, 3


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


def describe_aliases(coded: Array, names: Sequence[str]) -> str:
    """Say in a sentence which two-factor interactions the main effects carry."""
    n, k = coded.shape
    weights = alias_matrix(coded)
    largest = float(np.abs(weights).max(initial=0.0))
    if k < 2:
        return "One factor has no interactions."
    if largest < 1e-9:
        return f"In these {n} runs the main effects are clear of two-factor interactions."
    if largest > 1.0 - 1e-9:
        return _full_aliases(weights, n, names)
    if (uniform := _uniform_weight(weights, k)) is not None:
        return (
            f"In these {n} runs every main effect is aliased ±{uniform} with each two-factor interaction "
            "that does not contain it."
        )
    return (
        f"In these {n} runs main effects are partly aliased with two-factor interactions (weights up to {largest:.2g})."
    )


def _uniform_weight(weights: Array, k: int) -> Fraction | None:
    """The one |weight| shared by all pairs (effect, interaction not containing it), if there is one."""
    pairs = list(combinations(range(k), 2))
    outside = np.array([[i not in pair for pair in pairs] for i in range(k)])
    sizes = np.abs(weights[outside])
    if sizes.size == 0 or np.ptp(sizes) > 1e-9 or np.abs(weights[~outside]).max(initial=0.0) > 1e-9:
        return None
    return Fraction(float(sizes[0])).limit_denominator(100)


def _full_aliases(weights: Array, n: int, names: Sequence[str]) -> str:
    """Name the main effects that cannot be told from an interaction at all."""
    pairs = [f"{a}:{b}" for a, b in combinations(names, 2)]
    rows = [(name, np.flatnonzero(np.abs(row) > 1.0 - 1e-9)) for name, row in zip(names, weights, strict=True)]
    hidden = [(name, columns) for name, columns in rows if columns.size]
    parts = [f"{name} with {_first([pairs[c] for c in columns])}" for name, columns in hidden[:_SHOWN_FACTORS]]
    more = len(hidden) - len(parts)
    tail = f"; and {more} more likewise" if more else ""
    listed = "; ".join(parts) + tail
    return f"In these {n} runs main effects cannot be told from two-factor interactions: {listed}."


def _first(items: list[str]) -> str:
    shown = ", ".join(items[:_SHOWN_ALIASES])
    more = len(items) - _SHOWN_ALIASES
    return f"{shown} and {more} more" if more > 0 else shown
