"""What to beware of in a screening: which test decides, where the tests disagree, what hides what."""

from collections.abc import Iterator, Sequence

import numpy as np

from stemcal.doe.designs.aliases import aliases_note
from stemcal.doe.regression.least_squares import Array, LeastSquares
from stemcal.doe.regression.surface_notes import FlatResponse
from stemcal.doe.screening.effects import Effect, stands_out
from stemcal.doe.screening.lenth import FEWEST, Lenth
from stemcal.notes import Note, Weight


class ScreeningRunsFailed(Note, weight=Weight.NUMBERS):
    """Runs failed, so the design is no longer orthogonal."""

    failed: int
    runs: int
    df: int


class LenthDecides(Note):
    """The residual has too few degrees of freedom, or is zero: Lenth's method chooses the factors."""

    df: int


class TooFewEffects(Note):
    """Lenth's method needs three effects."""


class MethodsDisagree(Note, weight=Weight.USE):
    """p and Lenth's margin of error disagree on a factor."""

    factor: str
    p: float
    alpha: float
    effect: float
    margin: float


class InteractionOfStrongest(Note):
    """An interaction of the two strongest factors would show as effects of others."""

    first: str
    second: str
    shown_by: tuple[str, ...]


def screening_notes(
    fit: LeastSquares,
    df: int,
    effects: Sequence[Effect],
    size: Lenth,
    design: Array,
    n_failed: int,
    alpha: float,
    tested: bool,
) -> tuple[Note, ...]:
    """Return what the choice of the factors depends on; `tested` where the F test makes it."""
    found: list[Note] = []
    if n_failed:
        found.append(ScreeningRunsFailed(n_failed, len(fit.response) + n_failed, fit.df))
    if fit.flat:
        found.append(FlatResponse())
    elif len(effects) < FEWEST:
        found.append(TooFewEffects())
    elif not tested:
        found.append(LenthDecides(df))
    found += _disagreements(effects, size, alpha)
    names = [effect.factor for effect in effects]
    return (*found, aliases_note(design, names), *_interaction_note(design, effects))


def _disagreements(effects: Sequence[Effect], size: Lenth, alpha: float) -> Iterator[Note]:
    for effect in effects:
        if effect.p is not None and size.me is not None and (effect.p < alpha) != stands_out(effect, size):
            yield MethodsDisagree(effect.factor, effect.p, alpha, effect.effect, size.me)


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
