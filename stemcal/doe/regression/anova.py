"""Analysis of variance of a fitted quadratic, the influence of each run, and what the fit is worth.

The table has Model, terms, Residual, Lack of fit, Pure error and Cor total. The influence is in closed form:
statsmodels' `OLSInfluence`, which the tests hold it against, fits again without each run for its studentised residuals,
a hundred times as long for 20 runs and two thousand times for 148.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.coding import Array
from stemcal.doe.regression.least_squares import NEGLIGIBLE, LeastSquares, f_test, same_points, stars, t_quantile


@dataclass(frozen=True)
class AnovaRow:
    """One line of the table; f, p and the mean square are None where they have no value."""

    source: str
    sum_of_squares: float
    df: int
    mean_square: float | None
    f: float | None
    p: float | None
    stars: str


@dataclass(frozen=True)
class LackOfFit:
    """The residual split into what replicates scatter (pure error) and what the quadratic misses."""

    sum_of_squares: float
    df: int
    pure_sum_of_squares: float
    pure_df: int
    f: float | None
    p: float | None
    deterministic: bool


def lack_of_fit(coded: Array, fit: LeastSquares) -> LackOfFit:
    """Split the residual over exactly repeated design points.

    Identical replicates (pure-error SS ≤ 1e-12 of the total) mean a deterministic solver: no test.
    """
    group = same_points(coded)
    counts = np.bincount(group)
    means = np.bincount(group, weights=fit.response) / counts
    pure = float(np.sum((fit.response - means[group]) ** 2))
    pure_df = int(len(fit.response) - len(counts))
    deterministic = pure_df > 0 and pure <= NEGLIGIBLE * fit.total_ss
    pure = 0.0 if deterministic else pure
    df = fit.df - pure_df
    lof = max(fit.residual_ss - pure, 0.0) if df > 0 else 0.0
    test = f_test(lof / df, df, pure / pure_df, pure_df) if df > 0 and pure_df > 0 else None
    f, p = test or (None, None)
    return LackOfFit(lof, df, pure, pure_df, f, p, deterministic)


def anova_table(fit: LeastSquares, terms: Sequence[str], split: LackOfFit) -> tuple[AnovaRow, ...]:
    """Tabulate type III sums of squares of the coded columns against the residual."""
    error = None if fit.exact else fit.mean_square

    def row(source: str, ss: float, df: int, f: float | None = None, p: float | None = None) -> AnovaRow:
        return AnovaRow(source, ss, df, ss / df if df else None, f, p, stars(p))

    def tested(source: str, ss: float, df: int) -> AnovaRow:
        return row(source, ss, df, *((f_test(ss / df, df, error, fit.df) if df else None) or ()))

    partial = fit.partial_ss[1:]
    return (
        tested("Model", fit.total_ss - fit.residual_ss, len(terms) - 1),
        *(tested(term, float(ss), 1) for term, ss in zip(terms[1:], partial, strict=True)),
        row("Residual", fit.residual_ss, fit.df),
        row("Lack of fit", split.sum_of_squares, split.df, split.f, split.p),
        row("Pure error", split.pure_sum_of_squares, split.pure_df),
        AnovaRow("Cor total", fit.total_ss, len(fit.response) - 1, None, None, None, ""),
    )


# ---- influence of each run

# A run of leverage 1 is always fitted exactly: it has no residual to judge.
_FULL_LEVERAGE = 1.0 - 1e-9


@dataclass(frozen=True)
class RunDiagnostics:
    """One run's fit and influence; `run` counts the rows of the design from 1.

    `studentised` is the externally studentised residual.
    """

    run: int
    response: float
    fitted: float
    residual: float
    leverage: float
    studentised: float | None
    cooks_distance: float | None


def run_diagnostics(fit: LeastSquares, rows: Sequence[int]) -> tuple[RunDiagnostics, ...]:
    """Diagnose each run; `rows` are the run numbers of the fitted rows."""
    studentised, cooks = _studentised(fit), _cooks_distance(fit)
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


# ---- coefficients and what the fit is worth


@dataclass(frozen=True)
class Coefficient:
    """One coded coefficient with its 95 % interval and variance inflation factor."""

    term: str
    value: float
    standard_error: float | None
    low: float | None
    high: float | None
    vif: float | None


def coefficients_of(fit: LeastSquares, terms: Sequence[str]) -> tuple[Coefficient, ...]:
    """Return the coefficients with standard errors and 95 % intervals from the residual."""
    # VIF = Σ(x − x̄)²·(XᵀX)⁻¹ⱼⱼ; 1 of a column orthogonal to all others
    inflation = np.sum((fit.matrix - np.mean(fit.matrix, axis=0)) ** 2, axis=0) * np.diag(fit.unscaled_covariance)
    errors = None if fit.mean_square is None else np.sqrt(fit.mean_square * np.diag(fit.unscaled_covariance))
    t = t_quantile(0.95, fit.df) if fit.df else 0.0
    out = []
    for i, term in enumerate(terms):
        value, error = float(fit.coefficients[i]), None if errors is None else float(errors[i])
        low, high = (None, None) if error is None else (value - t * error, value + t * error)
        out.append(Coefficient(term, value, error, low, high, float(inflation[i]) if i else None))
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
