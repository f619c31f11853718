"""Two-level screening: which factors move the response, and how sure is that?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stemcal.doe.designs.aliases import alias_matrix
from stemcal.doe.regression.least_squares import (
    NEGLIGIBLE,
    ROUNDING,
    Array,
    LeastSquares,
    f_test,
    fit_least_squares,
    require_estimable,
    stars,
    t_quantile,
)
from stemcal.doe.screening.effect_sizes import AliasMatrix, Curvature, Effect, HalfNormalPoint, Pareto, ParetoRow
from stemcal.doe.screening.error_term import ErrorTerm, choose_error
from stemcal.doe.screening.holm import adjusted_p
from stemcal.doe.screening.lenth import Lenth, lenth, unused_contrasts
from stemcal.doe.screening.notes import conclusion, margin_decides, screening_notes, stands_out
from stemcal.doe.screening.two_stage_analysis import TwoStages, two_stages
from stemcal.errors import RunsFailed, UsageError
from stemcal.notes import Note

_MOST_ALIASES = 20  # an alias matrix of more factors is too large to be read


@dataclass(frozen=True, eq=False)
class Screening:
    """Effects in the order of the factors, the error they are tested against, and what to beware of.

    `design` is without centre points, which tell of curvature and scatter only.
    """

    effects: tuple[Effect, ...]
    residual_sum_of_squares: float
    residual_df: int
    total_sum_of_squares: float
    lenth: Lenth
    alpha: float
    significant: tuple[str, ...]
    runs_used: int
    runs_failed: int
    notes: tuple[Note, ...]
    error: ErrorTerm
    design: Array
    two_stages: TwoStages | None = None
    curvature: Curvature | None = None

    def ranked(self) -> list[Effect]:
        """Sort the effects by contribution, the largest first."""
        return sorted(self.effects, key=lambda effect: -effect.contribution_percent)

    def half_normal(self) -> tuple[HalfNormalPoint, ...]:
        """Return |effect| in rising order against the half-normal quantile Φ⁻¹(½ + ½(i − ½)/m).

        Noise lies on a line through the origin; what stands out to the right of it is real. Source: C.
        Daniel, Technometrics 1 (1959), 311–341.
        """
        from scipy.special import ndtri

        rising, m = sorted(self.effects, key=lambda effect: abs(effect.effect)), len(self.effects)
        return tuple(
            HalfNormalPoint(e.factor, abs(e.effect), float(ndtri(0.5 + 0.5 * (i + 0.5) / m)))
            for i, e in enumerate(rising)
        )

    def pareto(self) -> Pareto:
        """Return |t| = √F in falling order with its limit for one test and, after Bonferroni, for all."""
        rows = [ParetoRow(e.factor, e.f**0.5) for e in self.effects if e.f is not None]
        rows.sort(key=lambda row: -row.t)
        df, m = self.error.df, len(self.effects)
        limits = [t_quantile(1.0 - self.alpha / tests, df) if rows else None for tests in (1, m)]
        return Pareto(tuple(rows), limits[0], limits[1])

    def aliases(self) -> AliasMatrix | None:
        """Return the alias matrix; None where it is too large to be read."""
        names = [effect.factor for effect in self.effects]
        if not 2 <= len(names) <= _MOST_ALIASES:
            return None
        weights = np.where(np.abs(found := alias_matrix(self.design)) < 1e-12, 0.0, found)
        pairs = tuple(f"{a}:{b}" for a, b in combinations(names, 2))
        return AliasMatrix(pairs, dict(zip(names, map(tuple, weights.tolist()), strict=True)))


def analyse_screening(
    coded: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    symbols: Sequence[str] | None = None,
    alpha: float = 0.05,
    error: str = "residual",
    expected: Mapping[str, str] | None = None,
) -> Screening:
    """Estimate and test the main effects of a screening design.

    Parameters
    ----------
    coded : array (n, k)
        Levels −1 and +1, and 0 in a definitive screening or at centre points.
    response : array (n,)
        NaN for a failed run; the effects are then least-squares estimates from the runs left.
    names, symbols : sequences of k strings
    alpha : float
        Level of significance.
    error : {'residual', 'pooled', 'replicates', 'lenth'}
        What the effects are tested against (see `error_term`).
    expected : mapping, optional
        ``+`` or ``-`` for factors whose sign is known beforehand.

    Raises
    ------
    RunsFailed
        If the runs left cannot estimate every effect and its error.
    """
    whole, responses = _checked(coded, response, names)
    middle = centre_runs(whole)
    design, y, centre = whole[~middle], responses[~middle], responses[middle & np.isfinite(responses)]
    present = np.isfinite(y)
    n_failed = int(np.sum(~present))
    matrix = np.column_stack([np.ones(int(present.sum())), design[present]])
    require_estimable(matrix, ["1", *names], n_failed, "screening")
    fit = fit_least_squares(matrix, y[present])
    if n_failed and fit.df < 1:
        raise RunsFailed(
            f"screening: {n_failed} of {len(y)} runs failed and no residual degree of freedom is left to "
            "test the effects; repair those runs and start the stage again"
        )
    changes = _changes(fit)
    unused = unused_contrasts(design[present], fit.response)
    size = lenth(np.concatenate([changes, unused]), alpha)
    stages = two_stages(design[present], y[present], names, alpha)
    error_term = with_centre(choose_error(error, design[present], fit, changes, size), centre)
    curvature = curvature_of(y[present], centre, error_term, alpha)
    effects = _effects(fit, error_term, changes, names, symbols or names, size)
    weak = margin_decides(error_term, fit, unused)
    signs = expected or {}
    active = _significant(effects, size, alpha, weak) if stages is None else stages.first.active
    judged = tuple(replace(e, conclusion=conclusion(e, size, alpha, signs.get(e.factor))) for e in effects)
    return Screening(
        effects=judged,
        residual_sum_of_squares=fit.residual_ss,
        residual_df=fit.df,
        total_sum_of_squares=fit.total_ss,
        lenth=size,
        alpha=alpha,
        significant=active,
        runs_used=int(present.sum()) + len(centre),
        runs_failed=int(np.sum(~np.isfinite(responses))),
        notes=screening_notes(fit, error_term, effects, size, unused, design[present], n_failed, alpha),
        error=error_term,
        design=design[present],
        two_stages=stages,
        curvature=curvature,
    )


def _checked(coded: ArrayLike, response: ArrayLike, names: Sequence[str]) -> tuple[Array, Array]:
    design, y = np.asarray(coded, dtype=float), np.asarray(response, dtype=float)
    if design.ndim != 2 or design.shape != (y.size, len(names)):
        raise UsageError(
            f"screening: design of shape {design.shape} does not go with {y.size} responses and {len(names)} factors"
        )
    return design, y


def _changes(fit: LeastSquares) -> Array:
    """Effect = 2β = mean(high) − mean(low) when the design is orthogonal; SS is then n/4·effect².

    Effects that are rounding become exactly zero, lest Lenth's method compare rounding with rounding.
    """
    floor = ROUNDING * float(fit.response @ fit.response)
    return np.where(fit.partial_ss[1:] <= floor, 0.0, 2.0 * fit.coefficients[1:])


def _effects(
    fit: LeastSquares,
    error: ErrorTerm,
    changes: Array,
    names: Sequence[str],
    symbols: Sequence[str],
    size: Lenth,
) -> tuple[Effect, ...]:
    tests = [f_test(float(ss), 1, error.mean_square, error.df) for ss in fit.partial_ss[1:]]
    raw = [test[1] if test else None for test in tests]
    if error.source == "lenth":
        raw = [size.p_value(float(change)) for change in changes]
    holm, bh = adjusted_p(raw, "holm"), adjusted_p(raw, "fdr_bh")
    total = fit.total_ss
    return tuple(
        Effect(
            factor=name,
            symbol=symbols[i],
            effect=(effect := float(changes[i])),
            contribution_percent=100.0 * float(fit.partial_ss[i + 1]) / total if not fit.flat else 0.0,
            sum_of_squares=float(fit.partial_ss[i + 1]),
            f=test[0] if test else None,
            p=raw[i],
            stars=stars(raw[i]),
            lenth_t=effect / size.pse if size.pse else None,
            p_holm=holm[i],
            p_bh=bh[i],
        )
        for i, (name, test) in enumerate(zip(names, tests, strict=True))
    )


def _significant(effects: Sequence[Effect], size: Lenth, alpha: float, weak: bool) -> tuple[str, ...]:
    """By p; by Lenth's margin of error where there is none, or where F rests on a few unused columns alone.

    Of nine factors in twelve runs, F has two degrees of freedom, while the margin is that of eleven contrasts.
    """
    by_margin = [weak or effect.p is None for effect in effects]
    return tuple(
        effect.factor
        for effect, margin in zip(effects, by_margin, strict=True)
        if (stands_out(effect, size) if margin else effect.p is not None and effect.p < alpha)
    )


# ---- centre points: is the response curved within the ranges?
#
# A plane has the same value at the centre as the corners have on average. The difference, with n_F corner runs and n_C
# centre runs, has the sum of squares n_F·n_C·(ȳ_F − ȳ_C)²/(n_F + n_C) with one degree of freedom. Source: D. C.
# Montgomery, Design and Analysis of Experiments, 8th ed., section 6.8. Centre runs that agree exactly are one run.


def centre_runs(design: Array) -> NDArray[np.bool_]:
    """Return which runs of a two-level design are its centre points, (n,); none in any other design."""
    centre = ~np.any(design, axis=1)
    two_level = bool(np.all(np.abs(design[~centre]) == 1.0))
    return np.asarray(centre if two_level and not centre.all() else np.zeros(len(design), dtype=bool))


def with_centre(error: ErrorTerm, centre: Array) -> ErrorTerm:
    """Return the error term with the scatter of the centre runs in it; without it where they agree."""
    pure = _pure(centre)
    if error.source == "lenth" or not pure:
        return error
    if error.exact or not error.df:
        return replace(error, sum_of_squares=pure, df=len(centre) - 1, centre_df=len(centre) - 1, exact=False)
    total, df = error.sum_of_squares + pure, error.df + len(centre) - 1
    return replace(error, sum_of_squares=total, df=df, centre_df=len(centre) - 1)


def curvature_of(corners: Array, centre: Array, error: ErrorTerm, alpha: float) -> Curvature | None:
    """Return how far the centre lies off the plane of the corners; None without centre runs."""
    if not len(centre):
        return None
    n_f, n_c = len(corners), len(centre) if _pure(centre) else 1
    high, middle = float(corners.mean()), float(centre.mean())
    square = n_f * n_c * (high - middle) ** 2 / (n_f + n_c)
    test = f_test(square, 1, error.mean_square, error.df)
    f, p = test if test else (None, None)
    return Curvature(high, middle, n_c, high - middle, square, f, p, error.df, p is not None and p < alpha)


def _pure(centre: Array) -> float:
    """Return the scatter of centre runs; 0 where they agree but for rounding."""
    pure = float(np.sum((centre - centre.mean()) ** 2)) if len(centre) > 1 else 0.0
    return pure if pure > NEGLIGIBLE * float(centre @ centre) else 0.0
