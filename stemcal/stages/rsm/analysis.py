"""The analysis of the stage rsm: run the design and fit the surface."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from stemcal.doe import designs
from stemcal.doe.coding import Coding
from stemcal.doe.regression.anova import FitStatistics
from stemcal.doe.regression.canonical import canonical_analysis
from stemcal.doe.regression.section import relative_percent
from stemcal.doe.regression.surface import ReductionStep, Surface, fit_surface, reduce_surface
from stemcal.errors import RunsFailed, UsageError
from stemcal.formats import counted, series
from stemcal.notes import Note, Remedy
from stemcal.runs.answer import failures_in_message
from stemcal.runs.record import lower_bound_notes
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Design, StageRuns, given_design, runs_of
from stemcal.stages.fitting import AtCondition, ConditionAxis, ConditionRun, FactorCoding, FitSummary
from stemcal.stages.fresh import read_fresh
from stemcal.stages.result import CodedScale, DesignRun, DesignRuns, Head, StageResult
from stemcal.stages.rsm import over
from stemcal.stages.rsm.options import RsmOptions, dimensions, surface_factors
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.stage import stage_called
from stemcal.stages.work import Work, a_stage, repeats_itself
from stemcal.storage.rows import Rows
from stemcal.study.model.measured_targets import Target
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST, Wording

_USUAL_FACTORS = 3  # assumed number of factors that a screening selects
_KEPT_P = 0.1  # terms with a larger p are removed


@a_stage(RsmResult)
def rsm(work: Work, head: Head) -> RsmResult:
    """Run the design over the selected factors and fit the response surface."""
    study, solver = work.study, work.solver
    names, coding, chosen = _factors(study, solver, _result_before(study, solver, work.folder))
    design = study_design(study, solver, names, coding)
    requests = design.requests(study.targets.calibrate_at)
    outcomes = work.outcomes(requests)
    runs = runs_of(design, requests, outcomes)
    axis = over.condition_axis(study, names) if design.conditions else None
    with failures_in_message(requests, outcomes):
        axis = axis and over.scaled(axis, study, design, runs.runs)
        fit, reduction = _fit_terms(study, design, runs.runs, axis)
    scales = _coding(study, names, coding)
    factors = zip(map(study.factor, names), scales.centre, scales.half_step, strict=True)
    entries = [FactorCoding(f.name, at, half, f.symbol, f.label, f.unit, f.low, f.high) for f, at, half in factors]
    result = RsmResult(
        head=head,
        names=scales.names,
        factors=Rows(entries),
        coding={e.factor: CodedScale(e.center, e.half_step) for e in entries},
        fixed={name: level for name, level in study.midlevels().items() if name not in names},
        radius=study.of(RsmOptions).radius(dimensions(study, names)),
        design=runs,
        **{field.name: getattr(fit, field.name) for field in fields(FitStatistics)},
        covariance=fit.covariance,
        reduction=reduction,
        canonical=canonical_analysis(fit, design.coding) if axis is None else None,
        over=axis,
        deterministic=repeats_itself(study),
        pure_error=_pure_error_of(runs, Wording(study.naming), study.solver.repeats > 0),
    )
    if axis is None:
        conditions = Rows(_at_condition(work, target, result, design) for target in study.joint_targets)
    else:
        conditions = Rows(_further_responses(study, result, axis))
    notes = (*chosen, *fit.notes, *lower_bound_notes(outcomes), *_notes(result))
    return replace(result, conditions=conditions, notes=notes)


def _notes(result: RsmResult) -> Iterator[Note]:
    if result.reduction is not None:
        removed = (
            f"Backward elimination removed {series(step.term for step in result.reduction)}. The p-values and "
            "intervals are slightly optimistic because the same runs were used to select the terms."
        )
        yield Note("reduction", "caution", removed if result.reduction else "Backward elimination removed no terms.")
    if (repeats := result.pure_error) is not None and (repeats.kind == "scatter" or repeats.remedy):
        yield repeats
    if result.over is not None:
        yield from over.notes_of(result.over, Wording(result.naming))


def _fit_terms(
    study: Study, design: Design, runs: Sequence[DesignRun], axis: ConditionAxis | None
) -> tuple[Surface, tuple[ReductionStep, ...] | None]:
    logarithm, values = axis is not None and FIRST in axis.logarithms, np.array([run.number(FIRST) for run in runs])
    data, names = (design.coded, np.log(values) if logarithm else values, design.names), Wording(study.naming)
    names = Wording(study.naming.of_logarithm) if logarithm else names
    reduced = study.of(RsmOptions).reduce == "backward"
    fit, steps = reduce_surface(*data, _KEPT_P, names) if reduced else (fit_surface(*data, written=names), None)
    return replace(fit, cv_percent=relative_percent(fit)) if logarithm else fit, steps


def _result_before(study: Study, solver: Solver, folder: StudyFolder) -> StageResult | None:
    """Return the result of the climb or, without one, of the screening; None if the spec lists the factors."""
    before = stage_called("rsm").needs(study)
    return read_fresh(study, solver, folder, stage_called(before).result()) if before else None


def _factors(
    study: Study, solver: Solver, before: Any
) -> tuple[Sequence[str], Mapping[str, CodedScale], Sequence[Note]]:
    """Return the factors, the coding that a climb found for them, and notes on their selection."""
    if before is not None and before.recentred is not None:
        return tuple(before.recentred), before.recentred, ()
    names, chosen = surface_factors(study, solver, before)
    return names, {}, chosen


def foresee(study: Study, solver: Solver, folder: StudyFolder | None) -> StageRuns:
    """Return the runs of the design; until a screening has selected the factors, their number is assumed."""
    before, table = None, solver.given_design("rsm")
    with suppress(UsageError):
        before = None if folder is None else _result_before(study, solver, folder)
    undecided = before is None and stage_called("rsm").needs(study) is not None
    if undecided:
        names = table[0] if table else study.names[:_USUAL_FACTORS]
        design = study_design(study, solver, [name for name in names if name in study.names])
    else:
        design = study_design(study, solver, *_factors(study, solver, before)[:2])
    known = table is not None or not undecided
    joint = () if design.conditions else study.joint_targets
    conditions = [study.targets.calibrate_at, *(target.condition for target in joint)]
    requests = [request for condition in dict.fromkeys(conditions) for request in design.requests(condition)]
    if known:
        names = tuple(name for name in design.names if name in study.names) + design.held
        note = over.runs_of_both(study, names, design) if table is None else None
    else:
        assumed = f"The plan assumes {len(design.names) - bool(design.conditions)} factors for the response surface"
        note = Note("factors_assumed", "caution", f"{assumed} because the screening has not yet selected the factors.")
    return StageRuns("rsm", requests, known, note, design)


def _at_condition(work: Work, target: Target, result: RsmResult, design: Design) -> AtCondition:
    """Run the design at a condition of the joint fit, and fit surfaces with the terms of the main surface `result`."""
    condition, study = target.condition, work.study
    requests = design.requests(condition)
    outcomes = work.outcomes(requests)
    runs = [ConditionRun(run=request.row + 1, outcome=each) for request, each in zip(requests, outcomes, strict=True)]
    fits: dict[str, FitSummary] = {}
    with failures_in_message(requests, outcomes):
        for name in (name for name in study.fitted_responses if name == FIRST or target.mean_of(name)[0]):
            if silent := [run.run for run in runs if run.outcome.ok and run.outcome.of(name) is None]:
                raise RunsFailed(
                    f"rsm: the record of run {silent[0]}{Wording(study.naming).at(condition)} contains no "
                    f"{study.naming.named(name).name}. Choose another study folder with `--out`, or remove the "
                    "response from `invert.responses`."
                )
            fits[name] = FitSummary.of(result.refitted(runs, response=name), whole=not study.naming.is_cutting)
    return AtCondition(condition=condition, runs=Rows(runs), fit=fits.pop(FIRST), responses=fits or None)


def _further_responses(study: Study, result: RsmResult, axis: ConditionAxis) -> Iterator[AtCondition]:
    """Yield the surfaces of further responses over factors and conditions, if there are any."""
    whole = not study.naming.is_cutting
    fits = {name: FitSummary.of(result.section(axis.at, name).whole, whole) for name in study.fitted_responses}
    if further := {name: fit for name, fit in fits.items() if name != FIRST}:
        yield AtCondition(condition=axis.at, runs=Rows(), fit=fits[FIRST], responses=further)


def study_design(
    study: Study, solver: Solver, names: Sequence[str], recentred: Mapping[str, CodedScale] = MappingProxyType({})
) -> Design:
    """Return the design of the spec over the named factors, or the one in the table of the solver."""
    options, coding, table = study.of(RsmOptions), _coding(study, names, recentred), solver.given_design("rsm")
    if table is not None:
        return given_design("rsm", study, coding, table)
    if options.over == "conditions":
        return over.over_design(study, coding).repeated(study.solver.repeats)
    coded = designs.surface_runs(len(names), options.chosen())
    once = Design("rsm", options.design, coding, coded, coding.runs(coded, study.midlevels()))
    return once.repeated(study.solver.repeats)


def _coding(study: Study, names: Sequence[str], recentred: Mapping[str, CodedScale]) -> Coding:
    """Return the coding by the spec, else by a climb (`recentred`), else with the outermost runs at the range ends."""
    options, factors = study.of(RsmOptions), [study.factor(name) for name in names]
    reach = options.reach(dimensions(study, names))
    ranged = Coding.from_ranges(names, [f.low for f in factors], [f.high for f in factors], reach=reach)
    own = {name: (scale.center, scale.half_step) for name, scale in recentred.items()}
    own |= {name: options.coded(name) for name in options.coding}
    each = zip(names, ranged.centre, ranged.half_step, strict=True)
    centre, half_step = zip(*(own.get(name, (middle, half)) for name, middle, half in each), strict=True)
    return Coding(tuple(names), centre, half_step)


def _pure_error_of(design: DesignRuns, names: Wording, replicated: bool) -> Note | None:
    """Return a note on the scatter of runs at equal levels; None if there are no such runs."""
    groups: dict[tuple[float, ...], list[float]] = {}
    for run in design.runs:
        if run.response is not None:
            groups.setdefault(tuple(run.coded.values()), []).append(run.response)
    repeated = [np.array(responses) for responses in groups.values() if len(responses) > 1]
    if not repeated:
        return None
    if all(np.ptp(responses) <= 1e-9 * np.abs(responses).max() for responses in repeated):
        text = "The replicate runs agree exactly, so the pure error is zero."
        remedy = Remedy("Remove `replicates`, or pass {{seed}} to the program.") if replicated else None
        return Note("equal_repeats", "caution", text, remedy)
    df = sum(len(responses) - 1 for responses in repeated)
    square = sum(float(np.sum((responses - responses.mean()) ** 2)) for responses in repeated) / df
    sd = names.quantity(square**0.5, ".3g")
    text = f"The standard deviation of the replicate runs is {sd} ({counted(df, 'degree')} of freedom)."
    return Note("scatter", "caution", text)
