"""Least squares for main effects and response surfaces, and the detection of copied runs.

A deterministic solver returns the same response each time, so runs at the same point with exactly the same response are
copies and count as one run. If they counted as replicates, they would add degrees of freedom for pure error but no
error: six equal centre runs in a composite design of two factors would raise the residual degrees of freedom from 3 to
8, and intervals with a nominal coverage of 95 % would cover only two thirds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array, Mask
from stemcal.errors import RunsFailed, UsageError

NEGLIGIBLE = 1e-12  # a sum of squares below this fraction of the total sum of squares is due to rounding
ROUNDING = 1e-24  # a sum of squares below this fraction of Σy² is below the precision of floating-point numbers


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """The least-squares fit y = X·β + e of n runs with p coefficients."""

    matrix: Array  # X (n, p), of full column rank
    response: Array  # y (n,)
    coefficients: Array  # β (p,)
    unscaled_covariance: Array  # (XᵀX)⁻¹; multiplied by s² it is the covariance of β
    residuals: Array  # e (n,)
    leverage: Array  # diagonal of X(XᵀX)⁻¹Xᵀ (n,)

    @property
    def df(self) -> int:
        """Residual degrees of freedom, n − p."""
        return int(self.matrix.shape[0] - self.matrix.shape[1])

    @property
    def mean(self) -> float:
        return float(np.mean(self.response))

    @property
    def total_ss(self) -> float:
        """Total sum of squares, corrected for the mean: Σ(y − ȳ)²."""
        return float(np.sum((self.response - self.mean) ** 2))

    @property
    def residual_ss(self) -> float:
        """Residual sum of squares Σe²; exactly zero for a saturated fit."""
        return float(self.residuals @ self.residuals) if self.df else 0.0

    @property
    def flat(self) -> bool:
        """Whether all responses are the same, except for rounding."""
        return self.total_ss <= ROUNDING * float(np.sum(self.response**2))

    @property
    def exact(self) -> bool:
        """Whether all residuals are zero, except for rounding."""
        return self.flat or self.residual_ss <= NEGLIGIBLE * self.total_ss

    @property
    def mean_square(self) -> float | None:
        """Residual mean square s² = residual SS/df; None without residual degrees of freedom."""
        return self.residual_ss / self.df if self.df else None

    @property
    def partial_ss(self) -> Array:
        """Partial (type III) sum of squares of each column: βⱼ²/(XᵀX)⁻¹ⱼⱼ."""
        return np.asarray(self.coefficients**2 / np.diag(self.unscaled_covariance))


def fit_least_squares(matrix: Array, response: Array) -> LeastSquares:
    """Fit X β = y by QR decomposition; the columns of X must be linearly independent (see `require_estimable`)."""
    q, r = np.linalg.qr(matrix)  # X = QR
    beta = np.linalg.solve(r, q.T @ response)  # Rβ = Qᵀy
    covariance = np.linalg.inv(r.T @ r)  # (XᵀX)⁻¹ = (RᵀR)⁻¹
    leverage = np.einsum("ij,jk,ik->i", matrix, covariance, matrix)
    return LeastSquares(matrix, response, beta, covariance, response - matrix @ beta, leverage)


def not_estimable(matrix: Array, terms: Sequence[str]) -> list[str]:
    """Return the terms whose columns depend linearly on other columns."""
    scale = np.linalg.norm(matrix, axis=0)
    r = np.linalg.qr(matrix / np.where(scale > 0.0, scale, 1.0), mode="r")  # R is small and has the null space of X
    _, singular, rows = np.linalg.svd(r)
    null_space = rows[int(np.sum(singular > 1e-9 * singular[0])) :]
    return [term for term, part in zip(terms, null_space.T, strict=True) if np.any(np.abs(part) > 1e-7)]


def require_estimable(matrix: Array, terms: Sequence[str], n_failed: int, what: str) -> None:
    """Raise `RunsFailed`, or `UsageError` if no run failed, unless all terms can be estimated; `what` is the model."""
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
    """Return the stars of significance of a p-value: ``**`` below 0.01, ``*`` below 0.05."""
    return "" if p is None or p >= 0.05 else "**" if p < 0.01 else "*"


def f_test(mean_square: float, df: int, error: float | None, error_df: int) -> tuple[float, float] | None:
    """Return F = MS/MSE, with MSE = `error`, and its p-value; None without an error mean square to test against."""
    if not error or error_df < 1 or df < 1:
        return None
    from scipy.special import fdtrc

    f = mean_square / error
    return float(f), float(fdtrc(df, error_df, f))


def t_quantile(level: float, df: float) -> float:
    """Return the two-sided quantile of Student's t distribution: t with P(|T| ≤ t) = level."""
    from scipy.special import stdtrit

    return float(stdtrit(df, 0.5 + 0.5 * level))


_SAME_POINT = 1e-6  # runs that differ by less in all coded factors are at the same design point


def same_points(coded: Array) -> NDArray[np.int64]:
    """Return the index of the distinct design point of each run, (n,), for the coded runs (n, k)."""
    _, group = np.unique(np.round(coded / _SAME_POINT).astype(np.int64), axis=0, return_inverse=True)
    return np.asarray(group.reshape(-1), dtype=np.int64)


def copies_of(coded: Array, response: Array) -> Mask:
    """Return a mask of the runs that are copies of earlier ones; all False if runs at the same point differ."""
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
