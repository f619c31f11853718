"""The response surface as a stage: its design run, its terms fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from math import isclose

import numpy as np

from stemcal.doe.designs import catalogue
from stemcal.doe.regression.backward_elimination import ReductionStep, reduce_surface
from stemcal.doe.regression.canonical import Shape, canonical_analysis
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.rows import Rows
from stemcal.folder import StudyFolder
from stemcal.naming import FIRST, Names
from stemcal.note import Note, Remedy
from stemcal.runs.answer import reasons_given
from stemcal.runs.record import lower_bound_notes
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Asked, Design, given_coded, given_levels, runs_of
from stemcal.stages.fitting import AtCondition, ConditionRun, FactorCoding, FitSummary
from stemcal.stages.fresh import read_fresh
from stemcal.stages.result import CodedScale, DesignRun, DesignRuns, Head
from stemcal.stages.screen.options import is_screened
from stemcal.stages.stage import stage_called
from stemcal.stages.surface.options import RsmOptions, Screened, factors_taken, surface_factors
from stemcal.stages.surface.result import SurfaceResult, told_by
from stemcal.stages.work import Work, a_stage, repeats_itself
from stemcal.study.model import Growth, Study, Target
from stemcal.words import series

_USUAL_FACTORS = 3  # that a screening keeps
_KEPT_P = 0.1  # terms with a larger p are removed


@a_stage(SurfaceResult)
def fit_response_surface(work: Work, head: Head) -> SurfaceResult:
    """Run the design of the surface over the factors that matter and fit it."""
    study, solver = work.study, work.solver
    before = _read_before(study, solver, work.folder)
    names, chosen = surface_factors(study, solver, before)
    design = surface_design(_recentred(study, before), solver, names)
    requests = design.requests(study.targets.calibrate_at)
    answers = work.answers(requests)
    runs = runs_of(design, requests, answers, solver).runs
    with reasons_given(requests, answers):
        fit, reduction = _fit_terms(study, design, runs)
    result = _result(study, head, design, DesignRuns(design.kind, Rows(runs)), fit, reduction)
    result = replace(
        result, conditions=Rows(_at_condition(work, target, result, design) for target in study.joint_targets)
    )
    return replace(result, notes=(*chosen, *fit.notes, *lower_bound_notes(answers), *_notes(result)))


def _notes(result: SurfaceResult) -> Iterator[Note]:
    """Yield what the reduction, the shape and repeated runs show."""
    if result.reduction is not None:
        removed = (
            f"Backward elimination removed {series(step.term for step in result.reduction)}. The same runs selected "
            f"the terms, so p-values and intervals are slightly optimistic."
        )
        yield Note("reduction", "caution", removed if result.reduction else "Backward elimination removed no terms.")
    if result.canonical is not None:
        yield Note("shape", "info", _shape(result.canonical, Names(result.naming)))
    repeats = result.pure_error
    if repeats is not None and (repeats.kind in ("scatter_of_seeds", "equal_seeds") or result.lack_of_fit_testable):
        yield repeats


def _shape(shape: Shape, names: Names) -> str:
    if shape.predicted is None:
        return "The surface has no single stationary point: it is a plane, or constant along some direction."
    return (
        f"The stationary point ({shape.called}, {names.quantity(shape.predicted)}) is at coded radius "
        f"{shape.coded_radius:.2f}, {'inside' if shape.inside else 'outside'} the design region."
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
        anova=fit.anova,
        **told_by(fit),
        reduction=reduction,
        canonical=canonical_analysis(fit, design.coding),
        deterministic=repeats_itself(study),
        pure_error=_pure_error_of(runs, Names(study.naming), study.replicates > 0),
    )


def _entry(study: Study, design: Design, j: int) -> FactorCoding:
    f, coding = study.factor(design.names[j]), design.coding
    return FactorCoding(f.name, coding.centre[j], coding.half_step[j], f.symbol, f.label, f.unit, f.low, f.high)


def _read_before(study: Study, solver: Solver, folder: StudyFolder) -> Screened | None:
    """Return the screening, or the climb, that the surface follows; None where the spec names its factors."""
    before = stage_called("rsm").needs(study)
    return read_fresh(study, solver, folder, stage_called(before).result()) if before else None


def _recentred(study: Study, before: Screened | None) -> Study:
    """Return the study with the coding that a climb found; what the spec itself codes stays."""
    if before is None or not before.coding:
        return study
    rsm, found = (
        study.of(RsmOptions),
        {n: (e.center - e.half_step, e.center + e.half_step) for n, e in before.coding.items()},
    )
    return study.model_copy(update={"rsm": rsm.model_copy(update={"coding": {**found, **rsm.coding}})})


def _fit_terms(
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
    design = surface_design(_recentred(study, _known_before(study, solver, folder)), solver, names)
    conditions = [study.targets.calibrate_at, *(target.condition for target in study.joint_targets)]
    requests = [request for condition in dict.fromkeys(conditions) for request in design.requests(condition)]
    text = f"The plan assumes {len(names)} factors for the surface; the screening decides which."
    assumed = None if known else Note("factors_assumed", "caution", text)
    return Asked("rsm", requests, known is not None, assumed, design)


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
        return None if folder is None else _read_before(study, solver, folder)
    return None


# ---- the design run at the other diameters of a joint fit


def _at_condition(work: Work, target: Target, result: SurfaceResult, design: Design) -> AtCondition:
    """Run the design at a diameter of the joint fit and fit the surfaces there, of the same terms as `result`."""
    condition, study = target.condition, work.study
    wanted = [n for n in study.fitted_responses if n == FIRST or target.mean_of(n)[0]]
    requests = design.requests(condition)
    answers = work.answers(requests)
    outcomes = zip(requests, work.outcomes(requests, answers), strict=True)
    runs = [ConditionRun(run=request.row + 1, outcome=outcome) for request, outcome in outcomes]
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
            f"{place}the record of run {silent[0]} has no {name} because another version or solver wrote it; use "
            "another study folder (--out), or remove the response from invert.responses"
        )
    return FitSummary.of(result.refitted(runs, response=response), whole=not study.naming.is_cutting)


# ---- the design, and the notes of `check` on it


def surface_design(study: Study, solver: Solver, names: Sequence[str]) -> Design:
    """Return the design of the spec over the named factors, or the rows the solver has."""
    coding, rsm = _surface_coding(study, names), study.of(RsmOptions)
    given = solver.given_design("rsm")
    if given is None:
        coded = catalogue.surface_runs(len(names), rsm.chosen())
        once = Design("rsm", rsm.design, coding, coded, coding.runs(coded, study.midlevels()))
        return once.repeated(study.replicates)
    return Design("rsm", "given", coding, given_coded(coding, given), given_levels(study, given))


def _surface_coding(study: Study, names: Sequence[str]) -> Coding:
    """Return the coding of the spec; factors without one have the outermost runs at low and high."""
    factors, rsm = [study.factor(name) for name in names], study.of(RsmOptions)
    ranged = Coding.from_ranges(names, [f.low for f in factors], [f.high for f in factors], reach=rsm.reach(len(names)))
    coded = {name: rsm.coded(name) for name in rsm.coding}
    return Coding(
        tuple(names),
        tuple(coded[n][0] if n in coded else c for n, c in zip(names, ranged.centre, strict=True)),
        tuple(coded[n][1] if n in coded else h for n, h in zip(names, ranged.half_step, strict=True)),
    )


def beforehand(study: Study) -> Iterator[Note]:
    """Yield notes on a design that takes other numbers of factors than may be significant, and on factors left out."""
    rsm = study.of(RsmOptions)
    least, most = factors_taken(rsm.design)
    if least > 2 and rsm.factors == "significant":
        yield _factors_wanted(rsm.design, least, most, len(study.factors))
    if not isinstance(rsm.factors, str):
        yield from _not_varied(study, rsm.factors)


def _factors_wanted(design: str, least: int, most: int, factors: int) -> Note:
    needs = f"rsm.design {design} requires {least} to {most} factors"
    if factors < least:
        text = f"{needs}, but this study has {factors}: the study will stop after the screening."
        return Note("too_few_factors", "caution", text, Remedy("Use central-composite."))
    text = (
        f"{needs}. If fewer factors are significant, the surface uses the {least} factors with the largest "
        f"contribution, and some terms are noise; if more are significant, it uses the {most} strongest."
    )
    remedy = Remedy(f"Set `rsm.factors: strongest {least}`, or use central-composite, which needs only two factors.")
    return Note("factors_wanted", "caution", text, remedy)


def _not_varied(study: Study, chosen: Sequence[str]) -> Iterator[Note]:
    """Yield the factors that stay at mid-level; an exponent changes nothing where its growth is one."""
    at = study.targets.calibrate_at
    grown = [growth for growth in study.material.growing().values() if isinstance(growth, Growth)]
    unseen = {growth.exponent for growth in grown if isclose(growth.at, at)}
    for factor in study.factors:
        screened = is_screened(study) and factor.name not in unseen
        if not screened and factor.name not in chosen:
            text = (
                f"{factor.name} is neither screened nor listed in rsm.factors, so it stays at {factor.centre:g} in all "
                "runs."
            )
            remedy = Remedy("List the factor in rsm.factors, or set a fixed value instead of the range.")
            yield Note("not_varied", "caution", text, remedy)


# ---- what repeated runs show


def _pure_error_of(design: DesignRuns, names: Names, by_chance: bool = False) -> Note | None:
    """Return what repeated runs show; None if there are none.

    A solver that computes gives equal answers to equal inputs; repeated runs that differ were not equal, but for a
    program with chance in it.
    """
    groups: dict[tuple[float, ...], list[float]] = {}
    for run in design.runs:
        if run.response is not None:
            groups.setdefault(tuple(run.coded.values()), []).append(run.response)
    repeated = [responses for responses in groups.values() if len(responses) > 1]
    if not repeated:
        return None
    widest = max(repeated, key=lambda responses: max(responses) - min(responses))
    same = max(widest) - min(widest) <= 1e-9 * max(map(abs, widest))
    if same and by_chance:
        remedy = Remedy("Remove `replicates`, or pass {{seed}} to the program.")
        return Note("equal_seeds", "caution", "Runs with different seeds agree exactly.", remedy)
    if same:
        text = "Repeated runs agree exactly: the solver is deterministic, and there is no pure error."
        return Note("equal_repeats", "caution", text)
    if by_chance:
        return _scatter(repeated, names)
    text = (
        f"{len(widest)} runs at the same levels gave responses from {names.quantity(min(widest), 'g')} to "
        f"{names.quantity(max(widest), 'g')}. A deterministic solver gives one response for one set of levels, so "
        "these runs must differ in something that is not recorded."
    )
    return Note("unequal_repeats", "caution", text)


def _scatter(repeated: Sequence[Sequence[float]], names: Names) -> Note:
    df = sum(len(responses) - 1 for responses in repeated)
    square = sum(float(np.sum((np.array(responses) - np.mean(responses)) ** 2)) for responses in repeated) / df
    sd = names.quantity(square**0.5, ".3g")
    text = f"Runs at the same levels, each with its own seed, scatter with a standard deviation of {sd} ({df} df)."
    return Note("scatter_of_seeds", "caution", text)
