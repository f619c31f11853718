"""What to beware of in a screening: what the error is worth, where methods disagree, what hides what."""

from collections.abc import Iterator, Sequence

import numpy as np

from stemcal.doe.designs.aliases import aliases_note
from stemcal.doe.designs.definitive_screening import spare_column_note
from stemcal.doe.regression.least_squares import Array, LeastSquares
from stemcal.doe.regression.surface_notes import FlatResponse
from stemcal.doe.screening.effect_sizes import Conclusion, Effect
from stemcal.doe.screening.error_term import ErrorTerm
from stemcal.doe.screening.lenth import Lenth, fold_over_gain
from stemcal.notes import Note, Weight

# With so few residual degrees of freedom an F test says little.
_WEAK_DF = 3


class ScreeningRunsFailed(Note, weight=Weight.NUMBERS):
    """Runs failed, so the design is no longer orthogonal."""

    failed: int
    runs: int
    df: int


class PooledError(Note):
    """The error pools the unused columns with these small effects."""

    pooled: tuple[str, ...]
    df: int


class LenthError(Note):
    """p-values are those of Lenth's method."""


class ReplicateError(Note):
    """The error is the scatter of repeated runs; None: there is none."""

    df: int | None


class NoResidual(Note):
    """Every column carries a factor."""


class ExactResidual(Note):
    """The residual is exactly zero."""


class WeakError(Note):
    """The error has few degrees of freedom, of unused columns only."""

    df: int


class TooFewEffects(Note):
    """Lenth's method needs three."""


class MethodsDisagree(Note, weight=Weight.USE):
    """p and Lenth's margin of error disagree on a factor."""

    factor: str
    p: float
    alpha: float
    effect: float
    margin: float


class NotAfterHolm(Note, weight=Weight.USE):
    """Factors below the level by themselves that stand out by no method among all that were tested."""

    factors: tuple[str, ...]
    alpha: float
    tested: int
    by_chance_percent: float


class InteractionOfStrongest(Note):
    """An interaction of the two strongest factors would show as effects of others."""

    first: str
    second: str
    shown_by: tuple[str, ...]


class UnusedContrasts(Note):
    """Lenth's margin is that of so many contrasts of the design, these of the unused columns among them.

    `decides` tells whether it chooses the factors, for F rests on these columns alone.
    """

    contrasts: tuple[float, ...]
    count: int
    decides: bool


def screening_notes(
    fit: LeastSquares,
    error: ErrorTerm,
    effects: Sequence[Effect],
    size: Lenth,
    unused: Array,
    design: Array,
    n_failed: int,
    alpha: float,
) -> tuple[Note, ...]:
    """Return what the error term is worth, where the methods disagree, and what hides what."""
    names = [effect.factor for effect in effects]
    return (
        *_error_notes(fit, error, names, n_failed),
        *([TooFewEffects()] if size.me is None else _disagreements(effects, size, alpha)),
        *_many_tests(effects, size, alpha),
        aliases_note(design, names),
        *spare_column_note(design),
        *_interaction_note(design, effects),
        *_unused_note(unused, size, margin_decides(error, fit, unused)),
        *_fold_over_note(design, effects, size, alpha),
    )


def _error_notes(fit: LeastSquares, error: ErrorTerm, names: Sequence[str], n_failed: int) -> Iterator[Note]:
    """What the error term is worth."""
    if n_failed:
        yield ScreeningRunsFailed(n_failed, len(fit.response) + n_failed, fit.df)
    if fit.flat:
        yield FlatResponse()
    elif error.source != "residual":
        yield _chosen_error_note(error, names)
    elif fit.df == 0:
        yield NoResidual()
    elif fit.exact:
        yield ExactResidual()
    elif fit.df <= _WEAK_DF and not error.centre_df:
        yield WeakError(fit.df)


def _chosen_error_note(error: ErrorTerm, names: Sequence[str]) -> Note:
    """What an error term other than the unused columns means."""
    if error.source == "lenth":
        return LenthError()
    if error.source == "pooled":
        return PooledError(tuple(names[i] for i in error.pooled), error.df)
    return ReplicateError(None if error.mean_square is None else error.df)


def _disagreements(effects: Sequence[Effect], size: Lenth, alpha: float) -> Iterator[Note]:
    for effect in effects:
        if effect.p is not None and size.me is not None and (effect.p < alpha) != stands_out(effect, size):
            yield MethodsDisagree(effect.factor, effect.p, alpha, effect.effect, size.me)


def _many_tests(effects: Sequence[Effect], size: Lenth, alpha: float) -> Iterator[Note]:
    """Name what is below the level by itself, and stands out by no method among all the factors tested."""
    lost = tuple(e.factor for e in effects if e.p is not None and e.p < alpha and not among_all(e, size, alpha))
    if lost:
        yield NotAfterHolm(lost, alpha, len(effects), 100.0 * (1.0 - (1.0 - alpha) ** len(effects)))


def _interaction_note(design: Array, effects: Sequence[Effect]) -> Iterator[Note]:
    """The interaction of the two strongest factors is the likeliest to distort the other effects."""
    ranked = sorted(range(len(effects)), key=lambda i: -abs(effects[i].effect))
    if len(ranked) < 3:
        return
    a, b = sorted(ranked[:2])
    main = np.column_stack([np.ones(len(design)), design])
    weights = np.linalg.lstsq(main, design[:, a] * design[:, b], rcond=None)[0][1:]
    touched = tuple(effects[i].factor for i in range(len(effects)) if abs(weights[i]) > 1e-9)
    if touched:
        yield InteractionOfStrongest(effects[a].factor, effects[b].factor, touched)


def _unused_note(unused: Array, size: Lenth, decides: bool) -> Iterator[Note]:
    """The unused columns of a Plackett–Burman design as contrasts beside the effects."""
    if len(unused) and size.me:
        yield UnusedContrasts(tuple(unused.tolist()), size.m, decides)


def _fold_over_note(design: Array, effects: Sequence[Effect], size: Lenth, alpha: float) -> Iterator[Note]:
    """What a fold-over would cost and find."""
    if not size.me:
        return
    found = [(j, e.effect) for j, e in enumerate(effects) if stands_out(e, size) and among_all(e, size, alpha)]
    gain = fold_over_gain(design, found, size.me, alpha)
    if gain is not None:
        yield gain


def margin_decides(error: ErrorTerm, fit: LeastSquares, unused: Array) -> bool:
    """Tell whether F rests on a few unused columns alone, whose contrasts Lenth's margin counts as well."""
    return len(unused) > 0 and error.source == "residual" and not error.scatter and fit.df <= _WEAK_DF


def conclusion(effect: Effect, size: Lenth, alpha: float, expected: str | None) -> Conclusion:
    """Return whether a factor matters, by p and by Lenth's method, and the sign that it was expected to have."""
    by_p = effect.p < alpha if effect.p is not None else None
    by_lenth = stands_out(effect, size) if size.me is not None else None
    return Conclusion(by_p, by_lenth, among_all(effect, size, alpha), expected)


def stands_out(effect: Effect, size: Lenth) -> bool:
    """Tell whether an effect exceeds Lenth's margin of error."""
    return size.me is not None and abs(effect.effect) > size.me


def among_all(effect: Effect, size: Lenth, alpha: float) -> bool:
    """Tell whether the effect still stands out when all factors are tested at once."""
    holm = effect.p_holm is not None and effect.p_holm < alpha
    return holm or (size.sme is not None and abs(effect.effect) > size.sme)
