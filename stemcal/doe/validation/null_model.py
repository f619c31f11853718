"""What a formula without mechanics reaches: F = a·dᵇ through the same measured forces, and F = a·d^2.5.

A model that does no better than these has shown nothing of what it is made of. Fitted to the least sum of squared
relative errors, Σ((F_d − a·dᵇ)/F_d)², for which a is known where b is: with r = dᵇ/F it is Σr/Σr².
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.least_squares import Array

# Bending and shearing of similar sections grow between d² and d³.
FIXED_EXPONENT = 2.5
_EXPONENTS = (-2.0, 8.0)


@dataclass(frozen=True)
class NullModel:
    """Largest errors of a·dᵇ and of a·d^2.5, % of the measured force, fitted and left out in turn.

    None where there are too few diameters to fit, or to leave one out.
    """

    conditions: int
    exponent: float | None
    max_abs_error_percent: float | None
    max_abs_left_out_error_percent: float | None
    fixed_max_abs_error_percent: float | None
    fixed_max_abs_left_out_error_percent: float | None

    def beaten_by(self, left_out_error_percent: float | None) -> bool | None:
        """Whether a fit predicts what it leaves out in turn better than both formulas; None if nothing was left out.

        >>> NullModel(5, 2.6, 3.0, 5.0, 3.8, 4.7).beaten_by(4.6)
        True
        """
        formulas = [self.max_abs_left_out_error_percent, self.fixed_max_abs_left_out_error_percent]
        least = min((error for error in formulas if error is not None), default=None)
        return None if left_out_error_percent is None or least is None else left_out_error_percent < least


def null_model(conditions: Sequence[float], responses: Sequence[float]) -> NullModel | None:
    """Fit both formulas; None with fewer than two different diameters.

    >>> found = null_model([7.0, 8.0, 9.0], [49.0, 64.0, 81.0])
    >>> round(found.exponent, 6), round(found.max_abs_left_out_error_percent, 6)
    (2.0, 0.0)
    """
    d, f = np.asarray(conditions, dtype=float), np.asarray(responses, dtype=float)
    if len(np.unique(d)) < 2:
        return None
    known = len(np.unique(d)) > 2
    exponent = _exponent(d, f) if known else None
    return NullModel(
        conditions=len(d),
        exponent=exponent,
        max_abs_error_percent=_worst(d, f, d, f, exponent) if exponent is not None else None,
        max_abs_left_out_error_percent=_left_out(d, f, None) if known else None,
        fixed_max_abs_error_percent=_worst(d, f, d, f, FIXED_EXPONENT),
        fixed_max_abs_left_out_error_percent=_left_out(d, f, FIXED_EXPONENT),
    )


def _exponent(d: Array, f: Array) -> float:
    """Return b of the least sum of squared relative errors."""
    from scipy.optimize import minimize_scalar

    def missed(b: float) -> float:
        return float(np.sum((1.0 - _factor(d, f, b) * (d / d[0]) ** b / f) ** 2))

    return float(minimize_scalar(missed, bounds=_EXPONENTS, method="bounded", options={"xatol": 1e-9}).x)


def _factor(d: Array, f: Array, b: float) -> float:
    """Return a of F = a·(d/d₁)ᵇ: Σr/Σr²."""
    r = (d / d[0]) ** b / f
    return float(r.sum() / (r @ r))


def _worst(d: Array, f: Array, at: Array, measured: Array, b: float) -> float:
    """Return the largest error elsewhere of the formula fitted to d and f."""
    return float(100.0 * np.max(np.abs(1.0 - _factor(d, f, b) * (at / d[0]) ** b / measured)))


def _left_out(d: Array, f: Array, b: float | None) -> float:
    """Return the largest error of a diameter that the formula was not fitted to, each in turn."""
    worst = 0.0
    for left in np.unique(d):
        own = d == left
        rest = ~own
        exponent = _exponent(d[rest], f[rest]) if b is None else b
        worst = max(worst, _worst(d[rest], f[rest], d[own], f[own], exponent))
    return worst


@dataclass(frozen=True)
class Formula:
    """F = a·dᵇ through the fitted forces: b, and the largest error at the held-out diameters, percent."""

    exponent: float
    worst_held_out_percent: float


def formula_elsewhere(fitted: Sequence[tuple[float, float]], held_out: Sequence[tuple[float, float]]) -> Formula | None:
    """Return F = a·dᵇ through the fitted (diameter, force) and its error at the held-out ones; None without either.

    b is that of the fitted forces; through a single diameter it is 2.5.

    >>> formula_elsewhere([(8.0, 159.2)], [(7.0, 120.0), (11.0, 378.2)]).exponent
    2.5
    >>> round(formula_elsewhere([(8.0, 159.2), (11.0, 378.2)], [(7.0, 120.0)]).exponent, 3)
    2.717
    """
    if not fitted or not held_out:
        return None
    (d, f), (at, measured) = np.array(fitted, dtype=float).T, np.array(held_out, dtype=float).T
    exponent = _exponent(d, f) if len(np.unique(d)) > 1 else FIXED_EXPONENT
    return Formula(exponent, _worst(d, f, at, measured, exponent))
