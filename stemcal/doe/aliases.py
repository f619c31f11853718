"""What a main effect of a screening design may hide: its aliases among the two-factor interactions."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from stemcal.doe.coding import Array
from stemcal.notes import Note

# Long lists of aliases are not read: the first ones are listed, the others counted.
_SHOWN_FACTORS, _SHOWN_ALIASES = 6, 3


def alias_matrix(coded: Array) -> Array:
    """Return A = (XᵀX)⁻¹XᵀZ without the row of the mean: X the main effects, Z the two-factor interactions.

    Row i, column jk is the weight of interaction jk in the estimate of main effect i. The columns
    run as `itertools.combinations` of the factors.
    """
    n, k = coded.shape
    main = np.column_stack([np.ones(n), coded])
    products = [coded[:, i] * coded[:, j] for i, j in combinations(range(k), 2)]
    interactions = np.column_stack(products) if products else np.empty((n, 0))
    solution, *_ = np.linalg.lstsq(main, interactions, rcond=None)
    return np.asarray(solution[1:])


def aliases_note(coded: Array, names: Sequence[str]) -> Note:
    """Return the two-factor interactions that are aliased with main effects."""
    n, k = coded.shape
    weights = alias_matrix(coded)
    largest = float(np.abs(weights).max(initial=0.0))
    if k < 2:
        return Note("no_interactions", "caution", "A single factor has no interactions.")
    if largest < 1e-9:
        clear = f"In this design with {n} runs, no main effect is aliased with a two-factor interaction."
        return Note("clear_of_interactions", "caution", clear)
    if largest > 1.0 - 1e-9:
        return _fully_aliased(n, weights, names)
    text = (
        f"In this design with {n} runs, main effects are partially aliased with interactions (alias coefficients of "
        f"up to {largest:.2g})."
    )
    return Note("partly_aliased", "caution", text)


def _fully_aliased(n: int, weights: Array, names: Sequence[str]) -> Note:
    """Return the note that some main effects cannot be distinguished from an interaction at all, and from which."""
    pairs = [f"{a}:{b}" for a, b in combinations(names, 2)]
    rows = ((name, np.flatnonzero(np.abs(row) > 1.0 - 1e-9)) for name, row in zip(names, weights, strict=True))
    hidden = {name: [pairs[c] for c in columns] for name, columns in rows if columns.size}
    listed = [f"{factor} with {_first(pairs)}" for factor, pairs in list(hidden.items())[:_SHOWN_FACTORS]]
    if (more := len(hidden) - _SHOWN_FACTORS) > 0:
        listed.append(f"{more} more")
    text = f"In this design with {n} runs, main effects are fully aliased with interactions: {'; '.join(listed)}."
    return Note("fully_aliased", "caution", text)


def _first(pairs: Sequence[str]) -> str:
    more = len(pairs) - _SHOWN_ALIASES
    return ", ".join(pairs[:_SHOWN_ALIASES]) + (f" and {more} more" if more > 0 else "")
