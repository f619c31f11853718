"""The response surface as a stage: its design run, its terms fitted."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

from stemcal.doe.regression.backward_elimination import ReductionStep, reduce_surface
from stemcal.doe.regression.canonical import Shape, canonical_analysis
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.rows import Rows
from stemcal.folder import StudyFolder
from stemcal.naming import FIRST, Names
from stemcal.note import Note
from stemcal.runs.answer import reasons_given
from stemcal.runs.record import lower_bound_notes
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Asked, Design, runs_of
from stemcal.stages.fitting import AtCondition, ConditionRun, FactorCoding, FitSummary
from stemcal.stages.fresh import read_fresh
from stemcal.stages.result import CodedScale, DesignRun, DesignRuns, Head
from stemcal.stages.stage import stage_called
from stemcal.stages.surface.design import surface_design
from stemcal.stages.surface.options import RsmOptions, Screened, surface_factors
from stemcal.stages.surface.result import SurfaceResult, told_by
from stemcal.stages.surface.runs import pure_error_of
from stemcal.stages.surface.words import shape_name
from stemcal.stages.work import Work, a_stage, repeats_itself
from stemcal.study.model import Study, Target
from stemcal.words import series

_USUAL_FACTORS = 3  # that a screening keeps
_KEPT_P = 0.1  # terms with a larger p are removed


@a_stage(SurfaceResult)
def fit_response_surface(work: Work, head: Head) -> SurfaceResult:
    """Run the design of the surface over the factors that matter and fit it."""
    study, solver = work.study, work.solver
    before = read_before(study, solver, work.folder)
    names, chosen = surface_factors(study, solver, before)
    design = surface_design(recentred(study, before), solver, names)
    requests = design.requests(study.targets.calibrate_at)
    answers = work.answers(requests)
    runs = runs_of(design, requests, answers, solver).runs
    with reasons_given(requests, answers):
        fit, reduction = fit_terms(study, design, runs)
    result = _result(study, head, design, DesignRuns(design.kind, Rows(runs)), fit, reduction)
    result = replace(result, conditions=Rows(run_conditions(work, result, design)))
    return replace(result, notes=(*chosen, *fit.notes, *lower_bound_notes(answers), *_notes(result)))


def _notes(result: SurfaceResult) -> Iterator[Note]:
    """Yield what the reduction, the shape and repeated runs show."""
    if result.reduction is not None:
        removed = (
            f"Backward elimination removed {series(step.term for step in result.reduction)}. The same runs selected "
            f"the terms, so p-values and intervals are slightly optimistic."
        )
        yield Note("reduction", "caution", removed if result.reduction else "Backward elimination removed no term.")
    if result.canonical is not None:
        yield Note("shape", "info", _shape(result.canonical, Names(result.naming)))
    repeats = result.pure_error
    if repeats is not None and (repeats.kind in ("scatter_of_seeds", "equal_seeds") or result.lack_of_fit_testable):
        yield repeats


def _shape(shape: Shape, names: Names) -> str:
    if shape.predicted is None:
        return "The surface has no single stationary point: it is a plane, or constant along some direction."
    return (
        f"The stationary point ({shape_name(shape)}, {names.quantity(shape.predicted)}) is at coded radius "
        f"{shape.coded_radius:.2f}, {'inside' if shape.inside else 'outside'} the region of the runs."
    )


def _result(
    study: Study,
    head: Head,
    design: Design,
    runs: DesignRuns,
    fit: Surface,
    reduction: tuple[ReductionStep, ...] | None,
) -> SurfaceResult:
    """Return the result without what other conditions add."""
    entries = [_entry(study, design, j) for j in range(len(design.names))]
    return SurfaceResult(
        head=head,
        names=design.names,
        factors=Rows(entries),
        coding={e.factor: CodedScale(e.center, e.half_step) for e in entries},
        fixed={name: level for name, level in study.midlevels().items() if name not in design.names},
        radius=study.of(RsmOptions).radius(len(design.names)),
        design=runs,
        anova=Rows(fit.anova),
        **told_by(fit),
        reduction=reduction,
        canonical=canonical_analysis(fit, design.coding),
        deterministic=repeats_itself(study),
        pure_error=pure_error_of(runs, Names(study.naming), study.replicates > 0),
    )


def _entry(study: Study, design: Design, j: int) -> FactorCoding:
    f, coding = study.factor(design.names[j]), design.coding
    return FactorCoding(f.name, coding.centre[j], coding.half_step[j], f.symbol, f.label, f.unit, f.low, f.high)


def read_before(study: Study, solver: Solver, folder: StudyFolder) -> Screened | None:
    """Return the screening, or the climb, that the surface follows; None where the spec names its factors."""
    before = stage_called("rsm").needs(study)
    return read_fresh(study, solver, folder, stage_called(before).result()) if before else None


def recentred(study: Study, before: Screened | None) -> Study:
    """Return the study with the coding that a climb found; what the spec itself codes stays."""
    if before is None or not before.coding:
        return study
    rsm, found = (
        study.of(RsmOptions),
        {n: (e.center - e.half_step, e.center + e.half_step) for n, e in before.coding.items()},
    )
    return study.model_copy(update={"rsm": rsm.model_copy(update={"coding": {**found, **rsm.coding}})})


def fit_terms(
    study: Study, design: Design, runs: Sequence[DesignRun]
) -> tuple[Surface, tuple[ReductionStep, ...] | None]:
    """Fit the surface to runs as the spec chooses; returns it, and the terms removed if some were to be."""
    given, names = (design.coded, [run.number(FIRST) for run in runs], design.names), Names(study.naming)
    if study.of(RsmOptions).reduce == "none":
        return fit_surface(*given, written=names), None
    return reduce_surface(*given, _KEPT_P, names)


# ---- before it is run


def foresee(study: Study, solver: Solver, folder: StudyFolder | None) -> Asked:
    """Return the runs of the design, of an assumed number of factors as long as a screening has to choose."""
    known = _names(study, solver, folder)
    names = known or [factor.name for factor in study.factors[:_USUAL_FACTORS]]
    design = surface_design(recentred(study, _known_before(study, solver, folder)), solver, names)
    conditions = [study.targets.calibrate_at, *(target.condition for target in study.joint_targets)]
    requests = [request for condition in dict.fromkeys(conditions) for request in design.requests(condition)]
    return Asked("rsm", requests, known is not None, None if known else _factors_assumed(len(names)), design)


def _names(study: Study, solver: Solver, folder: StudyFolder | None) -> list[str] | None:
    """Return the factors of the surface as far as they are known now; None if a screening has still to choose."""
    before = stage_called("rsm").needs(study)
    given = solver.given_design("rsm")
    if before is None:
        return surface_factors(study, solver, None)[0]
    if given is not None:
        return [name for name in given[0] if name in study.names]
    known = _known_before(study, solver, folder)
    return None if known is None else surface_factors(study, solver, known)[0]


def _known_before(study: Study, solver: Solver, folder: StudyFolder | None) -> Screened | None:
    """Return the screening, or the climb that centres the surface, if it is there."""
    with suppress(UsageError):
        return None if folder is None else read_before(study, solver, folder)
    return None


def _factors_assumed(count: int) -> Note:
    text = f"The plan assumes {count} factors for the surface; the screening decides which."
    return Note("factors_assumed", "caution", text)


# ---- the design run at the other diameters of a joint fit


def run_conditions(work: Work, result: SurfaceResult, design: Design) -> list[AtCondition]:
    """Run the design at every diameter of the joint fit and fit the surfaces there, of the same terms as `result`."""
    return [_at_condition(work, target, result, design) for target in work.study.joint_targets]


def _at_condition(work: Work, target: Target, result: SurfaceResult, design: Design) -> AtCondition:
    condition, study = target.condition, work.study
    wanted = [n for n in study.fitted_responses if n == FIRST or target.mean_of(n)[0]]
    requests = design.requests(condition)
    answers = work.answers(requests)
    outcomes = zip(requests, work.outcomes(requests, answers), strict=True)
    told_of = [ConditionRun(run=request.row + 1, outcome=outcome) for request, outcome in outcomes]
    runs = told_of
    with reasons_given(requests, answers):
        fits = {name: _summary(study, result, runs, name, condition) for name in wanted}
    further: dict[str, FitSummary] = {name: fit for name, fit in fits.items() if name != FIRST}
    return AtCondition(condition=condition, runs=Rows(runs), fit=fits[FIRST], responses=further or None)


def _summary(
    study: Study, result: SurfaceResult, runs: Sequence[ConditionRun], response: str, condition: float
) -> FitSummary:
    """Return what is kept of the fit to one response."""
    silent = [run.run for run in runs if run.outcome.ok and run.outcome.of(response) is None]
    if silent:
        place = f"{study.naming.place(condition)}: ".removeprefix(": ")
        name = study.naming.named(response).name
        raise RunsFailed(
            f"{place}the record of run {silent[0]} has no {name}because another version or solver wrote it; use "
            "another study folder (--out), or remove the response from invert.responses"
        )
    return FitSummary.of(result.refitted(runs, response=response), whole=not study.naming.is_cutting)
