"""Main effects in two-level designs: F tests, Lenth's method, aliases, and the test of curvature with centre runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from stemcal.arrays import Array, Mask
from stemcal.doe.regression.least_squares import NEGLIGIBLE, ROUNDING, LeastSquares, f_test, t_quantile
from stemcal.notes import Note

FEWEST = 3  # number of effects that Lenth's method requires


@dataclass(frozen=True)
class Effect:
    """The main effect of a factor: change of the mean response from its low to its high level, with tests."""

    factor: str
    symbol: str
    effect: float
    contribution_percent: float  # sum of squares in percent of the total sum of squares
    sum_of_squares: float
    f: float | None  # F ratio against the residual; None without a residual
    p: float | None
    lenth_t: float | None  # effect divided by Lenth's pseudo standard error


@dataclass(frozen=True)
class Residual:
    """The residual of the main-effects model: sum of squares and degrees of freedom."""

    sum_of_squares: float
    df: int


@dataclass(frozen=True)
class Curvature:
    """Test of curvature: does the response at the centre differ from the plane through the corner runs?"""

    corners: float  # response at the centre predicted by the corner runs
    centre: float  # mean response of the centre runs
    runs: int  # number of centre runs
    difference: float  # corners − centre
    sum_of_squares: float
    f: float | None
    p: float | None
    df: int  # residual degrees of freedom of the F test
    curved: bool  # whether p < α


# Lenth's method finds significant effects in a design without degrees of freedom for an estimate of the error. Most of
# the m effects are assumed to be inactive; the pseudo standard error PSE estimates the standard error of an effect from
# these. A single effect is significant at level α if it exceeds the margin of error ME = t(1 − α/2; m/3)·PSE. The
# simultaneous margin of error SME = t(γ; m/3)·PSE with γ = (1 + (1 − α)^(1/m))/2 allows for the m comparisons.
# Source: R. V. Lenth, Technometrics 31 (1989), 469–473.


@dataclass(frozen=True)
class Lenth:
    """Pseudo standard error, margin of error and simultaneous margin of error; None with fewer than three effects."""

    pse: float | None
    me: float | None
    sme: float | None


def lenth(effects: Array, alpha: float = 0.05) -> Lenth:
    """Compute Lenth's margins for `effects` cⱼ at significance level `alpha`.

    PSE = 1.5·median of all |cⱼ| < 2.5·s₀, with s₀ = 1.5·median |cⱼ|.

    >>> lenth(np.array([1.0, -1.0, 2.0, -2.0, 3.0, 30.0, -40.0])).pse
    3.0
    """
    sizes, m = np.abs(effects), len(effects)
    if m < FEWEST:
        return Lenth(None, None, None)
    inner = sizes[sizes < 2.5 * 1.5 * np.median(sizes)]
    pse = 1.5 * float(np.median(inner)) if len(inner) else 0.0
    return Lenth(pse, t_quantile(1.0 - alpha, m / 3.0) * pse, t_quantile((1.0 - alpha) ** (1.0 / m), m / 3.0) * pse)


def is_beyond_margin(effect: Effect, margins: Lenth) -> bool:
    """Whether an effect exceeds Lenth's margin of error ME."""
    return margins.me is not None and abs(effect.effect) > margins.me


def residual_of(fit: LeastSquares, centre: Array) -> tuple[Residual, float | None]:
    """Pool the residual of the corner runs with the pure error of centre runs; the mean square is None if unknown."""
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
    """Return the effects of all factors, each with F test and Lenth t, and Lenth's margins for the level `alpha`.

    Effect = 2β, in an orthogonal design mean(high) − mean(low) with SS = n/4·effect². Effects due to rounding are set
    to zero, because Lenth's method would otherwise find some of them significant.
    """
    squares = np.where(fit.partial_ss <= ROUNDING * float(fit.response @ fit.response), 0.0, fit.partial_ss)[1:]
    changes = np.where(squares > 0.0, 2.0 * fit.coefficients[1:], 0.0)
    margins, effects = lenth(changes, alpha), []
    for i, (name, ss) in enumerate(zip(names, squares.tolist(), strict=True)):
        f, p = f_test(ss, 1, mean_square, residual.df) or (None, None)
        effect, share = float(changes[i]), 0.0 if fit.flat else 100.0 * ss / fit.total_ss
        effects.append(Effect(name, symbols[i], effect, share, ss, f, p, effect / margins.pse if margins.pse else None))
    return effects, margins


# Test of curvature: the model of the corner runs gets a further column, 1 at centre runs and 0 at corners. The other
# coefficients do not change; that of the column is δ = ȳ_C − b₀, with b₀ the intercept. Its sum of squares is
# δ²/(1/n_C + c₀₀) with one degree of freedom, where c₀₀ is the diagonal element of (XᵀX)⁻¹ for the intercept. If no
# corner run failed, b₀ = ȳ_F and c₀₀ = 1/n_F, and the sum is n_F·n_C·(ȳ_F − ȳ_C)²/(n_F + n_C): D. C. Montgomery, Design
# and Analysis of Experiments, 8th ed., section 6.8. If some failed, ȳ_F would depend on the effects; b₀ does not.
# Centre runs with exactly the same response count as one run.


def centre_runs(design: Array) -> Mask:
    """Return a mask of the centre points among the runs of a two-level design, (n,)."""
    centre = ~np.any(design, axis=1)
    return np.asarray(centre if not centre.all() else np.zeros(len(design), dtype=bool))


def curvature_of(
    fit: LeastSquares, centre: Array, residual: Residual, mean_square: float | None, alpha: float
) -> Curvature | None:
    """Test the mean response of the `centre` runs against the model `fit` of the corner runs; None without any."""
    if not len(centre):
        return None
    runs = len(centre) if _pure(centre) else 1
    plane, middle = float(fit.coefficients[0]), float(centre.mean())
    square = (middle - plane) ** 2 / (1.0 / runs + float(fit.unscaled_covariance[0, 0]))
    f, p = f_test(square, 1, mean_square, residual.df) or (None, None)
    return Curvature(plane, middle, runs, plane - middle, square, f, p, residual.df, p is not None and p < alpha)


def _pure(centre: Array) -> float:
    """Return the pure-error sum of squares of the centre runs; 0 if they differ only by rounding."""
    pure = float(np.sum((centre - centre.mean()) ** 2)) if len(centre) > 1 else 0.0
    return pure if pure > NEGLIGIBLE * float(centre @ centre) else 0.0


# A note lists at most this number of factors, and of aliases per factor; it only counts the others.
_SHOWN_FACTORS, _SHOWN_ALIASES = 6, 3


def alias_matrix(coded: Array) -> Array:
    """Return the alias matrix A = (XᵀX)⁻¹XᵀZ without the row of the mean, (k, k(k − 1)/2).

    X has the columns of the mean and the main effects; Z has the columns of the two-factor interactions in the order of
    `itertools.combinations`. A_ij is the weight of interaction j in the estimate of main effect i.
    """
    n, k = coded.shape
    main = np.column_stack([np.ones(n), coded])
    products = [coded[:, i] * coded[:, j] for i, j in combinations(range(k), 2)]
    interactions = np.column_stack(products) if products else np.empty((n, 0))
    solution, *_ = np.linalg.lstsq(main, interactions, rcond=None)
    return np.asarray(solution[1:])


def aliases_note(coded: Array, names: Sequence[str]) -> Note:
    """Return a note on two-factor interactions that are aliased with main effects."""
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
