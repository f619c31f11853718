"""A surface of coarse runs corrected by a few fine ones: the fine force is the coarse one times a factor, plus a tilt.

The autoregression of M. C. Kennedy and A. O'Hagan, Biometrika 87 (2000) 1–13, with regressions in place of processes:

    y_fine(x) = ρ·y_coarse(x) + τ·x + ε        ρ, τ by least squares over the points that were run both ways

Quadratics stay quadratics: ŷ_fine = ρ·ŷ_coarse + τ·x = zᵀ(ρ, τ) with z = (ŷ_coarse, x) = Bφ. A fine force differs from
it by ρ times the error of the coarse surface and by ε, which are independent, so with s² of the coarse surface, s_ε² of
the correction and Z the rows z at those points

    variance of ŷ_fine       ρ²s²·φᵀ(XᵀX)⁻¹φ + s_ε²·zᵀ(ZᵀZ)⁻¹z
    of one more fine run     ρ²s² + s_ε² more

with Satterthwaite's degrees of freedom. With fewer than k + 3 fine runs the factor ρ alone is fitted; ε then holds a
tilt that nobody knows, which shifts the mean too: s_ε² more is in the variance of ŷ_fine.
"""

from dataclasses import dataclass, replace

import numpy as np

from stemcal.doe.regression.fit_statistics import Coefficient
from stemcal.doe.regression.least_squares import Array, fit_least_squares, t_quantile
from stemcal.doe.regression.mean_error import MeanError
from stemcal.doe.regression.surface import Surface
from stemcal.doe.regression.terms import term_names
from stemcal.errors import RunsFailed

FEWEST = 3
_FOR_A_TILT = 3  # fine runs beyond the factors


@dataclass(frozen=True, eq=False)
class Correction:
    """ρ, the tilt τ of each factor (per coded unit), the standard deviation of ε and its degrees of freedom."""

    factor: float
    tilt: Array
    sd: float
    df: int
    unscaled_covariance: Array
    tilted: bool = True


def spread_runs(coded: Array, count: int) -> list[int]:
    """Return rows of a design for the fine runs: the one nearest the centre, then ever the farthest from those chosen.

    >>> spread_runs(np.array([[-1.0], [0.0], [0.0], [1.0]]), 3)
    [1, 0, 3]
    """
    chosen = [int(np.argmin(np.linalg.norm(coded, axis=1)))]
    while len(chosen) < count:
        away = np.linalg.norm(coded[:, None] - coded[chosen], axis=2).min(axis=1)
        if away.max() <= 0.0:
            break
        chosen.append(int(np.argmax(np.round(away, 9))))
    return chosen


def correction_of(surface: Surface, points: Array, coarse: Array, fine: Array) -> Correction:
    """Fit ρ and τ to responses at (m, k) coded points; NaN marks a run that failed. No tilt along terms left out.

    Raises
    ------
    RunsFailed
        If fewer than three points have both.
    """
    there = np.isfinite(coarse) & np.isfinite(fine)
    along = [j for j, name in enumerate(surface.names) if name in surface.terms]
    m, k = int(there.sum()), len(along)
    if m < FEWEST:
        raise RunsFailed(
            f"rsm.correct_runs: of {len(points)} points {m} succeeded both in the design and beside it; the "
            f"correction needs {FEWEST}; `stemcal runs SPEC --status failed` shows why the others failed, or raise "
            "rsm.correct_runs"
        )
    tilted = m >= k + _FOR_A_TILT
    z = np.column_stack([coarse[there], points[there][:, along]] if tilted else [coarse[there]])
    fit = fit_least_squares(z, fine[there])
    kept = [0, *(1 + j for j in along)] if tilted else [0]
    found, covariance = np.zeros(1 + len(surface.names)), np.zeros((1 + len(surface.names),) * 2)
    found[kept], covariance[np.ix_(kept, kept)] = fit.coefficients, fit.unscaled_covariance
    return Correction(float(found[0]), found[1:], (fit.residual_ss / fit.df) ** 0.5, fit.df, covariance, tilted)


def corrected(coarse: Surface, found: Correction) -> Surface:
    """Return the surface of the fine runs, its coefficients and intervals; all else is told of the coarse ones."""
    to_z = np.vstack([coarse.beta, np.eye(len(coarse.beta))[1 : len(coarse.names) + 1]])
    beta = np.array([found.factor, *found.tilt]) @ to_z
    if coarse.mean_square is None or coarse.mean_error is None:
        unknown = np.full_like(coarse.unscaled_covariance, np.nan)
        return replace(coarse, beta=beta, coefficients=_coefficients(coarse, beta, unknown, 0))
    parts = [(found.factor**2 * coarse.mean_square, coarse.df), (found.sd**2, found.df)]
    whole, doubt = sum(part for part, _ in parts), sum(part**2 / df for part, df in parts)
    df = int(whole**2 / doubt) if doubt > 0.0 else coarse.df
    covariance = parts[0][0] * coarse.unscaled_covariance + parts[1][0] * to_z.T @ found.unscaled_covariance @ to_z
    return replace(
        coarse,
        beta=beta,
        unscaled_covariance=covariance / whole if whole > 0.0 else coarse.unscaled_covariance,
        mean_square=whole,
        df=df,
        mean_error=MeanError(whole, found.factor**2 * coarse.mean_error.missed + found.sd**2, df),
        deterministic=False,
        unfitted=0.0 if found.tilted or whole == 0.0 else found.sd**2 / whole,
        coefficients=_coefficients(coarse, beta, covariance, df),
    )


def _coefficients(coarse: Surface, beta: Array, covariance: Array, df: int) -> tuple[Coefficient, ...]:
    """Return the coefficients of the terms that were fitted, with their intervals."""
    every, t = term_names(coarse.names), t_quantile(0.95, df) if df else np.nan
    out = []
    for before in coarse.coefficients:
        i = every.index(before.term)
        value, error = float(beta[i]), float(covariance[i, i]) ** 0.5
        if np.isnan(error):
            out.append(Coefficient(before.term, value, None, None, None, before.vif))
        else:
            out.append(Coefficient(before.term, value, error, value - t * error, value + t * error, before.vif))
    return tuple(out)
