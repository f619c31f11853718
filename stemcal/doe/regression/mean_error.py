"""How far the mean response lies from a fitted quadratic: what estimates its terms, and what it misses.

At a point of leverage h = φᵀ(XᵀX)⁻¹φ the mean response differs from ŷ with the variance s_f²·h + σ_L²:

    no scatter of repeated runs     s_f² = s², σ_L² = s²: all of the residual is what the quadratic misses, which misses
                                    other points by as much; so it is with a deterministic solver
    lack of fit p ≥ 0.25            s_f² = s², σ_L² = 0: the residual is scatter, which replicates average away
    lack of fit p < 0.25            s_f² = MS_L, σ_L² = (MS_L − MS_E)/r, r the runs that a point stands for

with MS_L of the lack of fit and MS_E of the pure error. A point of g runs that misses by L, variance σ_L², brings
E[SS_L] = df_L·σ² + σ_L²·tr(Zᵀ(I − X(XᵀX)⁻¹Xᵀ)Z), Z telling points apart: r is this trace over df_L. To pool where
p ≥ 0.25 is the rule of T. A. Bancroft, Biometrics 20 (1964) 427–442: a test at 0.05 would pool too much.
"""

from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.anova import LackOfFit
from stemcal.doe.regression.copies import same_points
from stemcal.doe.regression.least_squares import Array, LeastSquares

POOLED = 0.25


@dataclass(frozen=True)
class MeanError:
    """s_f² and σ_L², with the degrees of freedom behind them."""

    of_terms: float
    missed: float
    df: int


def mean_error_of(coded: Array, fit: LeastSquares, split: LackOfFit, mean_square: float, df: int) -> MeanError:
    """Return the error of the mean response; `mean_square` with `df` is the error of the coefficients."""
    if not split.pure_df:
        return MeanError(mean_square, mean_square, df)
    if split.p is None or split.p >= POOLED:
        return MeanError(mean_square, 0.0, df)
    lack, pure = split.sum_of_squares / split.df, split.pure_sum_of_squares / split.pure_df
    return MeanError(lack, (lack - pure) / _runs_of_a_point(coded, fit, split), split.df)


def _runs_of_a_point(coded: Array, fit: LeastSquares, split: LackOfFit) -> float:
    """Return r, the runs of a point."""
    group = same_points(coded)
    z = np.eye(group.max() + 1)[group]
    m = z.T @ fit.matrix
    trace = float(len(coded) - np.einsum("ij,jk,ik->", m, fit.unscaled_covariance, m))
    return trace / split.df
