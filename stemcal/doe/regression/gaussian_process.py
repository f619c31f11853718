"""A second opinion beside the polynomial: a Gaussian process through the same runs (ordinary kriging).

y(x) = µ + Z(x), cov Z = σ²·exp(−½Σ((xᵢ − x'ᵢ)/ℓᵢ)²); the length scales ℓ and a nugget maximise the likelihood
with µ and σ² at their optimum. It takes no shape for granted, so where it predicts much better than the
quadratic, or far from it, the quadratic misses something.

Sources: J. Sacks, W. J. Welch, T. J. Mitchell and H. P. Wynn, Statistical Science 4 (1989), 409–423; leave-one-
out in closed form, O. Dubrule, Math. Geology 15 (1983), 687–699.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.regression.least_squares import Array, t_quantile
from stemcal.doe.regression.surface import Surface

_SCALES, _NUGGETS = (0.1, 20.0), (1e-8, 1.0)  # bounds of ℓ, in coded units, and of the nugget in units of σ²
_STARTS = ((0.7, 1e-4), (2.0, 1e-6), (5.0, 1e-2))
_PROBES = 10  # log2 of the points at which the two predictions are compared
_CLEARLY_BETTER = 0.05
MOST_RUNS = 150  # beyond this a Gaussian process takes longer than it is worth


@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """A fitted process; `scales` has one length per factor, `q2` is the share of variance predicted by others."""

    design: Array
    mean: float
    variance: float
    scales: Array
    nugget: float
    response: Array
    inverse: Array
    weights: Array
    left_out: Array
    q2: float | None

    def predict(self, coded: ArrayLike) -> Array:
        """Evaluate the process at (m, k) points."""
        points = np.atleast_2d(np.asarray(coded, dtype=float))
        return np.asarray(self.mean + _kernel(points, self.design, self.scales) @ self.weights)

    def gradient(self, coded: ArrayLike) -> Array:
        """Differentiate the process at one point; returns (k,)."""
        x = np.asarray(coded, dtype=float)
        near = _kernel(x[None, :], self.design, self.scales)[0] * self.weights
        return np.asarray(near @ (self.design - x) / self.scales**2)

    def standard_error(self, coded: ArrayLike) -> Array:
        """Return that of the process at (m, k) points: s² = σ²·(1 − kᵀK⁻¹k + (1 − 1ᵀK⁻¹k)²/1ᵀK⁻¹1).

        σ² has n − 1 degrees of freedom, for µ is estimated; that ℓ and the nugget are estimated too is not in it.
        """
        points = np.atleast_2d(np.asarray(coded, dtype=float))
        k = _kernel(points, self.design, self.scales)
        solved = k @ self.inverse
        rest = 1.0 - np.sum(solved * k, axis=1) + (1.0 - solved.sum(axis=1)) ** 2 / self.inverse.sum()
        n = len(self.response)
        return np.asarray(np.sqrt(np.maximum(rest, 0.0) * self.variance * n / (n - 1)))

    def mean_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        """Interval of the response: ŷ ± t·s."""
        return self._interval(coded, level, 0.0)

    def prediction_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        """Interval of one further run: ŷ ± t·√(s² + nugget·σ²)."""
        return self._interval(coded, level, self.nugget * self.variance)

    def _interval(self, coded: ArrayLike, level: float, extra: float) -> Array:
        middle, t = self.predict(coded), t_quantile(level, len(self.response) - 1)
        half_width = t * np.sqrt(self.standard_error(coded) ** 2 + extra)
        return np.column_stack([middle - half_width, middle + half_width])

    def with_fantasy_point(self, coded: Array) -> GaussianProcess:
        """Return the process with its own prediction at a point taken for a run: the errors near it are smaller."""
        response = np.append(self.response, self.predict(coded))
        grown = _process(self.scales, self.nugget, np.vstack([self.design, coded]), response)
        return replace(grown, variance=self.variance)


@dataclass(frozen=True)
class SecondOpinion:
    """Quadratic against Gaussian process: predicted R² of both, and how far they lie apart in the region."""

    polynomial_predicted_r2: float | None
    process_predicted_r2: float | None
    largest_difference: float
    typical_difference: float

    @property
    def process_is_better(self) -> bool:
        """Whether the process predicts runs left out clearly better: the quadratic bends too little."""
        return clearly_better(self.polynomial_predicted_r2, self.process_predicted_r2)


def fit_process(coded: ArrayLike, response: ArrayLike) -> GaussianProcess:
    """Fit by maximum likelihood; repeated points enter with their mean, failed runs (NaN) not at all."""
    from scipy.optimize import minimize

    design, y = _distinct(np.asarray(coded, dtype=float), np.asarray(response, dtype=float))
    k = design.shape[1]
    bounds = [tuple(np.log(_SCALES))] * k + [tuple(np.log(_NUGGETS))]
    starts = [np.log([scale] * k + [nugget]) for scale, nugget in _STARTS]
    found = [minimize(_negative_log_likelihood, s, args=(design, y), method="L-BFGS-B", bounds=bounds) for s in starts]
    best = min(found, key=lambda result: float(result.fun)).x
    return _process(np.exp(best[:k]), float(np.exp(best[k])), design, y)


def _distinct(coded: Array, y: Array) -> tuple[Array, Array]:
    present = np.isfinite(y)
    points, group = np.unique(np.round(coded[present], 9), axis=0, return_inverse=True)
    group = group.reshape(-1)
    return points, np.bincount(group, weights=y[present]) / np.bincount(group)


def _kernel(a: Array, b: Array, scales: Array) -> Array:
    gaps = (a[:, None, :] - b[None, :, :]) / scales
    return np.asarray(np.exp(-0.5 * np.sum(gaps**2, axis=2)))


def _mean_and_variance(factor: Array, y: Array) -> tuple[float, float, Array]:
    """Return µ̂ = 1ᵀK⁻¹y/1ᵀK⁻¹1, σ̂² and K⁻¹(y − µ̂), K = LLᵀ."""
    from scipy.linalg import cho_solve

    ones = np.ones(len(y))
    solved = cho_solve((factor, True), np.column_stack([ones, y]))
    mean = float(ones @ solved[:, 1] / (ones @ solved[:, 0]))
    weights = solved[:, 1] - mean * solved[:, 0]
    return mean, max(float((y - mean) @ weights), 0.0) / len(y), np.asarray(weights)


def _negative_log_likelihood(parameters: Array, design: Array, y: Array) -> float:
    """½(n·ln σ̂² + ln|K|), constants aside."""
    k = design.shape[1]
    covariance = _kernel(design, design, np.exp(parameters[:k])) + np.exp(parameters[k]) * np.eye(len(y))
    try:
        factor = np.asarray(np.linalg.cholesky(covariance), dtype=float)
    except np.linalg.LinAlgError:
        return 1e25
    _, variance, _ = _mean_and_variance(factor, y)
    return float(0.5 * len(y) * np.log(max(variance, 1e-300)) + np.sum(np.log(np.diag(factor))))


def _process(scales: Array, nugget: float, design: Array, y: Array) -> GaussianProcess:
    covariance = _kernel(design, design, scales) + nugget * np.eye(len(y))
    inverse = np.asarray(np.linalg.inv(covariance), dtype=float)
    mean, variance, weights = _mean_and_variance(np.asarray(np.linalg.cholesky(covariance), dtype=float), y)
    # With µ estimated anew without run i: e = [Qy]ᵢ/Qᵢᵢ, Q = K⁻¹ − K⁻¹11ᵀK⁻¹/1ᵀK⁻¹1.
    row = inverse.sum(axis=0)
    q = inverse - np.outer(row, row) / row.sum()
    left_out = np.asarray((q @ y) / np.diag(q))
    spread = float(np.sum((y - y.mean()) ** 2))
    q2 = 1.0 - float(left_out @ left_out) / spread if spread > 0.0 else None
    return GaussianProcess(design, mean, variance, scales, nugget, y, inverse, weights, left_out, q2)


def second_opinion(surface: Surface) -> SecondOpinion | None:
    """Compare a surface with a Gaussian process through its runs; None below k + 3 distinct points."""
    k = len(surface.names)
    if not _worth_a_process(surface):
        return None
    from scipy.stats.qmc import Sobol

    process = fit_process(surface.design, surface.response)
    low, high = surface.design.min(axis=0), surface.design.max(axis=0)
    points = low + (high - low) * Sobol(k, scramble=False).random_base2(_PROBES)
    points = points[np.linalg.norm(points, axis=1) <= surface.design_radius + 1e-9]
    gaps = np.abs(process.predict(points) - surface.predict(points))
    largest, typical = float(gaps.max()), float(np.sqrt(np.mean(gaps**2)))
    return SecondOpinion(surface.predicted_r2, process.q2, largest, typical)


def _worth_a_process(surface: Surface) -> bool:
    points = len(np.unique(np.round(surface.design, 9), axis=0))
    enough = points >= len(surface.names) + 3 and np.ptp(surface.response) > 0.0
    return bool(enough and len(surface.design) <= MOST_RUNS)


def better_process(surface: Surface) -> GaussianProcess | None:
    """Return the process through a surface's runs where it predicts runs left out clearly better; else None."""
    most = clearly_better(surface.predicted_r2, 1.0)  # no process does better than that
    if not most or not _worth_a_process(surface):
        return None
    process = fit_process(surface.design, surface.response)
    return process if clearly_better(surface.predicted_r2, process.q2) else None


def clearly_better(polynomial: float | None, process: float | None) -> bool:
    """Whether a process predicts the runs left out better than a polynomial, by five points of R²."""
    return polynomial is not None and process is not None and process > polynomial + _CLEARLY_BETTER
