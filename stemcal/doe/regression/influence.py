"""How strongly each run influences a fit, and how much the other terms inflate a term's variance.

In closed form: statsmodels' `OLSInfluence`, which the tests hold it against, fits again without each run for its
studentised residuals, a hundred times as long for 20 runs and two thousand times for 148.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.anova import LackOfFit, lack_of_fit
from stemcal.doe.regression.least_squares import Array, LeastSquares, fit_least_squares, not_estimable

# A run of leverage 1 is always fitted exactly: it has no residual to judge.
_FULL_LEVERAGE = 1.0 - 1e-9


@dataclass(frozen=True)
class RunDiagnostics:
    """One run's fit and influence; `run` counts the rows of the design from 1.

    `studentised` is the externally studentised residual, `lack_of_fit_p_without` the p-value of lack of fit
    when this run is left out.
    """

    run: int
    response: float
    fitted: float
    residual: float
    leverage: float
    studentised: float | None
    cooks_distance: float | None
    lack_of_fit_p_without: float | None


def run_diagnostics(
    coded: Array, fit: LeastSquares, rows: Sequence[int], split: LackOfFit
) -> tuple[RunDiagnostics, ...]:
    """Diagnose each run; `rows` are the run numbers of the fitted rows."""
    studentised, cooks = _studentised(fit), _cooks_distance(fit)
    without = [_lack_of_fit_without(i, coded, fit) if split.testable else None for i in range(len(rows))]
    fitted = fit.response - fit.residuals
    return tuple(
        RunDiagnostics(
            run=int(rows[i]),
            response=float(fit.response[i]),
            fitted=float(fitted[i]),
            residual=float(fit.residuals[i]),
            leverage=float(fit.leverage[i]),
            studentised=_number(studentised[i]),
            cooks_distance=_number(cooks[i]),
            lack_of_fit_p_without=without[i],
        )
        for i in range(len(rows))
    )


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _studentised(fit: LeastSquares) -> Array:
    """Return e / (s₍ᵢ₎·√(1 − h)), with s₍ᵢ₎² the residual variance without run i; NaN where undefined."""
    free = 1.0 - fit.leverage
    out = np.full(len(fit.response), np.nan)
    if fit.df < 2 or fit.exact:
        return out
    judged = fit.leverage < _FULL_LEVERAGE
    e, h = fit.residuals[judged], free[judged]
    variance = (fit.residual_ss - e**2 / h) / (fit.df - 1)
    positive = variance > 0.0
    out[np.flatnonzero(judged)[positive]] = e[positive] / np.sqrt(variance[positive] * h[positive])
    return out


def _cooks_distance(fit: LeastSquares) -> Array:
    """e²·h / (p·s²·(1 − h)²); NaN where undefined."""
    out = np.full(len(fit.response), np.nan)
    if fit.mean_square is None or fit.exact:
        return out
    judged = fit.leverage < _FULL_LEVERAGE
    e, h = fit.residuals[judged], fit.leverage[judged]
    out[judged] = e**2 * h / (fit.matrix.shape[1] * fit.mean_square * (1.0 - h) ** 2)
    return out


def press(fit: LeastSquares) -> float | None:
    """Σ (e / (1 − h))²: what the runs would miss if each were predicted by the others.

    A run of leverage 1, such as the single centre of a rotatable composite of two factors, is one that the others
    cannot predict: it is left out.
    """
    judged = fit.leverage < _FULL_LEVERAGE
    if fit.df == 0 or not judged.any():
        return None
    return float(np.sum((fit.residuals[judged] / (1.0 - fit.leverage[judged])) ** 2))


def variance_inflation(fit: LeastSquares) -> Array:
    """VIF of each column but the first: Σ(x − x̄)²·(XᵀX)⁻¹ⱼⱼ; 1 when orthogonal to all others."""
    spread = np.sum((fit.matrix - np.mean(fit.matrix, axis=0)) ** 2, axis=0)
    return np.asarray((spread * np.diag(fit.unscaled_covariance))[1:])


def _lack_of_fit_without(i: int, coded: Array, fit: LeastSquares) -> float | None:
    keep = np.arange(len(coded)) != i
    matrix = fit.matrix[keep]
    if not_estimable(matrix, [str(j) for j in range(matrix.shape[1])]):
        return None
    refit = fit_least_squares(matrix, fit.response[keep])
    return lack_of_fit(coded[keep], refit).p
