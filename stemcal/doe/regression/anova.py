"""Analysis of variance of a fitted quadratic, the influence of each run, and what the fit is worth.

The table has Model, terms, Residual, Lack of fit, Pure error and Cor total. The influence is in closed form:
statsmodels' `OLSInfluence`, which the tests hold it against, fits again without each run for its studentised residuals,
a hundred times as long for 20 runs and two thousand times for 148.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.coding import Array
from stemcal.doe.regression.least_squares import NEGLIGIBLE, LeastSquares, f_test, same_points, stars, t_quantile
from stemcal.storage.rows import Rows


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
    """Split the residual over repeats; no test of a deterministic solver (pure-error SS ≤ 1e-12 of the total)."""
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


# A run of leverage 1 is always fitted exactly: it has no residual to judge.
_FULL_LEVERAGE = 1.0 - 1e-9


@dataclass(frozen=True)
class RunDiagnostics:
    """Fit and influence of the `run`, counted from 1; `studentised` is the externally studentised residual."""

    run: int
    response: float
    fitted: float
    residual: float
    leverage: float
    studentised: float | None
    cooks_distance: float | None


def _run_diagnostics(fit: LeastSquares, rows: Sequence[int]) -> Iterator[RunDiagnostics]:
    """Diagnose each run; `rows` are the run numbers of the fitted rows."""
    p, s2, residual_ss, df = fit.matrix.shape[1], fit.mean_square, fit.residual_ss, fit.df
    fitted, exact = (fit.response - fit.residuals).tolist(), fit.exact
    columns = fit.response.tolist(), fitted, fit.residuals.tolist(), fit.leverage.tolist()
    for row, response, value, e, h in zip(rows, *columns, strict=True):
        studentised = cooks = None
        if s2 is not None and not exact and h < _FULL_LEVERAGE:
            free = 1.0 - h
            # e/(s₍ᵢ₎·√(1 − h)), s₍ᵢ₎² the residual variance without run i
            variance = (residual_ss - e**2 / free) / (df - 1) if df > 1 else 0.0
            studentised = e / (variance * free) ** 0.5 if variance > 0.0 else None
            cooks = e**2 * h / (p * s2 * free**2)  # e²·h/(p·s²·(1 − h)²)
        yield RunDiagnostics(int(row), response, value, e, h, studentised, cooks)


def _press(fit: LeastSquares) -> float | None:
    """Σ (e / (1 − h))²: what each run misses if predicted by the others; without those of leverage 1."""
    judged = fit.leverage < _FULL_LEVERAGE
    if fit.df == 0 or not judged.any():
        return None
    return float(np.sum((fit.residuals[judged] / (1.0 - fit.leverage[judged])) ** 2))


@dataclass(frozen=True)
class Coefficient:
    """One coded coefficient with its 95 % interval and variance inflation factor."""

    term: str
    value: float
    standard_error: float | None
    low: float | None
    high: float | None
    vif: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class FitStatistics:
    """The coefficients of a fitted quadratic with its analysis of variance, and the worth of the fit."""

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
    runs_diagnostics: Rows[RunDiagnostics] = Rows()


def _coefficients_of(fit: LeastSquares, terms: Sequence[str]) -> tuple[Coefficient, ...]:
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


def statistics_of(
    fit: LeastSquares, terms: Sequence[str], split: LackOfFit, rows: Sequence[int], runs_failed: int
) -> FitStatistics:
    """Return the statistics of a fit; `rows` are the run numbers of the fitted rows."""
    n, p = fit.matrix.shape
    missed, s2 = _press(fit), fit.mean_square

    def explained(missed: float | None) -> float | None:
        """1 − missed/SS of the corrected total."""
        return None if missed is None or fit.flat else 1.0 - missed / fit.total_ss

    precision = None  # (max ŷ − min ŷ)/√(p·s²/n): signal over noise at the design points
    if s2 is not None and not fit.exact:
        precision = float(np.ptp(fit.matrix @ fit.coefficients) / np.sqrt(p * s2 / n))
    return FitStatistics(
        coefficients=Rows(_coefficients_of(fit, terms)),
        anova=Rows(_anova_table(fit, terms, split)),
        r2=explained(fit.residual_ss),
        # 1 − s²/(SS/(n − 1))
        adjusted_r2=1.0 - s2 * (n - 1) / fit.total_ss if s2 is not None and not fit.flat else None,
        predicted_r2=explained(missed),
        adequate_precision=precision,
        press=missed,
        cv_percent=None if s2 is None or fit.mean == 0.0 else 100.0 * float(np.sqrt(s2)) / fit.mean,
        lack_of_fit_testable=split.f is not None,
        runs_failed=runs_failed,
        runs_diagnostics=Rows(_run_diagnostics(fit, rows)),
    )
