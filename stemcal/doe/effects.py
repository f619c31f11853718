"""Effects of factors at two levels, with their tests, and the curvature that centre runs show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.coding import Array
from stemcal.doe.lenth import Lenth, lenth
from stemcal.doe.regression.least_squares import NEGLIGIBLE, ROUNDING, LeastSquares, f_test


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


@dataclass(frozen=True)
class Curvature:
    """Mean of the corners, mean of `runs` centre runs, their difference (corners − centre), and its test.

    `curved` is True where p is below the level of significance.
    """

    corners: float
    centre: float
    runs: int
    difference: float
    sum_of_squares: float
    f: float | None
    p: float | None
    df: int
    curved: bool


def stands_out(effect: Effect, size: Lenth) -> bool:
    """Return whether an effect exceeds Lenth's margin of error."""
    return size.me is not None and abs(effect.effect) > size.me


def residual_of(fit: LeastSquares, centre: Array) -> tuple[Residual, float | None]:
    """Return the residual with the scatter of the centre runs, and its mean square; None where it is zero."""
    pure = _pure(centre)
    found = Residual(fit.residual_ss + pure, fit.df + (len(centre) - 1 if pure else 0))
    return found, found.sum_of_squares / found.df if found.df and (pure or not fit.exact) else None


def effects_of(
    fit: LeastSquares,
    residual: Residual,
    mean_square: float | None,
    names: Sequence[str],
    symbols: Sequence[str],
    alpha: float,
) -> tuple[list[Effect], Lenth]:
    """Return every effect with its share of the total, its F test against the residual and its Lenth t, and margins.

    Effect = 2β = mean(high) − mean(low) when the design is orthogonal; SS is then n/4·effect². Effects that are
    rounding become exactly zero, lest Lenth's method compare rounding with rounding.
    """
    floor = ROUNDING * float(fit.response @ fit.response)
    changes = np.where(fit.partial_ss[1:] <= floor, 0.0, 2.0 * fit.coefficients[1:])
    size, found = lenth(changes, alpha), []
    for i, (name, ss) in enumerate(zip(names, fit.partial_ss[1:].tolist(), strict=True)):
        f, p = f_test(ss, 1, mean_square, residual.df) or (None, None)
        effect, share = float(changes[i]), 0.0 if fit.flat else 100.0 * ss / fit.total_ss
        found.append(Effect(name, symbols[i], effect, share, ss, f, p, effect / size.pse if size.pse else None))
    return found, size


# ---- centre points: is the response curved within the ranges?
#
# A plane has the same value at the centre as the corners have on average. The difference, with n_F corner runs and n_C
# centre runs, has the sum of squares n_F·n_C·(ȳ_F − ȳ_C)²/(n_F + n_C) with one degree of freedom. Source: D. C.
# Montgomery, Design and Analysis of Experiments, 8th ed., section 6.8. Centre runs that agree exactly are one run.


def centre_runs(design: Array) -> NDArray[np.bool_]:
    """Return which runs of a two-level design are its centre points, (n,)."""
    centre = ~np.any(design, axis=1)
    return np.asarray(centre if not centre.all() else np.zeros(len(design), dtype=bool))


def curvature_of(
    corners: Array, centre: Array, residual: Residual, mean_square: float | None, alpha: float
) -> Curvature | None:
    """Return how far the centre is off the plane of the corners; None without centre runs."""
    if not len(centre):
        return None
    n_f, n_c = len(corners), len(centre) if _pure(centre) else 1
    high, middle = float(corners.mean()), float(centre.mean())
    square = n_f * n_c * (high - middle) ** 2 / (n_f + n_c)
    f, p = f_test(square, 1, mean_square, residual.df) or (None, None)
    return Curvature(high, middle, n_c, high - middle, square, f, p, residual.df, p is not None and p < alpha)


def _pure(centre: Array) -> float:
    """Return the scatter of centre runs; 0 where they agree but for rounding."""
    pure = float(np.sum((centre - centre.mean()) ** 2)) if len(centre) > 1 else 0.0
    return pure if pure > NEGLIGIBLE * float(centre @ centre) else 0.0
