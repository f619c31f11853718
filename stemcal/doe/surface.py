"""The response surface: a full quadratic in coded units, with its ANOVA, intervals and diagnostics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stemcal.doe.anova import AnovaRow, anova_table, lack_of_fit
from stemcal.doe.influence import RunDiagnostics, press, run_diagnostics, variance_inflation
from stemcal.doe.regression import Array, LeastSquares, fit_least_squares, require_estimable, t_quantile
from stemcal.doe.surface_notes import DETERMINISTIC, surface_notes
from stemcal.doe.terms import term_columns, term_gradient, term_names
from stemcal.errors import UsageError

__all__ = ["DETERMINISTIC", "Coefficient", "Surface", "fit_surface"]


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
    """A fitted quadratic. Points are (m, k) arrays in coded units; answers are (m,) or (m, 2) arrays.

    `beta` and `unscaled_covariance` cover every term of the full quadratic, with zeros where the fit has no
    such term. With blocks, predictions are for the mean of the blocks; `block_effects` adds up to zero.
    """

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
    response: Array
    weights: Array
    block_effects: dict[str, float]

    @property
    def terms(self) -> tuple[str, ...]:
        """The terms that were fitted, the mean among them."""
        return tuple(coefficient.term for coefficient in self.coefficients)

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
            **({"block_effects": self.block_effects} if self.block_effects else {}),
            "notes": list(self.notes),
        }


def fit_surface(
    coded: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    terms: Sequence[str] | None = None,
    weights: ArrayLike | None = None,
    blocks: Sequence[object] | None = None,
) -> Surface:
    """Fit y = β₀ + Σβᵢxᵢ + Σβᵢⱼxᵢxⱼ + Σβᵢᵢxᵢ² by least squares, or some of its terms.

    Parameters
    ----------
    coded : array (n, k)
        Design points in coded units.
    response : array (n,)
        NaN for a failed run, which is left out.
    names : sequence of k strings
    terms : sequence of strings, optional
        The terms to fit, as `term_names` calls them; the mean is always there.
    weights : array (n,), optional
        Relative precision of each response: its variance is σ²/w.
    blocks : sequence of n labels, optional
        Which runs were made together; each block gets a level of its own.

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
    w = _checked_weights(weights, y.size)[present]
    kept = _kept(names, terms)
    apart, labels = _block_columns(blocks, present)
    matrix = np.column_stack([term_columns(points[present])[:, kept], apart])
    listed = [term_names(names)[i] for i in kept]
    n_failed = int(np.sum(~present))
    require_estimable(matrix, [*listed, *(f"block {label}" for label in labels[:-1])], n_failed, "response surface")
    fit = fit_least_squares(matrix, y[present], w, apart.shape[1])
    return _surface(fit, points[present], (np.flatnonzero(present) + 1).tolist(), names, kept, labels, n_failed)


def _checked_weights(weights: ArrayLike | None, n: int) -> Array:
    if weights is None:
        return np.ones(n)
    w = np.asarray(weights, dtype=float)
    if w.shape != (n,) or not np.all(np.isfinite(w) & (w > 0.0)):
        raise UsageError(f"response surface: weights must be {n} positive numbers; leave out a run by NaN")
    return w


def _kept(names: Sequence[str], terms: Sequence[str] | None) -> list[int]:
    """Return the places of the chosen terms in the full quadratic."""
    known = term_names(names)
    if terms is None:
        return list(range(len(known)))
    if unknown := [term for term in terms if term not in known]:
        raise UsageError(f"response surface: no term {unknown[0]!r}; the terms are {', '.join(known)}")
    return [i for i, term in enumerate(known) if i == 0 or term in terms]


def _block_columns(blocks: Sequence[object] | None, present: NDArray[np.bool_]) -> tuple[Array, list[str]]:
    """Code B blocks by B − 1 columns whose effects, with the last block's, add up to zero."""
    if blocks is None:
        return np.empty((int(present.sum()), 0)), []
    if len(blocks) != present.size:
        raise UsageError(f"response surface: {len(blocks)} block labels for {present.size} runs; give one per run")
    of_run = [str(block) for block, there in zip(blocks, present, strict=True) if there]
    labels = list(dict.fromkeys(of_run))
    if len(labels) < 2:
        return np.empty((len(of_run), 0)), []
    number = np.array([labels.index(label) for label in of_run])
    coding = np.vstack([np.eye(len(labels) - 1), -np.ones(len(labels) - 1)])
    return coding[number], labels


def _surface(
    fit: LeastSquares,
    design: Array,
    rows: Sequence[int],
    names: Sequence[str],
    kept: Sequence[int],
    labels: Sequence[str],
    n_failed: int,
) -> Surface:
    every = term_names(names)
    terms = [every[i] for i in kept]
    split = lack_of_fit(design, fit)
    diagnostics = run_diagnostics(design, fit, rows, split)
    missed, precision = press(fit), _adequate_precision(fit)
    coefficients = _coefficients(fit, terms)
    inflation = [c.vif for c in coefficients if c.vif is not None]
    beta, covariance = np.zeros(len(every)), np.zeros((len(every), len(every)))
    beta[kept] = fit.coefficients[: len(kept)]
    covariance[np.ix_(kept, kept)] = fit.unscaled_covariance[: len(kept), : len(kept)]
    return Surface(
        names=tuple(names),
        coefficients=coefficients,
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
        notes=tuple(surface_notes(fit, split, diagnostics, precision, inflation, n_failed)),
        design=design,
        beta=beta,
        unscaled_covariance=covariance,
        mean_square=fit.mean_square,
        df=fit.df,
        response=fit.response,
        weights=fit.weights,
        block_effects=_block_effects(fit, labels),
    )


def _block_effects(fit: LeastSquares, labels: Sequence[str]) -> dict[str, float]:
    if not labels:
        return {}
    effects = [float(value) for value in fit.coefficients[-fit.blocks :]]
    return dict(zip(labels, [*effects, -sum(effects)], strict=True))


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
    """1 − missed/SS, with SS what the terms may explain: the corrected total less the blocks."""
    return None if fit.flat or fit.null_ss == 0.0 else 1.0 - missed / fit.null_ss


def _adjusted_r2(fit: LeastSquares) -> float | None:
    """1 − s²/(SS/(n − B)), with SS as in R² and B = 1, or the number of blocks."""
    if fit.mean_square is None or fit.flat or fit.null_ss == 0.0:
        return None
    return 1.0 - fit.mean_square * (len(fit.response) - 1 - fit.blocks) / fit.null_ss


def _adequate_precision(fit: LeastSquares) -> float | None:
    """(max ŷ − min ŷ) / √(p·s²/n): signal over noise at the design points, block levels aside."""
    if fit.mean_square is None or fit.exact:
        return None
    n, p = fit.matrix.shape
    fitted = fit.matrix[:, : p - fit.blocks] @ fit.coefficients[: p - fit.blocks]
    return float(np.ptp(fitted) / np.sqrt(p * fit.mean_square / n))


def _cv_percent(fit: LeastSquares) -> float | None:
    """100·s/ȳ."""
    return None if fit.mean_square is None or fit.mean == 0.0 else 100.0 * float(np.sqrt(fit.mean_square)) / fit.mean
