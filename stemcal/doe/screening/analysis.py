"""Two-level screening: main effects, their tests, and the factors that matter.

One rule chooses the factors: the F test against the residual where that has three or more degrees of freedom,
otherwise Lenth's method. The residual holds the columns without a factor, repeated runs and the scatter of centre runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stemcal.doe.regression.least_squares import (
    NEGLIGIBLE,
    ROUNDING,
    Array,
    LeastSquares,
    f_test,
    fit_least_squares,
    require_estimable,
)
from stemcal.doe.screening.effects import Curvature, Effect, Residual, stands_out
from stemcal.doe.screening.lenth import Lenth, lenth
from stemcal.doe.screening.notes import LEAST_DF, screening_notes
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.rows import Rows
from stemcal.files.typed import absent
from stemcal.naming import Names
from stemcal.note import Note


@dataclass(frozen=True, kw_only=True)
class Screening:
    """The effects of one response in the order of the factors, their residual, and the significant factors."""

    effects: Rows[Effect]
    significant: tuple[str, ...]
    lenth: Lenth
    residual: Residual
    total_sum_of_squares: float
    curvature: Curvature | None = absent()
    runs_used: int
    runs_failed: int
    notes: tuple[Note, ...]


def analyse_screening(
    coded: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    symbols: Sequence[str] | None = None,
    alpha: float = 0.05,
    written: Names = Names(),
) -> Screening:
    """Estimate and test the main effects of a screening design.

    Parameters
    ----------
    coded : array (n, k)
        Levels −1 and +1, and 0 at centre points.
    response : array (n,)
        NaN for a failed run; the effects are then least-squares estimates from the runs left.
    names, symbols : sequences of k strings
    alpha : float
        Level of significance.
    written : Names
        How notes name the response.

    Raises
    ------
    RunsFailed
        If the runs left cannot estimate every effect and its error.
    """
    whole, responses = _checked(coded, response, names)
    middle = centre_runs(whole)
    design, y, centre = whole[~middle], responses[~middle], responses[middle & np.isfinite(responses)]
    present = np.isfinite(y)
    n_failed = int(np.sum(~present))
    matrix = np.column_stack([np.ones(int(present.sum())), design[present]])
    require_estimable(matrix, ["1", *names], n_failed, "screening")
    fit = fit_least_squares(matrix, y[present])
    if n_failed and fit.df < 1:
        raise RunsFailed(
            f"screening: {n_failed} of {len(y)} runs failed, which leaves no residual degrees of freedom to test the "
            "effects; correct the failed runs and repeat the stage"
        )
    residual, mean_square = _residual(fit, centre)
    changes = _changes(fit)
    size = lenth(changes, alpha)
    effects = _effects(fit, residual, mean_square, changes, names, symbols or names, size)
    tested = mean_square is not None and residual.df >= LEAST_DF
    significant = [stands_out(e, size) if size.me is not None and not tested else _below(e, alpha) for e in effects]
    curvature = curvature_of(y[present], centre, residual, mean_square, alpha)
    notes = screening_notes(
        fit, residual.df, effects, size, design[present], n_failed, alpha, tested, curvature, written
    )
    return Screening(
        effects=Rows(effects),
        significant=tuple(name for name, chosen in zip(names, significant, strict=True) if chosen),
        lenth=size,
        residual=residual,
        total_sum_of_squares=fit.total_ss,
        curvature=curvature,
        runs_used=int(present.sum()) + len(centre),
        runs_failed=int(np.sum(~np.isfinite(responses))),
        notes=notes,
    )


def _checked(coded: ArrayLike, response: ArrayLike, names: Sequence[str]) -> tuple[Array, Array]:
    design, y = np.asarray(coded, dtype=float), np.asarray(response, dtype=float)
    if design.ndim != 2 or design.shape != (y.size, len(names)):
        raise UsageError(
            f"screening: a design of shape {design.shape} does not match {y.size} responses and {len(names)} factors"
        )
    return design, y


def _residual(fit: LeastSquares, centre: Array) -> tuple[Residual, float | None]:
    """Return the residual with the scatter of the centre runs, and its mean square; None where it is zero."""
    pure = _pure(centre)
    found = Residual(fit.residual_ss + pure, fit.df + (len(centre) - 1 if pure else 0))
    return found, found.sum_of_squares / found.df if found.df and (pure or not fit.exact) else None


def _changes(fit: LeastSquares) -> Array:
    """Effect = 2β = mean(high) − mean(low) when the design is orthogonal; SS is then n/4·effect².

    Effects that are rounding become exactly zero, lest Lenth's method compare rounding with rounding.
    """
    floor = ROUNDING * float(fit.response @ fit.response)
    return np.where(fit.partial_ss[1:] <= floor, 0.0, 2.0 * fit.coefficients[1:])


def _effects(
    fit: LeastSquares,
    residual: Residual,
    mean_square: float | None,
    changes: Array,
    names: Sequence[str],
    symbols: Sequence[str],
    size: Lenth,
) -> list[Effect]:
    found = []
    for i, (name, ss) in enumerate(zip(names, fit.partial_ss[1:].tolist(), strict=True)):
        f, p = f_test(ss, 1, mean_square, residual.df) or (None, None)
        effect, share = float(changes[i]), 0.0 if fit.flat else 100.0 * ss / fit.total_ss
        found.append(Effect(name, symbols[i], effect, share, ss, f, p, effect / size.pse if size.pse else None))
    return found


def _below(effect: Effect, alpha: float) -> bool:
    return effect.p is not None and effect.p < alpha


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
