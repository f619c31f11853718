"""What a fit is worth: coefficients with their intervals, R², adequate precision, coefficient of variation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.influence import variance_inflation
from stemcal.doe.regression.least_squares import LeastSquares, t_quantile


@dataclass(frozen=True)
class Coefficient:
    """One coded coefficient with its 95 % interval and variance inflation factor."""

    term: str
    value: float
    standard_error: float | None
    low: float | None
    high: float | None
    vif: float | None


def coefficients_of(
    fit: LeastSquares, terms: Sequence[str], mean_square: float | None, df: int
) -> tuple[Coefficient, ...]:
    """Return the coefficients with standard errors and 95 % intervals from an error and its df."""
    inflation = variance_inflation(fit)
    errors = None if mean_square is None else np.sqrt(mean_square * np.diag(fit.unscaled_covariance))
    t = t_quantile(0.95, df) if df else 0.0
    out = []
    for i, term in enumerate(terms):
        value, error = float(fit.coefficients[i]), None if errors is None else float(errors[i])
        low, high = (None, None) if error is None else (value - t * error, value + t * error)
        out.append(Coefficient(term, value, error, low, high, float(inflation[i - 1]) if i else None))
    return tuple(out)


def share_explained(missed: float, fit: LeastSquares) -> float | None:
    """1 − missed/SS of the corrected total."""
    return None if fit.flat else 1.0 - missed / fit.total_ss


def adjusted_r2(fit: LeastSquares) -> float | None:
    """1 − s²/(SS/(n − 1))."""
    if fit.mean_square is None or fit.flat:
        return None
    return 1.0 - fit.mean_square * (len(fit.response) - 1) / fit.total_ss


def adequate_precision(fit: LeastSquares) -> float | None:
    """(max ŷ − min ŷ) / √(p·s²/n): signal over noise at the design points."""
    if fit.mean_square is None or fit.exact:
        return None
    n, p = fit.matrix.shape
    return float(np.ptp(fit.matrix @ fit.coefficients) / np.sqrt(p * fit.mean_square / n))


def cv_percent(fit: LeastSquares) -> float | None:
    """100·s/ȳ."""
    return None if fit.mean_square is None or fit.mean == 0.0 else 100.0 * float(np.sqrt(fit.mean_square)) / fit.mean
