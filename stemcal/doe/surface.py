"""The response surface: a full quadratic in coded units, with its ANOVA, intervals and diagnostics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.anova import AnovaRow, LackOfFit, anova_table, lack_of_fit
from stemcal.doe.influence import RunDiagnostics, press, run_diagnostics, variance_inflation
from stemcal.doe.regression import Array, LeastSquares, fit_least_squares, require_estimable, t_quantile
from stemcal.doe.terms import term_columns, term_gradient, term_names
from stemcal.errors import UsageError

DETERMINISTIC = "lack of fit cannot be tested: the solver is deterministic"
# Rules of thumb: a ratio of 4 makes a surface usable, a Cook's distance of 1 one run too strong.
_ADEQUATE, _INFLUENTIAL = 4.0, 1.0


@dataclass(frozen=True)
class Coefficient:
    """One coded coefficient with its 95 % interval and variance inflation factor."""

    term: str
    value: float
    standard_error: float | None
    low: float | None
    high: float | None
    vif: float | None


@dataclass(frozen=True, eq=False)
class Surface:
    """A fitted quadratic. Points are (m, k) arrays in coded units; answers are (m,) or (m, 2) arrays."""

    names: tuple[str, ...]
    coefficients: tuple[Coefficient, ...]
    anova: tuple[AnovaRow, ...]
    r2: float | None
    adjusted_r2: float | None
    predicted_r2: float | None
    adequate_precision: float | None
    press: float | None
    cv_percent: float | None
    lack_of_fit_testable: bool
    runs_diagnostics: tuple[RunDiagnostics, ...]
    runs_failed: int
    notes: tuple[str, ...]
    design: Array
    beta: Array
    unscaled_covariance: Array
    mean_square: float | None
    df: int

    @property
    def design_radius(self) -> float:
        """Coded distance of the outermost run from the centre."""
        return float(np.linalg.norm(self.design, axis=1).max())

    @property
    def leading(self) -> int:
        """Index of the factor with the largest linear coefficient."""
        return int(np.argmax(np.abs(self.beta[1 : len(self.names) + 1])))

    def predict(self, coded: ArrayLike) -> Array:
        """Evaluate ŷ."""
        return np.asarray(term_columns(coded) @ self.beta)

    def gradient(self, coded: ArrayLike) -> Array:
        """Differentiate ŷ at one point; returns (k,)."""
        return np.asarray(self.beta @ term_gradient(coded))

    def unscaled_variance(self, coded: ArrayLike) -> Array:
        """Return φᵀ(XᵀX)⁻¹φ, the variance of ŷ in units of s²."""
        phi = term_columns(coded)
        return np.asarray(np.einsum("ij,jk,ik->i", phi, self.unscaled_covariance, phi))

    def standard_error(self, coded: ArrayLike) -> Array:
        """Standard error of ŷ; NaN for a saturated fit, which knows no error."""
        return np.sqrt(self._s2() * self.unscaled_variance(coded))

    def mean_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        """Interval of the mean response: ŷ ± t·s·√(φᵀ(XᵀX)⁻¹φ)."""
        return self._interval(coded, level, 0.0)

    def prediction_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        """Interval of one further run: ŷ ± t·s·√(1 + φᵀ(XᵀX)⁻¹φ)."""
        return self._interval(coded, level, 1.0)

    def _s2(self) -> float:
        return np.nan if self.mean_square is None else self.mean_square

    def _interval(self, coded: ArrayLike, level: float, extra: float) -> Array:
        t = t_quantile(level, self.df) if self.df else np.nan
        half_width = t * np.sqrt(self._s2() * (extra + self.unscaled_variance(coded)))
        middle = self.predict(coded)
        return np.column_stack([middle - half_width, middle + half_width])

    def as_dict(self) -> dict[str, Any]:
        """Return the statistics of ``rsm.json``."""
        return {
            "coefficients": [asdict(coefficient) for coefficient in self.coefficients],
            "anova": [row.as_dict() for row in self.anova],
            "r2": self.r2,
            "adjusted_r2": self.adjusted_r2,
            "predicted_r2": self.predicted_r2,
            "adequate_precision": self.adequate_precision,
            "press": self.press,
            "cv_percent": self.cv_percent,
            "lack_of_fit_testable": self.lack_of_fit_testable,
            "runs_failed": self.runs_failed,
            "runs_diagnostics": [run.as_dict() for run in self.runs_diagnostics],
            "notes": list(self.notes),
        }


def fit_surface(coded: ArrayLike, response: ArrayLike, names: Sequence[str]) -> Surface:
    """Fit y = β₀ + Σβᵢxᵢ + Σβᵢⱼxᵢxⱼ + Σβᵢᵢxᵢ² by least squares.

    Parameters
    ----------
    coded : array (n, k)
        Design points in coded units.
    response : array (n,)
        NaN for a failed run, which is left out.
    names : sequence of k strings

    Raises
    ------
    RunsFailed, UsageError
        If the runs at hand, or the design, cannot estimate every term.
    """
    points, y = np.asarray(coded, dtype=float), np.asarray(response, dtype=float)
    if points.ndim != 2 or points.shape != (y.size, len(names)):
        raise UsageError(
            f"response surface: design of shape {points.shape} does not go with {y.size} responses and "
            f"{len(names)} factors"
        )
    present = np.isfinite(y)
    design, terms, n_failed = points[present], term_names(names), int(np.sum(~present))
    matrix = term_columns(design)
    require_estimable(matrix, terms, n_failed, "response surface")
    fit = fit_least_squares(matrix, y[present])
    return _surface(fit, design, (np.flatnonzero(present) + 1).tolist(), names, n_failed)


def _surface(
    fit: LeastSquares, design: Array, rows: Sequence[int], names: Sequence[str], n_failed: int
) -> Surface:
    terms = term_names(names)
    split = lack_of_fit(design, fit)
    diagnostics = run_diagnostics(design, fit, rows, split)
    missed, precision = press(fit), _adequate_precision(fit)
    return Surface(
        names=tuple(names),
        coefficients=_coefficients(fit, terms),
        anova=anova_table(fit, terms, split),
        r2=_share_explained(fit.residual_ss, fit),
        adjusted_r2=_adjusted_r2(fit),
        predicted_r2=None if missed is None else _share_explained(missed, fit),
        adequate_precision=precision,
        press=missed,
        cv_percent=_cv_percent(fit),
        lack_of_fit_testable=split.testable,
        runs_diagnostics=diagnostics,
        runs_failed=n_failed,
        notes=tuple(_notes(fit, split, diagnostics, precision, n_failed)),
        design=design,
        beta=fit.coefficients,
        unscaled_covariance=fit.unscaled_covariance,
        mean_square=fit.mean_square,
        df=fit.df,
    )


def _coefficients(fit: LeastSquares, terms: Sequence[str]) -> tuple[Coefficient, ...]:
    errors, inflation = fit.standard_errors, variance_inflation(fit)
    t = t_quantile(0.95, fit.df) if fit.df else 0.0
    out = []
    for i, term in enumerate(terms):
        value, error = float(fit.coefficients[i]), None if errors is None else float(errors[i])
        low, high = (None, None) if error is None else (value - t * error, value + t * error)
        out.append(Coefficient(term, value, error, low, high, float(inflation[i - 1]) if i else None))
    return tuple(out)


def _share_explained(missed: float, fit: LeastSquares) -> float | None:
    """1 − missed/SS_total."""
    return None if fit.flat else 1.0 - missed / fit.total_ss


def _adjusted_r2(fit: LeastSquares) -> float | None:
    """1 − s²/(SS_total/(n − 1))."""
    if fit.mean_square is None or fit.flat:
        return None
    return 1.0 - fit.mean_square * (len(fit.response) - 1) / fit.total_ss


def _adequate_precision(fit: LeastSquares) -> float | None:
    """(max ŷ − min ŷ) / √(p·s²/n): signal over noise at the design points."""
    if fit.mean_square is None or fit.exact:
        return None
    n, p = fit.matrix.shape
    return float(np.ptp(fit.response - fit.residuals) / np.sqrt(p * fit.mean_square / n))


def _cv_percent(fit: LeastSquares) -> float | None:
    """100·s/ȳ."""
    mean = float(fit.response.mean())
    return None if fit.mean_square is None or mean == 0.0 else 100.0 * float(np.sqrt(fit.mean_square)) / mean


def _notes(
    fit: LeastSquares,
    split: LackOfFit,
    diagnostics: Sequence[RunDiagnostics],
    precision: float | None,
    n_failed: int,
) -> list[str]:
    notes = []
    if n_failed:
        notes.append(
            f"{n_failed} of {len(fit.response) + n_failed} runs failed; the surface is fitted to the others."
        )
    if fit.flat:
        notes.append("Every run gave the same response: the surface is flat.")
    elif fit.df == 0:
        notes.append("As many coefficients as runs: the surface passes through every run and knows no error.")
    elif fit.exact:
        notes.append("The quadratic passes through every run exactly: no F can be formed.")
    notes += _lack_of_fit_notes(split)
    if precision is not None and precision < _ADEQUATE:
        notes.append(f"Adequate precision {precision:.2f} is below 4: the surface is mostly noise.")
    return notes + _influence_notes(split, diagnostics)


def _lack_of_fit_notes(split: LackOfFit) -> list[str]:
    if split.deterministic:
        return [
            f"All repeated points agree exactly, so {DETERMINISTIC}.",
            f"The {split.pure_df} repeated runs add no information; they only raise the residual df to "
            f"{split.df + split.pure_df}, so standard errors and p-values look better than they are.",
        ]
    if split.pure_df == 0:
        return ["Lack of fit cannot be tested: no design point is repeated."]
    if split.df == 0:
        return [
            "Lack of fit cannot be tested: the design has as many distinct points as the surface has terms."
        ]
    return []


def _influence_notes(split: LackOfFit, diagnostics: Sequence[RunDiagnostics]) -> list[str]:
    notes = [
        f"Run {run.run} ({run.response:g}) sways the surface: Cook's distance {run.cooks_distance:.2f}."
        for run in diagnostics
        if run.cooks_distance is not None and run.cooks_distance > _INFLUENTIAL
    ]
    for run in diagnostics:
        p, without = split.p, run.lack_of_fit_p_without
        if p is not None and without is not None and (p < 0.05) != (without < 0.05):
            notes.append(
                f"Without run {run.run} ({run.response:g}) lack of fit has p = {without:.4f} in place of "
                f"{p:.4f}: that verdict rests on one run."
            )
    return notes
