"""What a design can tell before anything is run: power, leverage, collinearity.

Power is the probability that an F test finds a change of the response of so many standard deviations of the
scatter. Source: W. G. Cochran and G. M. Cox, Experimental Designs (1957); non-central F as in SciPy.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.least_squares import Array, not_estimable
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.errors import UsageError

RATIOS = (1.0, 2.0, 4.0)


@dataclass(frozen=True)
class TermPower:
    """One term: standard error of its coefficient in units of the scatter, VIF, power by ratio (`RATIOS`)."""

    term: str
    standard_error: float
    vif: float
    power: dict[str, float | None]


@dataclass(frozen=True)
class DesignQuality:
    """A design judged for a model of given terms.

    `d_efficiency` is 100·|XᵀX|^(1/p)/n, `g_efficiency` 100·p/(n·largest leverage), both 100 % for an
    orthogonal two-level design.
    """

    runs: int
    terms: tuple[TermPower, ...]
    residual_df: int
    pure_error_df: int
    leverage: tuple[float, ...]
    d_efficiency: float
    g_efficiency: float

    def least_power(self, ratio: float) -> float | None:
        """Return the power of the weakest term for a change of `ratio` standard deviations."""
        powers = [term.power[f"{ratio:g}"] for term in self.terms]
        return None if None in powers else min(p for p in powers if p is not None)


def judge_design(coded: Array, names: Sequence[str], quadratic: bool = True, alpha: float = 0.05) -> DesignQuality:
    """Judge a design for the full quadratic, or for main effects alone.

    A change of r standard deviations is r/2 in the coefficient of x and x·y, which run from −1 to 1, and r in
    that of x², which runs from 0 to 1.
    """
    terms = term_names(names) if quadratic else ("1", *names)
    matrix = term_columns(coded)[:, : len(terms)]
    if lost := not_estimable(matrix, terms):
        raise UsageError(f"design of {len(coded)} runs: cannot estimate {', '.join(lost)}; add runs or levels")
    n, p = matrix.shape
    covariance = np.linalg.inv(matrix.T @ matrix)
    leverage = np.einsum("ij,jk,ik->i", matrix, covariance, matrix)
    errors = np.sqrt(np.diag(covariance))
    inflation = n * np.var(matrix, axis=0) * np.diag(covariance)
    rows = tuple(
        TermPower(t, float(errors[i + 1]), float(inflation[i + 1]), _powers(t, errors[i + 1], n - p, alpha))
        for i, t in enumerate(terms[1:])
    )
    _, log_det = np.linalg.slogdet(matrix.T @ matrix)
    return DesignQuality(
        runs=n,
        terms=rows,
        residual_df=n - p,
        pure_error_df=n - len(np.unique(np.round(coded, 6), axis=0)),
        leverage=tuple(map(float, leverage)),
        d_efficiency=100.0 * float(np.exp(log_det / p)) / n,
        g_efficiency=100.0 * p / (n * float(leverage.max())),
    )


def _powers(term: str, error: float, df: int, alpha: float) -> dict[str, float | None]:
    size = 1.0 if term.endswith("^2") else 0.5
    return {f"{ratio:g}": power(size * ratio / error, df, alpha) for ratio in RATIOS}


def power(shift: float, df: int, alpha: float = 0.05) -> float | None:
    """Return P(F > F_crit) for a coefficient of `shift` standard errors: non-central F(1, df; shift²)."""
    if df < 1:
        return None
    from scipy.special import fdtri, ncfdtr

    return float(1.0 - ncfdtr(1.0, float(df), float(shift) ** 2, fdtri(1.0, float(df), 1.0 - alpha)))
