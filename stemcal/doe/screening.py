"""Two-level screening: which factors move the response, and how sure is that?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.aliases import describe_aliases
from stemcal.doe.lenth import Lenth, lenth
from stemcal.doe.regression import (
    ROUNDING,
    Array,
    LeastSquares,
    f_test,
    fit_least_squares,
    require_estimable,
    stars,
)
from stemcal.errors import RunsFailed, UsageError

# With so few residual degrees of freedom an F test says little.
_WEAK_DF = 3


@dataclass(frozen=True)
class Effect:
    """One factor's change of the response from its low to its high level, with its tests."""

    factor: str
    symbol: str
    effect: float
    contribution_percent: float
    sum_of_squares: float
    f: float | None
    p: float | None
    stars: str
    lenth_t: float | None
    p_holm: float | None
    p_bh: float | None


@dataclass(frozen=True)
class Screening:
    """Effects in the order of the factors, the error they are tested against, and what to beware of."""

    effects: tuple[Effect, ...]
    residual_sum_of_squares: float
    residual_df: int
    total_sum_of_squares: float
    lenth: Lenth
    alpha: float
    significant: tuple[str, ...]
    runs_used: int
    runs_failed: int
    notes: tuple[str, ...]

    def ranked(self) -> list[Effect]:
        """Sort the effects by contribution, the largest first."""
        return sorted(self.effects, key=lambda effect: -effect.contribution_percent)

    def as_dict(self) -> dict[str, Any]:
        """Return the statistics of ``screen.json``."""
        return {
            "effects": [asdict(effect) for effect in self.effects],
            "residual": {"sum_of_squares": self.residual_sum_of_squares, "df": self.residual_df},
            "total_sum_of_squares": self.total_sum_of_squares,
            "significant": list(self.significant),
            "lenth": self.lenth.as_dict(),
            "alpha": self.alpha,
            "runs_used": self.runs_used,
            "runs_failed": self.runs_failed,
            "notes": list(self.notes),
        }


def analyse_screening(
    coded: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    symbols: Sequence[str] | None = None,
    alpha: float = 0.05,
) -> Screening:
    """Estimate and test the main effects of a two-level design.

    Parameters
    ----------
    coded : array (n, k)
        Levels −1 and +1.
    response : array (n,)
        NaN for a failed run; the effects are then least-squares estimates from the runs left.
    names, symbols : sequences of k strings
    alpha : float
        Level of significance.

    Raises
    ------
    RunsFailed
        If the runs left cannot estimate every effect and its error.
    """
    design, y = _checked(coded, response, names)
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
    size = lenth(changes, alpha)
    effects = _effects(fit, changes, names, symbols or names, size)
    return Screening(
        effects=effects,
        residual_sum_of_squares=fit.residual_ss,
        residual_df=fit.df,
        total_sum_of_squares=fit.total_ss,
        lenth=size,
        alpha=alpha,
        significant=_significant(effects, size, alpha),
        runs_used=int(present.sum()),
        runs_failed=n_failed,
        notes=tuple(_notes(fit, effects, size, design[present], n_failed, alpha)),
    )


def _checked(coded: ArrayLike, response: ArrayLike, names: Sequence[str]) -> tuple[Array, Array]:
    design, y = np.asarray(coded, dtype=float), np.asarray(response, dtype=float)
    if design.ndim != 2 or design.shape != (y.size, len(names)):
        raise UsageError(
            f"screening: design of shape {design.shape} does not go with {y.size} responses and "
            f"{len(names)} factors"
        )
    return design, y


def _changes(fit: LeastSquares) -> Array:
    """Effect = 2β = mean(high) − mean(low) when the design is orthogonal; SS is then n/4·effect².

    Effects that are rounding become exactly zero, lest Lenth's method compare rounding with rounding.
    """
    floor = ROUNDING * float(fit.response @ fit.response)
    return np.where(fit.partial_ss[1:] <= floor, 0.0, 2.0 * fit.coefficients[1:])


def _effects(
    fit: LeastSquares, changes: Array, names: Sequence[str], symbols: Sequence[str], size: Lenth
) -> tuple[Effect, ...]:
    error = None if fit.exact else fit.mean_square
    tests = [f_test(float(ss), 1, error, fit.df) for ss in fit.partial_ss[1:]]
    raw = [test[1] if test else None for test in tests]
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


def adjusted_p(p: Sequence[float | None], method: str) -> list[float | None]:
    """Adjust p-values for testing all of them at once: ``holm`` or ``fdr_bh`` (Benjamini–Hochberg)."""
    known = [value for value in p if value is not None]
    if len(known) < len(p) or not known:
        return [None] * len(p)
    from statsmodels.stats.multitest import multipletests

    return [float(value) for value in multipletests(known, method=method)[1]]


def _stands_out(effect: Effect, size: Lenth) -> bool:
    return size.me is not None and abs(effect.effect) > size.me


def _significant(effects: Sequence[Effect], size: Lenth, alpha: float) -> tuple[str, ...]:
    """By p where there is one, else by Lenth's margin of error."""
    return tuple(
        effect.factor
        for effect in effects
        if (effect.p < alpha if effect.p is not None else _stands_out(effect, size))
    )


def _notes(
    fit: LeastSquares,
    effects: Sequence[Effect],
    size: Lenth,
    design: Array,
    n_failed: int,
    alpha: float,
) -> list[str]:
    names = [effect.factor for effect in effects]
    notes = _error_notes(fit, n_failed)
    if size.me is None:
        notes.append("Fewer than three effects: Lenth's method has nothing to take as noise.")
    for effect in effects:
        if effect.p is None or size.me is None or (effect.p < alpha) == _stands_out(effect, size):
            continue
        verdict = "is below" if effect.p < alpha else "is not below"
        side = "exceeds" if _stands_out(effect, size) else "stays within"
        notes.append(
            f"The two methods disagree on {effect.factor}: p = {effect.p:.4f} {verdict} {alpha:g}, but its "
            f"effect {effect.effect:+.4g} {side} Lenth's margin of error {size.me:.4g}."
        )
    return [*notes, describe_aliases(design, names), *_interaction_note(design, effects)]


def _error_notes(fit: LeastSquares, n_failed: int) -> list[str]:
    """What the residual is worth."""
    notes = []
    if n_failed:
        notes.append(
            f"{n_failed} of {len(fit.response) + n_failed} runs failed: the design is no longer orthogonal, "
            f"and effects and sums of squares are least-squares (type III) estimates with {fit.df} residual "
            "df that do not add up to the total; Lenth's method is approximate."
        )
    if fit.flat:
        notes.append("Every run gave the same response: no factor has an effect.")
    elif fit.df == 0:
        notes.append(
            "Every column carries a factor, so there is no residual and no p-value; Lenth's method decides "
            "alone."
        )
    elif fit.exact:
        notes.append("The residual is exactly zero, so no F can be formed; Lenth's method decides alone.")
    elif fit.df <= _WEAK_DF:
        notes.append(
            f"The error has only {fit.df} residual df (the unused columns), so the F tests are weak: read p "
            "beside Lenth's method and the adjusted p-values."
        )
    return notes


def _interaction_note(design: Array, effects: Sequence[Effect]) -> list[str]:
    """The interaction of the two strongest factors is the likeliest to distort the other effects."""
    ranked = sorted(range(len(effects)), key=lambda i: -abs(effects[i].effect))
    if len(ranked) < 3:
        return []
    a, b = sorted(ranked[:2])
    product = design[:, a] * design[:, b]
    main = np.column_stack([np.ones(len(design)), design])
    weights = np.linalg.lstsq(main, product, rcond=None)[0][1:]
    touched = [effects[i].factor for i in range(len(effects)) if abs(weights[i]) > 1e-9]
    if not touched:
        return []
    return [
        f"An interaction {effects[a].factor}:{effects[b].factor} of the two strongest factors would show up "
        f"in part as effects of {', '.join(touched)}."
    ]
