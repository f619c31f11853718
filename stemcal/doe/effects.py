"""Effects of factors at two levels, with their tests, their aliases, and the curvature that centre runs show."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.coding import Array
from stemcal.doe.lenth import Lenth, lenth
from stemcal.doe.regression.least_squares import NEGLIGIBLE, ROUNDING, LeastSquares, f_test
from stemcal.notes import Note


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
    """Centre response by the corners, mean of `runs` centre runs, difference and its test; `curved` if p < α."""

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
    residual = Residual(fit.residual_ss + pure, fit.df + (len(centre) - 1 if pure else 0))
    return residual, residual.sum_of_squares / residual.df if residual.df and (pure or not fit.exact) else None


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
    size, effects = lenth(changes, alpha), []
    for i, (name, ss) in enumerate(zip(names, fit.partial_ss[1:].tolist(), strict=True)):
        f, p = f_test(ss, 1, mean_square, residual.df) or (None, None)
        effect, share = float(changes[i]), 0.0 if fit.flat else 100.0 * ss / fit.total_ss
        effects.append(Effect(name, symbols[i], effect, share, ss, f, p, effect / size.pse if size.pse else None))
    return effects, size


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


# ---- what a main effect may hide: its aliases among the two-factor interactions

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
    weights, pairs = np.abs(alias_matrix(coded)), [f"{a}:{b}" for a, b in combinations(names, 2)]
    largest, design = float(weights.max(initial=0.0)), f"In this design with {len(coded)} runs"
    if not pairs:
        return Note("no_interactions", "caution", "A single factor has no interactions.")
    if largest < 1e-9:
        clear = f"{design}, no main effect is aliased with a two-factor interaction."
        return Note("clear_of_interactions", "caution", clear)
    if largest <= 1.0 - 1e-9:
        partly = f"{design}, main effects are partially aliased with interactions"
        return Note("partly_aliased", "caution", f"{partly} (alias coefficients of up to {largest:.2g}).")
    listed = []
    for name, row in zip(names, weights, strict=True):
        if hidden := [pairs[column] for column in np.flatnonzero(row > 1.0 - 1e-9)]:
            more = f" and {len(hidden) - _SHOWN_ALIASES} more" if len(hidden) > _SHOWN_ALIASES else ""
            listed.append(f"{name} with {', '.join(hidden[:_SHOWN_ALIASES])}{more}")
    if len(listed) > _SHOWN_FACTORS:
        listed[_SHOWN_FACTORS:] = [f"{len(listed) - _SHOWN_FACTORS} more"]
    fully = f"{design}, main effects are fully aliased with interactions: {'; '.join(listed)}."
    return Note("fully_aliased", "caution", fully)
