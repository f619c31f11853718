"""What a screening means, in sentences: a verdict per factor, and what to beware of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stemcal.doe.designs.aliases import describe_aliases
from stemcal.doe.regression.least_squares import Array, LeastSquares
from stemcal.doe.screening.effect_sizes import Effect
from stemcal.doe.screening.error_term import ErrorTerm
from stemcal.doe.screening.fold import fold_over_gain
from stemcal.doe.screening.lenth import Lenth, lenth
from stemcal.doe.screening.unused import contrasts, unused_columns
from stemcal.naming import FORCE, Named
from stemcal.remarks import Remark, Weight
from stemcal.words import joined

# With so few residual degrees of freedom an F test says little.
_WEAK_DF = 3
_FAILED = Remark(
    Weight.NUMBERS,
    "{failed} of {runs} runs failed: the design is no longer orthogonal, and effects and sums of squares are "
    "least-squares (type III) estimates with {df} residual df that do not add up to the total; Lenth's method is "
    "approximate.",
)
_FLAT = Remark(Weight.NUMBERS, "Every run gave the same response: no factor has an effect.")
_DISAGREE = Remark(
    Weight.USE,
    "The two methods disagree on {factor}: p = {p:.4f} {verdict} {alpha:g}, but its effect {effect:+.4g} {side} "
    "Lenth's margin of error {margin:.4g}.",
)
_NOT_AFTER_HOLM = Remark(
    Weight.USE,
    "{factors} has p below {alpha:g} alone, not after Holm's correction: of {tested} factors without effect one at "
    "least would with a probability of up to {by_chance:.0f} %.",
)


def screening_notes(
    fit: LeastSquares,
    error: ErrorTerm,
    effects: Sequence[Effect],
    size: Lenth,
    design: Array,
    n_failed: int,
    alpha: float,
    response: Named = FORCE,
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
            _DISAGREE(
                factor=effect.factor,
                p=effect.p,
                verdict=verdict,
                alpha=alpha,
                effect=effect.effect,
                side=side,
                margin=size.me,
            )
        )
    return [
        *notes,
        *_many_tests(effects, size, alpha),
        describe_aliases(design, names),
        *_interaction_note(design, effects),
        *_unused_note(design, fit, effects, alpha, response),
        *_fold_over_note(design, effects, size, alpha, response),
    ]


def _unused_note(
    design: Array, fit: LeastSquares, effects: Sequence[Effect], alpha: float, response: Named
) -> list[str]:
    """Say what Lenth's margin is with the unused columns of a Plackett–Burman design beside the effects."""
    columns = unused_columns(design)
    if columns is None or len(effects) < 3 or fit.flat:
        return []
    left = contrasts(columns, fit.response)
    size = lenth(np.concatenate([[e.effect for e in effects], left]), alpha)
    beyond = [e.factor for e in effects if stands_out(e, size)]
    return [
        f"With the unused columns, contrasts of {joined([f'{value:+.3g}' for value in left])}{response.beside}, "
        f"Lenth's margin of {len(effects) + len(left)} is {size.me:.4g}{response.beside}: beyond it "
        f"{'is' if len(beyond) == 1 else 'are'} {joined(beyond) or 'none'}."
    ]


def _fold_over_note(design: Array, effects: Sequence[Effect], size: Lenth, alpha: float, response: Named) -> list[str]:
    """Advise a fold-over with what it would cost and find."""
    if not size.me:
        return []
    found = [(j, e.effect) for j, e in enumerate(effects) if stands_out(e, size) and _among_all(e, size, alpha)]
    gain = fold_over_gain(design, found, size.me, alpha)
    return [] if gain is None else [gain.describe(response)]


def _many_tests(effects: Sequence[Effect], size: Lenth, alpha: float) -> list[str]:
    """Name what is below the level by itself, and stands out by no method among all the factors tested."""
    lost = [e.factor for e in effects if e.p is not None and e.p < alpha and not _among_all(e, size, alpha)]
    if not lost:
        return []
    by_chance = 100.0 * (1.0 - (1.0 - alpha) ** len(effects))
    return [_NOT_AFTER_HOLM(factors=joined(lost), alpha=alpha, tested=len(effects), by_chance=by_chance)]


def stands_out(effect: Effect, size: Lenth) -> bool:
    """Tell whether an effect exceeds Lenth's margin of error."""
    return size.me is not None and abs(effect.effect) > size.me


def _error_notes(fit: LeastSquares, error: ErrorTerm, names: Sequence[str], n_failed: int) -> list[str]:
    """What the error term is worth."""
    notes = []
    if n_failed:
        notes.append(_FAILED(failed=n_failed, runs=len(fit.response) + n_failed, df=fit.df))
    if fit.flat:
        notes.append(_FLAT())
    elif error.source != "residual":
        notes.append(_chosen_error_note(error, names))
    elif fit.df == 0:
        notes.append(
            "Every column carries a factor, so there is no residual and no p-value; Lenth's method decides alone."
        )
    elif fit.exact:
        notes.append("The residual is exactly zero, so no F can be formed; Lenth's method decides alone.")
    elif fit.df <= _WEAK_DF and not error.centre_df:
        notes.append(
            f"The error has only {fit.df} residual df (the unused columns), so the F tests are weak: read p "
            "beside Lenth's method and the adjusted p-values. Without repeated runs these columns hold no scatter: "
            "what is in them is interactions, aliased."
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
    return f"The error is the scatter of repeated runs ({error.df} df)."


def verdict(effect: Effect, size: Lenth, error: ErrorTerm, alpha: float, expected: str | None) -> str:
    """Say in a sentence whether a factor matters, by p and by Lenth's method, and whether its sign fits."""
    lenth_says = stands_out(effect, size) if size.me is not None else None
    p_says = effect.p < alpha if effect.p is not None else None
    votes = [vote for vote in (p_says, lenth_says) if vote is not None]
    together = _among_all(effect, size, alpha)
    direction = "raises" if effect.effect > 0.0 else "lowers"
    said = (
        f"from low to high it {direction} the response by {abs(effect.effect):.4g} "
        f"({effect.contribution_percent:.1f} % of the variation)"
    )
    measures = _measures(effect, p_says, lenth_says)
    if not votes or not any(votes):
        return f"{effect.factor} shows no effect beyond {_noise(error)}: {said}{measures}."
    sure = "may matter, but the methods disagree" if not all(votes) else "matters" if together else "may matter"
    return f"{effect.factor} {sure}: {said}{measures}{_alone(effect, together)}.{_sign_remark(effect, expected)}"


def _noise(error: ErrorTerm) -> str:
    """Name what an effect is told apart from: only repeated runs that differ show scatter."""
    if (error.source == "replicates" or error.centre_df) and error.mean_square is not None:
        return "the scatter of repeated runs"
    return "what aliased interactions can feign"


def _among_all(effect: Effect, size: Lenth, alpha: float) -> bool:
    """Tell whether the effect still stands out when all factors are tested at once."""
    holm = effect.p_holm is not None and effect.p_holm < alpha
    return holm or (size.sme is not None and abs(effect.effect) > size.sme)


def _alone(effect: Effect, together: bool) -> str:
    if together or effect.p_holm is None:
        return "" if together else ", but not among all factors at once"
    return f", but not among all factors at once (Holm p = {effect.p_holm:.2g})"


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
