"""The analysis of the stage screen: run the design, estimate the effects, and select the factors.

Factors are selected by the F test if the residual has three or more degrees of freedom, otherwise by Lenth's method.
The residual consists of the design columns without a factor, repeated runs and the scatter of centre runs.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe import designs, effects
from stemcal.doe.coding import Coding
from stemcal.doe.regression.least_squares import LeastSquares, fit_least_squares, require_estimable
from stemcal.doe.regression.surface import flat_response
from stemcal.errors import RunsFailed, UsageError
from stemcal.formats import counted, signed_probability
from stemcal.notes import Note
from stemcal.runs.answer import failures_in_message
from stemcal.runs.record import lower_bound_notes
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Design, StageRuns, given_design, runs_of
from stemcal.stages.result import Head
from stemcal.stages.screen.options import ScreenOptions
from stemcal.stages.screen.result import LEAST_DF, Screening, ScreenResult
from stemcal.stages.work import Work, a_stage
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST, Wording


@a_stage(ScreenResult)
def screen(work: Work, head: Head) -> ScreenResult:
    """Run the screening design and find the factors with a significant effect."""
    study, options, design = work.study, work.study.of(ScreenOptions), screening_design(work.study, work.solver)
    symbols = [factor.symbol for factor in study.factors]
    requests = design.requests(study.targets.calibrate_at)
    outcomes = work.outcomes(requests)
    with failures_in_message(requests, outcomes):
        runs = runs_of(design, requests, outcomes)
        screenings = {}
        for name in (FIRST, *study.own_further):
            values, written = [run.number(name) for run in runs.runs], Wording(study.naming.with_primary(name))
            screenings[name] = analyse_screening(design.coded, values, design.names, symbols, options.alpha, written)
    first = screenings.pop(FIRST)
    parts = vars(first) | {"notes": (*first.notes, *lower_bound_notes(outcomes)), "responses": screenings or None}
    return ScreenResult(head=head, design=runs, alpha=options.alpha, **parts)


def screening_design(study: Study, solver: Solver) -> Design:
    """Return the screening design over all factors, or the design in the table of the solver."""
    factors = study.factors
    coding = Coding.from_ranges(study.names, [f.low for f in factors], [f.high for f in factors])
    table = solver.given_design("screen")
    if table is None:
        chosen = study.of(ScreenOptions)
        if chosen.design == "none":
            raise UsageError("screen.design: the value is `none`. Choose a design for the screening.")
        corners = designs.screening_runs(chosen.design, len(factors), chosen.runs, chosen.fold_over)
        coded = np.vstack([corners, np.zeros((chosen.centre_points, len(factors)))])
        kind = f"{chosen.design}, folded over" if chosen.fold_over else chosen.design
        once = Design("screen", kind, coding, coded, coding.runs(coded, study.midlevels()), order=1)
        return once.repeated(study.solver.repeats)
    return given_design("screen", study, coding, table, order=1)


def foresee(study: Study, solver: Solver, folder: StudyFolder | None) -> StageRuns:
    """Return the runs of the screening."""
    design = screening_design(study, solver)
    return StageRuns("screen", design.requests(study.targets.calibrate_at), settled=True, design=design)


def analyse_screening(
    coded: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    symbols: Sequence[str] | None = None,
    alpha: float = 0.05,
    written: Wording = Wording(),
) -> Screening:
    """Estimate the main effects of a two-level design and test them at the level of significance `alpha`.

    `coded` (n, k) has the levels −1 and +1, and 0 at centre points; `response` (n,) is NaN for a failed run. With
    failed runs the effects are least-squares estimates; raise `RunsFailed` if the remaining runs cannot estimate all
    effects and the error. `written` has the name and unit of the response for the notes.
    """
    whole, responses = np.asarray(coded, dtype=float), np.asarray(response, dtype=float)
    middle = effects.centre_runs(whole)
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
    residual, mean_square = effects.residual_of(fit, centre)
    rows, size = effects.effects_of(fit, residual, mean_square, names, symbols or names, alpha)
    tested = mean_square is not None and residual.df >= LEAST_DF
    by_lenth = size.me is not None and not tested
    significant = [effects.is_beyond_margin(e, size) if by_lenth else e.p is not None and e.p < alpha for e in rows]
    screening = Screening(
        effects=Rows(rows),
        significant=tuple(name for name, chosen in zip(names, significant, strict=True) if chosen),
        lenth=size,
        residual=residual,
        total_sum_of_squares=fit.total_ss,
        curvature=effects.curvature_of(fit, centre, residual, mean_square, alpha),
        runs_used=int(present.sum()) + len(centre),
        runs_failed=int(np.sum(~np.isfinite(responses))),
        notes=(),
    )
    notes = _screening_notes(screening, fit, n_failed, tested, alpha, written)
    return replace(screening, notes=(*notes, effects.aliases_note(design[present], names)))


def _screening_notes(
    screening: Screening, fit: LeastSquares, n_failed: int, tested: bool, alpha: float, written: Wording
) -> Iterator[Note]:
    """Yield notes on the selection of the factors; `tested` if the F test selects them."""
    if screening.curvature is not None:
        yield _curvature(screening.curvature, written)
    if n_failed:
        text = (
            f"{n_failed} of {len(fit.response) + n_failed} runs failed, so the design is no longer orthogonal. The "
            f"sums of squares (type III, {fit.df} residual df) do not add up to the total sum of squares. The results "
            "of Lenth's method are approximate."
        )
        yield Note("screening_runs_failed", "warning", text)
    if fit.flat:
        yield flat_response("no factor has an effect")
    elif len(screening.effects) < effects.FEWEST:
        why = f"Lenth's method requires at least {effects.FEWEST} effects"
        text = f"The significant factors are identified by the F test because {why}."
        yield Note("too_few_effects", "caution", text)
    elif not tested:
        why = "the residual sum of squares is zero"
        if screening.residual.df < LEAST_DF:
            why = f"the number of residual degrees of freedom is only {screening.residual.df}"
        text = f"The significant factors are identified by Lenth's method because {why}."
        yield Note("lenth_decides", "caution", text)
    for effect in screening.effects:
        size, p = screening.lenth, effect.p
        if p is None or size.me is None or (p < alpha) == effects.is_beyond_margin(effect, size):
            continue
        yes, no = ("the F test", "Lenth's method") if p < alpha else ("Lenth's method", "the F test")
        text = (
            f"The effect of {effect.factor} is significant by {yes} but not by {no} (p {signed_probability(p)}; "
            f"effect {written.quantity(effect.effect, '+.4g')}, margin of error {written.quantity(size.me)})."
        )
        yield Note("methods_disagree", "warning", text)


def _curvature(curvature: effects.Curvature, written: Wording) -> Note:
    means = (
        f"At the centre, the main effects predict a {written.response.long} of {written.quantity(curvature.corners)}, "
        f"and the observed mean is {written.quantity(curvature.centre)} ({counted(curvature.runs, 'run')})."
    )
    if curvature.f is None or curvature.p is None:
        return Note("curvature", "caution", f"{means} The curvature cannot be tested without an estimate of the error.")
    significance = "significant" if curvature.curved else "not significant"
    test = f"F(1, {curvature.df}) = {curvature.f:.3g}, p {signed_probability(curvature.p)}"
    return Note("curvature", "caution", f"{means} The curvature is {significance} ({test}).")
