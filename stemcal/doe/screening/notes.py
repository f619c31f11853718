"""What to beware of in a screening: which test decides, where the tests disagree, what hides what."""

from collections.abc import Iterator, Sequence

import numpy as np

from stemcal.doe.designs.aliases import aliases_note
from stemcal.doe.regression.least_squares import Array, LeastSquares
from stemcal.doe.regression.surface_notes import flat_response
from stemcal.doe.screening.effects import Curvature, Effect, stands_out
from stemcal.doe.screening.lenth import FEWEST, Lenth
from stemcal.naming import Names
from stemcal.note import Note
from stemcal.numbers import signed_probability
from stemcal.words import counted, series

LEAST_DF = 3
"""Residual degrees of freedom from which the F test selects the factors."""


def screening_notes(
    fit: LeastSquares,
    df: int,
    effects: Sequence[Effect],
    size: Lenth,
    design: Array,
    n_failed: int,
    alpha: float,
    tested: bool,
    curvature: Curvature | None,
    written: Names,
) -> tuple[Note, ...]:
    """Return what the choice of the factors depends on; `tested` where the F test makes it."""
    found = [] if curvature is None else [_curvature(curvature, written)]
    if n_failed:
        text = (
            f"{n_failed} of {len(fit.response) + n_failed} runs failed: the design is no longer orthogonal. Effects "
            f"and sums of squares are least-squares (type III) estimates with {fit.df} residual df that do not add up "
            "to the total; Lenth's method is approximate."
        )
        found.append(Note("screening_runs_failed", "warning", text))
    if fit.flat:
        found.append(flat_response("no factor has an effect"))
    elif len(effects) < FEWEST:
        text = f"Lenth's method needs at least {FEWEST} effects: the F test selects the factors."
        found.append(Note("too_few_effects", "caution", text))
    elif not tested:
        few = f"The residual has {counted(df, 'degree')} of freedom, fewer than {LEAST_DF}"
        reason = few if df < LEAST_DF else "The residual is zero, so there is no F test"
        found.append(Note("lenth_decides", "caution", f"{reason}: Lenth's method selects the factors."))
    found += _disagreements(effects, size, alpha, written)
    names = [effect.factor for effect in effects]
    return (*found, aliases_note(design, names), *_interaction_note(design, effects))


def _curvature(found: Curvature, written: Names) -> Note:
    means = (
        f"Curvature: the mean response is {written.quantity(found.corners)} at the corners and "
        f"{written.quantity(found.centre)} at the centre ({counted(found.runs, 'run')})."
    )
    if found.f is None or found.p is None:
        return Note("curvature", "caution", f"{means} Without an estimate of error the difference cannot be tested.")
    outcome = "the response is curved, so a plane does not fit" if found.curved else "no curvature beyond the error"
    test = f"F(1, {found.df}) = {found.f:.3g}, p {signed_probability(found.p)}"
    return Note("curvature", "caution", f"{means} {test}: {outcome}.")


def _disagreements(effects: Sequence[Effect], size: Lenth, alpha: float, written: Names) -> Iterator[Note]:
    for effect in effects:
        if effect.p is None or size.me is None or (effect.p < alpha) == stands_out(effect, size):
            continue
        below, beyond = ("below", "is within") if effect.p < alpha else ("not below", "exceeds")
        text = (
            f"The two methods disagree on {effect.factor}: p {signed_probability(effect.p)} is {below} {alpha:g}, but "
            f"its effect {written.quantity(effect.effect, '+.4g')} {beyond} Lenth's margin of error "
            f"{written.quantity(size.me)}."
        )
        yield Note("methods_disagree", "warning", text)


def _interaction_note(design: Array, effects: Sequence[Effect]) -> Iterator[Note]:
    """The interaction of the two strongest factors is the likeliest to distort the other effects."""
    ranked = sorted(range(len(effects)), key=lambda i: -abs(effects[i].effect))
    if len(ranked) < 3:
        return
    a, b = sorted(ranked[:2])
    main = np.column_stack([np.ones(len(design)), design])
    weights = np.linalg.lstsq(main, design[:, a] * design[:, b], rcond=None)[0][1:]
    touched = [effects[i].factor for i in range(len(effects)) if abs(weights[i]) > 1e-9]
    if touched:
        pair = f"{effects[a].factor}:{effects[b].factor}"
        text = (
            f"An interaction {pair} of the two strongest factors would bias the estimated effects of {series(touched)}."
        )
        yield Note("interaction_of_strongest", "caution", text)
