"""Analysis of variance of a fitted quadratic model, diagnostics of each run, and statistics of the quality of the fit.

The diagnostics are in closed form. The tests compare them with `OLSInfluence` of statsmodels, which repeats the fit
without each run and takes a hundred times as long for 20 runs, two thousand times for 148.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.regression.least_squares import NEGLIGIBLE, LeastSquares, f_test, same_points, stars, t_quantile
from stemcal.storage.rows import Rows


@dataclass(frozen=True)
class AnovaRow:
    """One line of the ANOVA table; a quantity that does not apply to the line is None."""

    source: str
    sum_of_squares: float
    df: int
    mean_square: float | None
    f: float | None
    p: float | None
    stars: str


@dataclass(frozen=True)
class LackOfFit:
    """The residual sum of squares, divided into lack of fit and the pure error of replicates, with the F test."""

    sum_of_squares: float
    df: int
    pure_sum_of_squares: float
    pure_df: int
    f: float | None
    p: float | None
    deterministic: bool  # whether all replicates have the same response, so that there is no pure error


def lack_of_fit(coded: Array, fit: LeastSquares) -> LackOfFit:
    """Divide the residual into lack of fit and pure error; a deterministic solver has no pure error and no test."""
    group = same_points(coded)
    counts = np.bincount(group)
    means = np.bincount(group, weights=fit.response) / counts
    pure = float(np.sum((fit.response - means[group]) ** 2))
    pure_df = int(len(fit.response) - len(counts))
    deterministic = pure_df > 0 and pure <= NEGLIGIBLE * fit.total_ss
    pure = 0.0 if deterministic else pure
    df = fit.df - pure_df
    lof = max(fit.residual_ss - pure, 0.0) if df > 0 else 0.0
    f, p = (f_test(lof / df, df, pure / pure_df, pure_df) if df > 0 and pure_df > 0 else None) or (None, None)
    return LackOfFit(lof, df, pure, pure_df, f, p, deterministic)


def _anova_table(fit: LeastSquares, terms: Sequence[str], split: LackOfFit) -> tuple[AnovaRow, ...]:
    """Return the ANOVA table: model, terms (partial sums of squares), residual, lack of fit, pure error, total."""
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


_FULL_LEVERAGE = 1.0 - 1e-9  # a run with leverage 1 is always fitted exactly, so its residual has no meaning


@dataclass(frozen=True)
class _RunDiagnostics:
    """Diagnostics of one run (number from 1); `studentised` is the externally studentised residual (R-student)."""

    run: int
    response: float
    fitted: float
    residual: float
    leverage: float
    studentised: float | None
    cooks_distance: float | None


def _run_diagnostics(fit: LeastSquares, rows: Sequence[int]) -> Iterator[_RunDiagnostics]:
    p, s2, residual_ss, df = fit.matrix.shape[1], fit.mean_square, fit.residual_ss, fit.df
    fitted, exact = (fit.response - fit.residuals).tolist(), fit.exact
    columns = fit.response.tolist(), fitted, fit.residuals.tolist(), fit.leverage.tolist()
    for row, response, value, e, h in zip(rows, *columns, strict=True):
        studentised = cooks = None
        if s2 is not None and not exact and h < _FULL_LEVERAGE:
            free = 1.0 - h
            # R-student e/(s₍ᵢ₎·√(1 − h)), with s₍ᵢ₎² the residual mean square of the fit without run i
            variance = (residual_ss - e**2 / free) / (df - 1) if df > 1 else 0.0
            studentised = e / (variance * free) ** 0.5 if variance > 0.0 else None
            cooks = e**2 * h / (p * s2 * free**2)  # e²·h/(p·s²·(1 − h)²)
        yield _RunDiagnostics(int(row), response, value, e, h, studentised, cooks)


def _press(fit: LeastSquares) -> float | None:
    """Return the PRESS statistic, the sum of squared leave-one-out errors e/(1 − h), without runs of leverage 1."""
    judged = fit.leverage < _FULL_LEVERAGE
    if fit.df == 0 or not judged.any():
        return None
    return float(np.sum((fit.residuals[judged] / (1.0 - fit.leverage[judged])) ** 2))


@dataclass(frozen=True)
class Coefficient:
    """A coefficient in coded units with its 95 % confidence interval and variance inflation factor."""

    term: str
    value: float
    standard_error: float | None
    low: float | None
    high: float | None
    vif: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class FitStatistics:
    """The coefficients of a fitted quadratic model, its analysis of variance, and statistics of the quality of fit."""

    coefficients: Rows[Coefficient]
    anova: Rows[AnovaRow]
    r2: float | None
    adjusted_r2: float | None
    predicted_r2: float | None
    adequate_precision: float | None
    press: float | None
    cv_percent: float | None
    lack_of_fit_testable: bool
    runs_failed: int
    runs_diagnostics: Rows[_RunDiagnostics] = Rows()


def _coefficients_of(fit: LeastSquares, terms: Sequence[str]) -> tuple[Coefficient, ...]:
    # VIF = Σ(x − x̄)²·(XᵀX)⁻¹ⱼⱼ; 1 for a column that is orthogonal to all others
    inflation = np.sum((fit.matrix - np.mean(fit.matrix, axis=0)) ** 2, axis=0) * np.diag(fit.unscaled_covariance)
    errors = None if fit.mean_square is None else np.sqrt(fit.mean_square * np.diag(fit.unscaled_covariance))
    t = t_quantile(0.95, fit.df) if fit.df else 0.0
    out = []
    for i, term in enumerate(terms):
        value, error = float(fit.coefficients[i]), None if errors is None else float(errors[i])
        low, high = (None, None) if error is None else (value - t * error, value + t * error)
        out.append(Coefficient(term, value, error, low, high, float(inflation[i]) if i else None))
    return tuple(out)


def statistics_of(
    fit: LeastSquares, terms: Sequence[str], split: LackOfFit, rows: Sequence[int], runs_failed: int
) -> FitStatistics:
    """Return the statistics of a fit; `rows` are the run numbers of the fitted rows."""
    n, p = fit.matrix.shape
    press, s2 = _press(fit), fit.mean_square

    def explained(unexplained: float | None) -> float | None:
        return None if unexplained is None or fit.flat else 1.0 - unexplained / fit.total_ss

    precision = None  # adequate precision: signal-to-noise ratio (max ŷ − min ŷ)/√(p·s²/n) over the design points
    if s2 is not None and not fit.exact:
        precision = float(np.ptp(fit.matrix @ fit.coefficients) / np.sqrt(p * s2 / n))
    return FitStatistics(
        coefficients=Rows(_coefficients_of(fit, terms)),
        anova=Rows(_anova_table(fit, terms, split)),
        r2=explained(fit.residual_ss),
        # 1 − s²/(total SS/(n − 1))
        adjusted_r2=1.0 - s2 * (n - 1) / fit.total_ss if s2 is not None and not fit.flat else None,
        predicted_r2=explained(press),
        adequate_precision=precision,
        press=press,
        cv_percent=None if s2 is None or fit.mean == 0.0 else 100.0 * float(np.sqrt(s2)) / fit.mean,
        lack_of_fit_testable=split.f is not None,
        runs_failed=runs_failed,
        runs_diagnostics=Rows(_run_diagnostics(fit, rows)),
    )
