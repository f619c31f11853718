"""Effects of factors at two levels, with their tests."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.lenth import Lenth
from stemcal.doe.regression.least_squares import ROUNDING, Array, LeastSquares, f_test


@dataclass(frozen=True)
class Effect:
    """One factor's change of the response from its low to its high level, with its tests."""

    factor: str
    symbol: str
    effect: float
    contribution_percent: float
    sum_of_squares: float
    f: float | None
    p: float | None
    lenth_t: float | None


@dataclass(frozen=True)
class Residual:
    """What the effects leave unexplained."""

    sum_of_squares: float
    df: int


def stands_out(effect: Effect, size: Lenth) -> bool:
    """Return whether an effect exceeds Lenth's margin of error."""
    return size.me is not None and abs(effect.effect) > size.me


def changes_of(fit: LeastSquares) -> Array:
    """Effect = 2β = mean(high) − mean(low) when the design is orthogonal; SS is then n/4·effect².

    Effects that are rounding become exactly zero, lest Lenth's method compare rounding with rounding.
    """
    floor = ROUNDING * float(fit.response @ fit.response)
    return np.where(fit.partial_ss[1:] <= floor, 0.0, 2.0 * fit.coefficients[1:])


def effects_of(
    fit: LeastSquares,
    residual: Residual,
    mean_square: float | None,
    changes: Array,
    names: Sequence[str],
    symbols: Sequence[str],
    size: Lenth,
) -> list[Effect]:
    """Return every effect with its share of the total, its F test against the residual and its Lenth t."""
    found = []
    for i, (name, ss) in enumerate(zip(names, fit.partial_ss[1:].tolist(), strict=True)):
        f, p = f_test(ss, 1, mean_square, residual.df) or (None, None)
        effect, share = float(changes[i]), 0.0 if fit.flat else 100.0 * ss / fit.total_ss
        found.append(Effect(name, symbols[i], effect, share, ss, f, p, effect / size.pse if size.pse else None))
    return found
