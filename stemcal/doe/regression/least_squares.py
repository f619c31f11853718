"""Least squares for effects and surfaces alike: one fit and what both read off it; runs that are copies of others.

A solver that computes gives its answer again however often it is asked: runs of one point that agree exactly are one
answer, and count once. Counted as replicates, copies would add degrees of freedom of pure error without an error: six
equal centre runs of a composite of two factors turn 3 residual degrees of freedom into 8, and intervals with a nominal
coverage of 95 % cover two thirds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.coding import Array
from stemcal.errors import RunsFailed, UsageError

# Sums of squares below this share of the total are rounding, not variation.
NEGLIGIBLE = 1e-12
# And below this share of Σy² they are the last bits of the numbers themselves.
ROUNDING = 1e-24


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """y = X·β + residual, with X = `matrix` (n, p) of full column rank; Σ residual² is least.

    `unscaled_covariance` is (XᵀX)⁻¹, which times s² is the covariance of β; `leverage` the diagonal of X(XᵀX)⁻¹Xᵀ.
    """

    matrix: Array
    response: Array
    coefficients: Array
    unscaled_covariance: Array
    residuals: Array
    leverage: Array

    @property
    def df(self) -> int:
        """Residual degrees of freedom, n − p."""
        return int(self.matrix.shape[0] - self.matrix.shape[1])

    @property
    def mean(self) -> float:
        """Mean of the response."""
        return float(np.mean(self.response))

    @property
    def total_ss(self) -> float:
        """Corrected total: Σ (y − ȳ)²."""
        return float(np.sum((self.response - self.mean) ** 2))

    @property
    def residual_ss(self) -> float:
        """Σ residual²; exactly zero for a saturated fit."""
        return float(self.residuals @ self.residuals) if self.df else 0.0

    @property
    def flat(self) -> bool:
        """Whether every response is the same, but for rounding."""
        return self.total_ss <= ROUNDING * float(np.sum(self.response**2))

    @property
    def exact(self) -> bool:
        """Whether the residual is nothing but rounding."""
        return self.flat or self.residual_ss <= NEGLIGIBLE * self.total_ss

    @property
    def mean_square(self) -> float | None:
        """s² = residual SS / df, or None when no degree of freedom is left."""
        return self.residual_ss / self.df if self.df else None

    @property
    def partial_ss(self) -> Array:
        """Type III sum of squares of each column: βⱼ² / (XᵀX)⁻¹ⱼⱼ."""
        return np.asarray(self.coefficients**2 / np.diag(self.unscaled_covariance))


def fit_least_squares(matrix: Array, response: Array) -> LeastSquares:
    """Fit by QR; the columns must be independent (see `require_estimable`)."""
    q, r = np.linalg.qr(matrix)  # X = QR
    beta = np.linalg.solve(r, q.T @ response)  # Rβ = Qᵀy
    covariance = np.linalg.inv(r.T @ r)  # (XᵀX)⁻¹ = (RᵀR)⁻¹
    leverage = np.einsum("ij,jk,ik->i", matrix, covariance, matrix)
    return LeastSquares(matrix, response, beta, covariance, response - matrix @ beta, leverage)


def not_estimable(matrix: Array, terms: Sequence[str]) -> list[str]:
    """Name the terms whose columns depend on other columns."""
    scale = np.linalg.norm(matrix, axis=0)
    r = np.linalg.qr(matrix / np.where(scale > 0.0, scale, 1.0), mode="r")  # its null space is that of X, n × n is not
    _, singular, rows = np.linalg.svd(r)
    null_space = rows[int(np.sum(singular > 1e-9 * singular[0])) :]
    return [term for term, part in zip(terms, null_space.T, strict=True) if np.any(np.abs(part) > 1e-7)]


def require_estimable(matrix: Array, terms: Sequence[str], n_failed: int, what: str) -> None:
    """Raise `RunsFailed` if terms cannot be estimated because runs are missing, `UsageError` if none is missing."""
    n, p = matrix.shape
    lost = list(terms) if n == 0 else not_estimable(matrix, terms)
    if not lost:
        return
    listed = ", ".join("the mean" if term == "1" else term for term in lost)
    if n_failed:
        raise RunsFailed(
            f"{what}: {n_failed} of {n + n_failed} runs failed, so {listed} cannot be estimated from the other {n} "
            "runs; correct the failed runs and repeat the stage"
        )
    raise UsageError(
        f"{what}: {listed} cannot be estimated from {n} runs ({p} coefficients); use a design with more runs or levels"
    )


def stars(p: float | None) -> str:
    """Mark a p-value as the tables of the field do: ``**`` below 0.01, ``*`` below 0.05."""
    return "" if p is None or p >= 0.05 else "**" if p < 0.01 else "*"


def f_test(mean_square: float, df: int, error: float | None, error_df: int) -> tuple[float, float] | None:
    """F = MS/MSE and its p-value, or None where there is no error to test against."""
    if not error or error_df < 1 or df < 1:
        return None
    from scipy.special import fdtrc

    f = mean_square / error
    return float(f), float(fdtrc(df, error_df, f))


def t_quantile(level: float, df: float) -> float:
    """Half-width factor of a two-sided interval: t with P(|T| ≤ t) = level."""
    from scipy.special import stdtrit

    return float(stdtrit(df, 0.5 + 0.5 * level))


# Design points closer than this in coded units are the same point.
_SAME_POINT = 1e-6


def same_points(coded: Array) -> NDArray[np.int64]:
    """Return the number of the distinct point of each of (n, k) runs; (n,)."""
    _, group = np.unique(np.round(coded / _SAME_POINT).astype(np.int64), axis=0, return_inverse=True)
    return np.asarray(group.reshape(-1), dtype=np.int64)


def copies_of(coded: Array, response: Array) -> NDArray[np.bool_]:
    """Return for each run whether it only repeats an earlier one; none does if any two runs of a point differ."""
    present, copies = np.isfinite(response), np.zeros(len(response), dtype=bool)
    y = response[present]
    if not y.size:
        return copies
    group = same_points(coded[present])
    means = np.bincount(group, weights=y) / np.bincount(group)
    if float(np.sum((y - means[group]) ** 2)) > NEGLIGIBLE * float(np.sum((y - y.mean()) ** 2)):
        return copies
    repeats = np.ones(len(y), dtype=bool)
    repeats[np.unique(group, return_index=True)[1]] = False
    copies[present] = repeats
    return copies
