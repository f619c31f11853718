"""The screening: design rows → responses → effects, and the factors that matter.

One rule chooses the factors: the F test against the residual where that has three or more degrees of freedom,
otherwise Lenth's method. The residual holds the columns without a factor, repeated runs and the scatter of centre runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe import designs
from stemcal.doe.aliases import aliases_note
from stemcal.doe.coding import Array, Coding
from stemcal.doe.effects import (
    Curvature,
    Effect,
    centre_runs,
    curvature_of,
    effects_of,
    is_beyond_margin,
    residual_of,
)
from stemcal.doe.lenth import FEWEST, Lenth
from stemcal.doe.regression.least_squares import LeastSquares, fit_least_squares, require_estimable
from stemcal.doe.regression.surface import flat_response
from stemcal.errors import RunsFailed, UsageError
from stemcal.formats import counted, signed_probability
from stemcal.notes import Note
from stemcal.runs.answer import reasons_given
from stemcal.runs.record import lower_bound_notes
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Asked, Design, given_design, runs_of
from stemcal.stages.result import Head
from stemcal.stages.screen.options import ScreenOptions
from stemcal.stages.screen.result import LEAST_DF, Screening, ScreenResult
from stemcal.stages.work import Work, a_stage
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST, Wording


@a_stage(ScreenResult)
def screen(work: Work, head: Head) -> ScreenResult:
    """Run the screening design and find the factors that move the response."""
    study, options, design = work.study, work.study.of(ScreenOptions), screening_design(work.study, work.solver)
    symbols = [factor.symbol for factor in study.factors]
    requests = design.requests(study.targets.calibrate_at)
    outcomes = work.outcomes(requests)
    with reasons_given(requests, outcomes):
        runs = runs_of(design, requests, outcomes)
        first, *others = (
            analyse_screening(
                design.coded,
                [run.number(name) for run in runs.runs],
                design.names,
                symbols,
                options.alpha,
                Wording(study.naming.with_primary(name)),
            )
            for name in (FIRST, *study.own_further)
        )
    notes = (*first.notes, *lower_bound_notes(outcomes))
    further = dict(zip(study.own_further, others, strict=True)) or None
    found = vars(first) | {"notes": notes, "responses": further}
    return ScreenResult(head=head, design=runs, alpha=options.alpha, **found)


# ---- the design


def screening_design(study: Study, solver: Solver) -> Design:
    """Return the screening design over all factors, or the rows the solver has."""
    factors = study.factors
    coding = Coding.from_ranges(study.names, [f.low for f in factors], [f.high for f in factors])
    given = solver.given_design("screen")
    if given is None:
        chosen = study.of(ScreenOptions)
        if chosen.design == "none":
            raise UsageError("screen.design: the value is `none`. Choose a design for the screening.")
        corners = designs.screening_runs(chosen.design, len(factors), chosen.runs, chosen.fold_over)
        coded = np.vstack([corners, np.zeros((chosen.centre_points, len(factors)))])
        kind = f"{chosen.design}, folded over" if chosen.fold_over else chosen.design
        once = Design("screen", kind, coding, coded, coding.runs(coded, study.midlevels()), order=1)
        return once.repeated(study.solver.repeats)
    return given_design("screen", study, coding, given, order=1)


def foresee(study: Study, solver: Solver, folder: StudyFolder | None) -> Asked:
    """Return the runs of the screening."""
    design = screening_design(study, solver)
    return Asked("screen", design.requests(study.targets.calibrate_at), settled=True, design=design)


# ---- the factors that matter


def analyse_screening(
    coded: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    symbols: Sequence[str] | None = None,
    alpha: float = 0.05,
    written: Wording = Wording(),
) -> Screening:
    """Estimate and test the main effects of a screening design.

    Parameters
    ----------
    coded : array (n, k)
        Levels −1 and +1, and 0 at centre points.
    response : array (n,)
        NaN for a failed run; the effects are then least-squares estimates from the runs left.
    names, symbols : sequences of k strings
    alpha : float
        Level of significance.
    written : Wording
        How notes name the response.

    Raises
    ------
    RunsFailed
        If the runs left cannot estimate every effect and its error.
    """
    whole, responses = np.asarray(coded, dtype=float), np.asarray(response, dtype=float)
    middle = centre_runs(whole)
    design, y, centre = whole[~middle], responses[~middle], responses[middle & np.isfinite(responses)]
    present = np.isfinite(y)
    n_failed = int(np.sum(~present))
    matrix = np.column_stack([np.ones(int(present.sum())), design[present]])
    require_estimable(matrix, ["1", *names], n_failed, "screening")
    fit = fit_least_squares(matrix, y[present])
    if n_failed and fit.df < 1:
        raise RunsFailed(
            f"screen: {n_failed} of {len(y)} runs failed, which leaves no residual degrees of freedom. Correct the "
            "cause of the failures and repeat the failed runs with `stemcal run SPEC --retry`."
        )
    residual, mean_square = residual_of(fit, centre)
    effects, size = effects_of(fit, residual, mean_square, names, symbols or names, alpha)
    tested = mean_square is not None and residual.df >= LEAST_DF
    by_lenth = size.me is not None and not tested
    significant = [is_beyond_margin(e, size) if by_lenth else e.p is not None and e.p < alpha for e in effects]
    curvature = curvature_of(fit, centre, residual, mean_square, alpha)
    notes = _screening_notes(
        fit, residual.df, effects, size, design[present], n_failed, alpha, tested, curvature, written
    )
    return Screening(
        effects=Rows(effects),
        significant=tuple(name for name, chosen in zip(names, significant, strict=True) if chosen),
        lenth=size,
        residual=residual,
        total_sum_of_squares=fit.total_ss,
        curvature=curvature,
        runs_used=int(present.sum()) + len(centre),
        runs_failed=int(np.sum(~np.isfinite(responses))),
        notes=notes,
    )


# ---- which test decides, where the tests disagree, what hides what


def _screening_notes(
    fit: LeastSquares,
    df: int,
    effects: Sequence[Effect],
    size: Lenth,
    design: Array,
    n_failed: int,
    alpha: float,
    tested: bool,
    curvature: Curvature | None,
    written: Wording,
) -> tuple[Note, ...]:
    """Return notes on the choice of the factors; `tested` if the F test makes it."""
    found = [] if curvature is None else [_curvature(curvature, written)]
    if n_failed:
        text = (
            f"{n_failed} of {len(fit.response) + n_failed} runs failed, so the design is no longer orthogonal. The "
            f"sums of squares (type III, {fit.df} residual df) do not add up to the total sum of squares. The results "
            "of Lenth's method are approximate."
        )
        found.append(Note("screening_runs_failed", "warning", text))
    if fit.flat:
        found.append(flat_response("no factor has an effect"))
    elif len(effects) < FEWEST:
        text = (
            f"The significant factors are identified by the F test because Lenth's method requires at least {FEWEST} "
            "effects."
        )
        found.append(Note("too_few_effects", "caution", text))
    elif not tested:
        few = "the residual sum of squares is zero"
        if df < LEAST_DF:
            few = f"the number of residual degrees of freedom is only {df}"
        text = f"The significant factors are identified by Lenth's method because {few}."
        found.append(Note("lenth_decides", "caution", text))
    found += _disagreements(effects, size, alpha, written)
    return (*found, aliases_note(design, [effect.factor for effect in effects]))


def _curvature(found: Curvature, written: Wording) -> Note:
    means = (
        f"At the centre, the main effects predict a {written.response.long} of {written.quantity(found.corners)}, and "
        f"the observed mean is {written.quantity(found.centre)} ({counted(found.runs, 'run')})."
    )
    if found.f is None or found.p is None:
        return Note("curvature", "caution", f"{means} The curvature cannot be tested without an estimate of the error.")
    significance = "significant" if found.curved else "not significant"
    test = f"F(1, {found.df}) = {found.f:.3g}, p {signed_probability(found.p)}"
    return Note("curvature", "caution", f"{means} The curvature is {significance} ({test}).")


def _disagreements(effects: Sequence[Effect], size: Lenth, alpha: float, written: Wording) -> Iterator[Note]:
    for effect in effects:
        if effect.p is None or size.me is None or (effect.p < alpha) == is_beyond_margin(effect, size):
            continue
        yes, no = ("the F test", "Lenth's method") if effect.p < alpha else ("Lenth's method", "the F test")
        text = (
            f"The effect of {effect.factor} is significant by {yes} but not by {no} (p {signed_probability(effect.p)}; "
            f"effect {written.quantity(effect.effect, '+.4g')}, margin of error {written.quantity(size.me)})."
        )
        yield Note("methods_disagree", "warning", text)
