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
    """Response at the centre by the effects of the corners, mean of `runs` centre runs, their difference, its test.

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


def is_beyond_margin(effect: Effect, size: Lenth) -> bool:
    """Compare an effect with Lenth's margin of error."""
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
# A column that is 1 at the centre runs and 0 at the corners is added to the fit of the corners. It takes up the centre
# runs, so the other coefficients stay as they are, and its own is δ = ȳ_C − b₀; b₀ is the intercept of the corners. The
# sum of squares is δ²/(1/n_C + c₀₀) with one degree of freedom, c₀₀ the element of (XᵀX)⁻¹ of the intercept. With all
# corner runs b₀ = ȳ_F and c₀₀ = 1/n_F, which gives n_F·n_C·(ȳ_F − ȳ_C)²/(n_F + n_C): D. C. Montgomery, Design and
# Analysis of Experiments, 8th ed., section 6.8. After failed runs ȳ_F depends on the effects, b₀ does not. Centre runs
# that agree exactly are one run.


def centre_runs(design: Array) -> NDArray[np.bool_]:
    """Return a mask of the centre points among the runs of a two-level design, (n,)."""
    centre = ~np.any(design, axis=1)
    return np.asarray(centre if not centre.all() else np.zeros(len(design), dtype=bool))


def curvature_of(
    fit: LeastSquares, centre: Array, residual: Residual, mean_square: float | None, alpha: float
) -> Curvature | None:
    """Return the distance of the centre from the plane fitted to the corners; None without centre runs."""
    if not len(centre):
        return None
    runs = len(centre) if _pure(centre) else 1
    plane, middle = float(fit.coefficients[0]), float(centre.mean())
    square = (middle - plane) ** 2 / (1.0 / runs + float(fit.unscaled_covariance[0, 0]))
    f, p = f_test(square, 1, mean_square, residual.df) or (None, None)
    return Curvature(plane, middle, runs, plane - middle, square, f, p, residual.df, p is not None and p < alpha)


def _pure(centre: Array) -> float:
    """Return the scatter of centre runs; 0 where they agree but for rounding."""
    pure = float(np.sum((centre - centre.mean()) ** 2)) if len(centre) > 1 else 0.0
    return pure if pure > NEGLIGIBLE * float(centre @ centre) else 0.0
