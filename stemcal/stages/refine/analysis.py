"""The analysis of the stage refine: the loop in the study's own model, or in the program or mesh of `refine.in`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf

from stemcal.doe.calibration.search_path import Mover, SearchPath
from stemcal.doe.comparison import error_percent
from stemcal.errors import UsageError
from stemcal.formats import counted, listed, series
from stemcal.notes import Note, Remedy
from stemcal.runs.answer import watch_nothing
from stemcal.solvers.protocol import Request
from stemcal.stages.design import AdaptiveRuns
from stemcal.stages.fitting import Measured, Surfaces, measured_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.loop import Loop, PathSteps
from stemcal.stages.refine.options import RefineOptions, most_runs
from stemcal.stages.refine.result import AdjustedFactor, RefineResult, RefineRow, SimulatedBy
from stemcal.stages.refine.secant import SecantSteps
from stemcal.stages.refine.steps import SurfaceSteps
from stemcal.stages.result import Head, Interval
from stemcal.stages.stage import has_surface, stage_called
from stemcal.stages.work import Work, a_stage
from stemcal.storage.rows import Rows
from stemcal.study.model.measured_targets import Target
from stemcal.study.model.study import Study
from stemcal.study.types.units import from_internal
from stemcal.vocabulary import FIRST, Wording, program

_USUAL_ROUNDS = 2
# The failure strain depends on the mesh. For a model with another mesh, its range is widened: down to this share of the
# lower limit in the spec, and up to 1.
_OF_MESH, _LOWEST_SHARE, _HIGHEST = "failure_strain", 0.1, 1.0


@a_stage(RefineResult)
def refine(work: Work, head: Head) -> RefineResult:
    """Simulate the solution and correct it until the response agrees, in the study's model or in `refine.in`."""
    options = work.study.of(RefineOptions)
    if options.elsewhere:
        return _refined_there(work, head, options)
    steps: SurfaceSteps | SecantSteps
    if has_surface(work.study):
        steps = SurfaceSteps(work.study, work.result(Surfaces), work.result(InvertResult))
    else:
        steps = SecantSteps(work.study, options.tolerance_percent)
    loop = Loop(steps, work.simulating("refine", pictured=True), options.tolerance_percent, most_runs(work.study))
    loop.run()
    return _result(head, work, loop, steps.means, work.study.calibration_target.response, free=steps.undetermined)


def _refined_there(work: Work, head: Head, options: RefineOptions) -> RefineResult:
    """Simulate the calibrated point in another model, correct it there, and simulate it at the other conditions."""
    study, there, start = work.study, work.there(), work.result(InvertResult).parameters
    target, own = study.calibration_target, replace(work, watch=watch_nothing).simulating("validate", pictured=True)
    # the validation has already simulated this run, so its record is reused
    (outcome,) = own(study.targets.means.index(target), [start], [target.condition])
    expected = outcome.response or target.response
    # a joint fit is a compromise between the conditions: its force is the aim, not the measured one
    aim = expected if study.joint_targets else target.response
    steps = PathSteps(_path(work, there, options, start), start, target.condition, aim, expected)
    loop = Loop(steps, there.simulating("refine"), options.tolerance_percent, options.budget)
    loop.run()
    means = [mean for row in study.targets.means for mean in measured_of(row, [FIRST], study.naming)]
    if loop.stopped == "tolerance":
        others = (mean.condition for mean in means if mean.condition != target.condition)
        loop.run_elsewhere(sorted(others, key=lambda condition: abs(condition - target.condition)))
    return _result(head, there, loop, means, aim, list(_adjusted(loop, steps, target)))


def _result(
    head: Head,
    work: Work,
    loop: Loop,
    means: Sequence[Measured],
    aim: float,
    adjusted: Sequence[AdjustedFactor] = (),
    free: tuple[str, ...] = (),
) -> RefineResult:
    best, rows = loop.best, list(_rows(loop, means))
    errors = [abs(row.error_percent) for row in rows if row.error_percent is not None]
    result = RefineResult(
        head=head,
        elsewhere=bool(adjusted),
        model=_model(work, loop),
        condition=work.study.calibration_target.condition,
        aim=aim,
        tolerance_percent=loop.tolerance_percent,
        budget=loop.budget,
        converged=loop.stopped == "tolerance",
        stopped=loop.stopped,
        error_percent=best.error_percent or 0.0,
        parameters=best.point.levels,
        adjusted=Rows(adjusted),
        rows=Rows(rows),
        max_abs_error_percent=max(errors, default=None),
        trial_runs=Rows(loop.runs),
        undetermined=free,
    )
    return replace(result, notes=tuple(refine_notes(result)))


def _rows(loop: Loop, means: Sequence[Measured]) -> Iterator[RefineRow]:
    before, after = loop.responses(loop.points[0].point.levels), loop.responses(loop.best.point.levels)
    for mean in means:
        old, new = (at[mean.condition].of(mean.response) if mean.condition in at else None for at in (before, after))
        yield RefineRow(mean.condition, mean.named.name, mean.value, old, new, error_percent(mean.value, new))


def _model(work: Work, loop: Loop) -> SimulatedBy:
    """Return the program that simulates; its version is in the spec or in the first run that reports one."""
    solver, at = work.study.solver, work.study.calibration_target.condition
    version = solver.version
    if not version:
        records = (work.folder.peek(run.outcome.key) for run in loop.runs)
        version = next((str(v) for r in records if r and (v := r["details"].get("program_version"))), "")
    return SimulatedBy(solver.program_name, version or None, work.solver.settings_that_matter(at))


def _path(work: Work, there: Work, options: RefineOptions, start: Mapping[str, float]) -> SearchPath:
    """Return the search path of the factors that may move; it begins at the calibrated point."""
    surface = work.result(Surfaces)
    if unknown := [name for name in options.adjust if name not in surface.names]:
        known = f"Choose {listed(surface.names)}."
        raise UsageError(f"refine.adjust: the response surface does not include {', '.join(unknown)}. {known}")
    point = surface.scales.to_coded([start[name] for name in surface.names])
    relative = surface.fitted.gradient(point) / float(surface.fitted.predict(point)[0])
    slopes = dict(zip(surface.names, relative.tolist(), strict=True))
    strongest = _OF_MESH if _OF_MESH in slopes else max(slopes, key=lambda name: abs(slopes[name]))
    at = work.study.targets.calibrate_at
    own = work.solver.settings_that_matter(at)
    # a solver that reports no settings (None) may have another mesh
    same_mesh = own is not None and own == there.solver.settings_that_matter(at)
    steps = {name: scale.half_step for name, scale in surface.coding.items()}
    movers = (
        Mover(name, start[name], *_range(work.study, options, name, same_mesh), slopes[name] / steps[name])
        for name in tuple(options.adjust) or (strongest,)
    )
    return SearchPath(tuple(movers))


def _range(study: Study, options: RefineOptions, name: str, same_mesh: bool) -> Interval:
    """Return the range of a factor in the other model: from `refine.adjust`, from the study, or a wider one."""
    factor = study.factor(name)
    if (ends := options.adjust.get(name)) is not None:
        return ends
    if name == _OF_MESH and not same_mesh:
        return _LOWEST_SHARE * factor.low, max(factor.high, from_internal(_HIGHEST, factor.unit))
    return factor.low, factor.high


def _adjusted(loop: Loop, steps: PathSteps, target: Target) -> Iterator[AdjustedFactor]:
    best, known = loop.best.point, dict[str, Interval]()
    if target.sd and target.n != 1:  # relative standard error of the measured mean, and its degrees of freedom
        relative = target.sd / target.response
        scatter = (relative, inf) if target.n is None else (relative / target.n**0.5, target.n - 1.0)
        known = steps.intervals(best, *scatter)
    for mover in steps.path.movers:
        value = best.levels[mover.name]
        yield AdjustedFactor(mover.name, mover.start, value, known.get(mover.name), mover.low, mover.high)


def later(study: Study) -> AdaptiveRuns | None:
    """Return the usual rounds of runs, each with a run per condition, and a note on the largest number of runs."""
    if not stage_called("refine").asked_for(study):
        return None
    options = study.of(RefineOptions)
    if options.elsewhere:
        place = program(study.there.solver.program_name)
        text = (
            f"The refinement adds at most {counted(options.budget, 'run')} in {place}, one at a time. The estimated "
            "time excludes these runs."
        )
        return AdaptiveRuns([], Note("decided_later", "caution", text))
    conditions = [target.condition for target in study.joint_targets] or [study.targets.calibrate_at]
    round_ = [Request("refine", 0, study.midlevels(), condition, True) for condition in conditions]
    most, moved = most_runs(study), 0 if has_surface(study) else min(len(study.factors), len(conditions))
    text = f"The refinement requires at most {counted(most, 'additional run')}, simulated one after another."
    return AdaptiveRuns([round_] * min(_USUAL_ROUNDS + moved, most), Note("decided_later", "caution", text))


def refine_notes(stage: RefineResult) -> list[Note]:
    """Return notes on a missed target, a first run outside its prediction interval, another model, no surface."""
    names = Wording(stage.naming)
    more = _in_another_model(stage, names) if stage.elsewhere else _without_surface(stage) if stage.alone else ()
    return [*_not_reached(stage, names), *_first_outside(stage, names), *more]


def _not_reached(stage: RefineResult, names: Wording) -> Iterator[Note]:
    if stage.stopped == "tolerance":
        return
    place = f" in {program(stage.model.kind)}" if stage.elsewhere else ""
    text = (
        f"The simulated {names.response.long}{place} differs from the target by {abs(stage.error_percent):.2f} % after "
        f"{counted(len(stage.trial_runs), 'run')}."
    )
    budget, factors = 2 * stage.budget, names.factors(row.factor for row in stage.adjusted)
    wider = f", or widen the range of {factors} in `refine.adjust`" if factors else ""
    remedies = {
        "budget": Remedy(f"Raise `refine.budget` to {budget}{wider}.", f"refine: {{budget: {budget}}}"),
        "out_of_reach": Remedy(f"Widen the range of {factors} in `refine.adjust`, or add another factor.")
        if stage.elsewhere
        else Remedy(f"Widen the range of {series(stage.varied)}."),
        "settled": Remedy(f"Adjust factors other than {factors}, or average over mesh positions with `replicates`."),
    }
    settled_here = stage.stopped == "settled" and not stage.elsewhere
    text += " Neighbouring parameter values do not reduce the error." if settled_here else ""
    yield Note("not_reached", "warning", text, None if settled_here else remedies[stage.stopped])


def _without_surface(stage: RefineResult) -> Iterator[Note]:
    text = "The study has no response surface: there is no analysis of variance, and the uncertainty is unknown."
    yield Note("no_intervals", "warning", text, Remedy("For confidence intervals, choose a design in `rsm.design`."))
    if free := stage.undetermined:
        text = f"The runs do not determine {series(free, 'or')}: mid-range or the mean of the prior was used."
        remedy = Remedy(f"Fit further conditions or responses, or replace the range of {free[-1]} with a fixed value.")
        yield Note("not_identified", "warning", text, remedy)


def _first_outside(stage: RefineResult, names: Wording) -> Iterator[Note]:
    """Yield a note if runs at the solution of the surface are outside their prediction intervals."""
    start = stage.trial_runs[0]
    first = [run for run in stage.trial_runs if run.levels == start.levels and run.how == start.how]
    if outside := [run.condition for run in first if run.inside_interval is False]:
        text = (
            "The response surface is less accurate than its residuals indicate: the simulated "
            f"{names.response.long}{names.at(*outside)} is outside the prediction interval."
        )
        yield Note("first_outside", "warning", text)


def _in_another_model(stage: RefineResult, names: Wording) -> Iterator[Note]:
    if censored := sum(run.outcome.censored for run in stage.trial_runs):
        text = (
            f"In {counted(censored, 'run')}, the {names.response.noun} had not fallen by the end of the stroke. The "
            "recorded maximum is therefore only a lower bound."
        )
        yield Note("still_rose", "warning", text, Remedy("Increase `refine.duration`."))
    simulated = {run.condition for run in stage.trial_runs if run.levels == stage.parameters}
    if left := [row.condition for row in stage.rows if row.condition not in simulated]:
        why = "the run budget was exhausted" if stage.converged else "the target was not reached"
        remedy = Remedy("Raise `refine.budget`.") if stage.converged else None
        text = f"The refined parameters were not simulated{names.at(*left)} because {why}."
        yield Note("not_run_there", "warning", text, remedy)
