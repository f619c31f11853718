"""What a screening means, in sentences: a verdict per factor, and what to beware of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stemcal.doe.designs.aliases import describe_aliases
from stemcal.doe.regression.least_squares import Array, LeastSquares
from stemcal.doe.screening.effects import Effect
from stemcal.doe.screening.error_term import ErrorTerm
from stemcal.doe.screening.lenth import Lenth

# With so few residual degrees of freedom an F test says little.
_WEAK_DF = 3


def screening_notes(
    fit: LeastSquares,
    error: ErrorTerm,
    effects: Sequence[Effect],
    size: Lenth,
    design: Array,
    n_failed: int,
    alpha: float,
) -> list[str]:
    """Say what the error term is worth, where the methods disagree, and what hides what."""
    names = [effect.factor for effect in effects]
    notes = _error_notes(fit, error, names, n_failed)
    if size.me is None:
        notes.append("Fewer than three effects: Lenth's method has nothing to take as noise.")
    for effect in effects:
        if effect.p is None or size.me is None or (effect.p < alpha) == stands_out(effect, size):
            continue
        verdict = "is below" if effect.p < alpha else "is not below"
        side = "exceeds" if stands_out(effect, size) else "stays within"
        notes.append(
            f"The two methods disagree on {effect.factor}: p = {effect.p:.4f} {verdict} {alpha:g}, but its "
            f"effect {effect.effect:+.4g} {side} Lenth's margin of error {size.me:.4g}."
        )
    return [*notes, describe_aliases(design, names), *_interaction_note(design, effects)]


def stands_out(effect: Effect, size: Lenth) -> bool:
    """Tell whether an effect exceeds Lenth's margin of error."""
    return size.me is not None and abs(effect.effect) > size.me


def _error_notes(fit: LeastSquares, error: ErrorTerm, names: Sequence[str], n_failed: int) -> list[str]:
    """What the error term is worth."""
    notes = []
    if n_failed:
        notes.append(
            f"{n_failed} of {len(fit.response) + n_failed} runs failed: the design is no longer orthogonal, "
            f"and effects and sums of squares are least-squares (type III) estimates with {fit.df} residual "
            "df that do not add up to the total; Lenth's method is approximate."
        )
    if fit.flat:
        notes.append("Every run gave the same response: no factor has an effect.")
    elif error.source != "residual":
        notes.append(_chosen_error_note(error, names))
    elif fit.df == 0:
        notes.append(
            "Every column carries a factor, so there is no residual and no p-value; Lenth's method decides alone."
        )
    elif fit.exact:
        notes.append("The residual is exactly zero, so no F can be formed; Lenth's method decides alone.")
    elif fit.df <= _WEAK_DF:
        notes.append(
            f"The error has only {fit.df} residual df (the unused columns), so the F tests are weak: read p "
            "beside Lenth's method and the adjusted p-values."
        )
    return notes


def _chosen_error_note(error: ErrorTerm, names: Sequence[str]) -> str:
    """What an error term other than the unused columns means."""
    if error.source == "lenth":
        return "As chosen, p-values are those of Lenth's method; they hold if most factors have no effect."
    if error.source == "pooled":
        pooled = ", ".join(names[i] for i in error.pooled) or "no effect"
        return (
            f"As chosen, the error pools the unused columns and {pooled} ({error.df} df): effects that are "
            "small by chance make it small, so p-values look better than they are."
        )
    if error.mean_square is None:
        return "The error was to come from repeated runs, but no run is repeated, or all repeats agree exactly."
    return f"As chosen, the error is the scatter of repeated runs ({error.df} df)."


def verdict(effect: Effect, size: Lenth, alpha: float, expected: str | None) -> str:
    """Say in a sentence whether a factor matters, by p and by Lenth's method, and whether its sign fits."""
    lenth_says = stands_out(effect, size) if size.me is not None else None
    p_says = effect.p < alpha if effect.p is not None else None
    votes = [vote for vote in (p_says, lenth_says) if vote is not None]
    direction = "raises" if effect.effect > 0.0 else "lowers"
    said = (
        f"from low to high it {direction} the response by {abs(effect.effect):.4g} "
        f"({effect.contribution_percent:.1f} % of the variation)"
    )
    measures = _measures(effect, p_says, lenth_says)
    if not votes or not any(votes):
        return f"{effect.factor} shows no effect beyond the scatter: {said}{measures}."
    sure = "matters" if all(votes) else "may matter, but the methods disagree"
    return f"{effect.factor} {sure}: {said}{measures}.{_sign_remark(effect, expected)}"


def _measures(effect: Effect, p_says: bool | None, lenth_says: bool | None) -> str:
    parts = [] if p_says is None or effect.p is None else [f"p = {effect.p:.4f}"]
    if lenth_says is not None:
        parts.append("beyond Lenth's margin" if lenth_says else "within Lenth's margin")
    return f", {', '.join(parts)}" if parts else ""


def _sign_remark(effect: Effect, expected: str | None) -> str:
    if expected is None:
        return ""
    found = "+" if effect.effect > 0.0 else "-"
    return " Its sign is as expected." if found == expected else f" Its sign is against the expected {expected}."


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
