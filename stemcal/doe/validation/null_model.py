"""What a formula without mechanics reaches: F = a·dᵇ through the same measured forces, and F = a·d^2.5.

A model that does no better than these has shown nothing of what it is made of. Fitted to the least sum of squared
relative errors, Σ((F_d − a·dᵇ)/F_d)², for which a is known where b is: with r = dᵇ/F it is Σr/Σr².
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.least_squares import Array
from stemcal.remarks import Remark, Weight

# Bending and shearing of similar sections grow between d² and d³.
FIXED_EXPONENT = 2.5
_EXPONENTS = (-2.0, 8.0)

_NO_BETTER = Remark(Weight.USE, "Without mechanics {told}: it predicts the diameters no better than a formula.")
_BETTER = Remark(Weight.ASIDE, "Without mechanics {told}: it predicts the diameters better than a formula.")
_NOT_COMPARED = Remark(Weight.TRUST, "Without mechanics {told}: nothing is left out to compare them by.")


@dataclass(frozen=True)
class NullModel:
    """Largest errors of a·dᵇ and of a·d^2.5, per cent of the measured force, fitted and left out in turn.

    None where there are too few diameters to fit, or to leave one out.
    """

    conditions: int
    exponent: float | None
    max_abs_error_percent: float | None
    max_abs_left_out_error_percent: float | None
    fixed_max_abs_error_percent: float | None
    fixed_max_abs_left_out_error_percent: float | None


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


def formula_elsewhere(fitted: Sequence[tuple[float, float]], others: Sequence[tuple[float, float]]) -> float | None:
    """Return the largest error at other (diameter, force) of a·d^2.5 through the fitted ones; None without either.

    >>> round(formula_elsewhere([(8.0, 159.2)], [(7.0, 120.0), (11.0, 378.2)]), 2)
    6.68
    """
    if not fitted or not others:
        return None
    (d, f), (at, measured) = np.array(fitted, dtype=float).T, np.array(others, dtype=float).T
    return _worst(d, f, at, measured, FIXED_EXPONENT)


def compared(null: NullModel, error: float, left_out: float | None) -> str:
    """Say in a sentence what the formulas reach and whether a joint fit does better, by what was left out in turn.

    >>> compared(NullModel(5, 2.6, 3.0, 5.0, 3.8, 4.7), 4.6, 6.0)
    'Without mechanics F = a·d^2.60 through the same 5 forces misses by at most 3.0 % (left out in turn 5.0 %), \
F = a·d^2.5 by 3.8 % (4.7 %), the joint fit by 4.6 % (6.0 %): it predicts the diameters no better than a formula.'
    """
    through = f"through the same {null.conditions} forces misses by at most"
    fixed = f"{null.fixed_max_abs_error_percent:.1f} % ({_shown(null.fixed_max_abs_left_out_error_percent)})"
    if null.exponent is None:
        told = f"F = a·d^{FIXED_EXPONENT:g} {through} {fixed}"
    else:
        own = f"{null.max_abs_error_percent:.1f} % (left out in turn {_shown(null.max_abs_left_out_error_percent)})"
        told = f"F = a·d^{null.exponent:.2f} {through} {own}, F = a·d^{FIXED_EXPONENT:g} by {fixed}"
    formulas = [null.max_abs_left_out_error_percent, null.fixed_max_abs_left_out_error_percent]
    least = min((value for value in formulas if value is not None), default=None)
    return _judged(left_out, least)(told=f"{told}, the joint fit by {error:.1f} % ({_shown(left_out)})")


def compared_elsewhere(formula: float, model: float, conditions: str) -> str:
    """Say in a sentence whether a model predicts other diameters better than one constant does.

    >>> compared_elsewhere(6.7, 17.8, "8 mm")
    'Without mechanics F = a·d^2.5 through 8 mm misses the other diameters by at most 6.7 %, the model by 17.8 %: \
it predicts the diameters no better than a formula.'
    """
    misses = f"F = a·d^{FIXED_EXPONENT:g} through {conditions} misses the other diameters by at most {formula:.1f} %"
    return _judged(model, formula)(told=f"{misses}, the model by {model:.1f} %")


def _judged(model: float | None, formula: float | None) -> Remark:
    if model is None or formula is None:
        return _NOT_COMPARED
    return _BETTER if model < formula else _NO_BETTER


def _shown(percent: float | None) -> str:
    return "–" if percent is None else f"{percent:.1f} %"
