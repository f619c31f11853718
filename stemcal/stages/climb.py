"""The climb between screening and surface: active factors stepped together towards the target."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

from stemcal.doe.designs.catalogue import surface_reach
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.screening.ascent import ascent_path, nearest_step, own_path, passed
from stemcal.doe.screening.effects import Effect
from stemcal.doe.validation.comparison import error_percent
from stemcal.errors import RunsFailed
from stemcal.files.rows import Rows, Table
from stemcal.files.typed import Spread, inline
from stemcal.names import Names
from stemcal.note import Note, Remedy
from stemcal.numbers import fixed, minus
from stemcal.runs.outcome import Outcome
from stemcal.stages.design import surface_factors, surface_options
from stemcal.stages.result import CodedScale, DesignRuns, Head, StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.work import SimulateAt, Work, a_stage
from stemcal.study.model import ClimbOptions, Study
from stemcal.words import counted

# Of each range, how much the design of the surface covers around the best step.
_SHARE = 0.5


@dataclass(frozen=True)
class ClimbRow(Spread):
    """One step: where it was, its error against the target and what came of it."""

    step: int
    levels: dict[str, float]
    coded: dict[str, float]
    error_percent: float | None
    outcome: Outcome = inline()


@dataclass(frozen=True, kw_only=True, repr=False)
class ClimbResult(StageResult):
    """The steps towards the target, the best one, and the coding of a design centred on it."""

    name: ClassVar[str] = "climb"
    shown = ("solution",)

    head: Head = inline()
    target: float
    condition: float
    names: tuple[str, ...]
    rows: Rows[ClimbRow]
    best_step: int
    passed: bool
    solution: dict[str, float]
    error_percent: float
    coding: dict[str, CodedScale]
    effects: Rows[Effect]
    significant: tuple[str, ...]
    notes: tuple[Note, ...] = ()

    @property
    def shares(self) -> dict[str, float]:
        """What each factor contributes, per cent."""
        return {effect.factor: effect.contribution_percent or 0.0 for effect in self.effects}

    @property
    def active_factors(self) -> tuple[str, ...]:
        """The factors that matter."""
        return self.significant

    def _tables(self) -> dict[str, Table]:
        """Return the steps."""
        return {"climb": Table.of(("step", *self.names, "response", "error_percent", "status", "reason"), self.rows)}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield label and outcome of every step."""
        for number, row in enumerate(self.rows, 1):
            yield f"climb {number}", row.outcome


@a_stage(ClimbResult)
def climb(work: Work, head: Head) -> ClimbResult:
    """Step the active factors together towards the target, and centre the surface's design on the best step."""
    screening = work.result(ScreenResult)
    names, chosen = surface_factors(work.study, work.solver, screening)
    return _climbed(work.study, head, names, chosen, screening, work.simulating("climb"))


def _climbed(
    study: Study, head: Head, names: list[str], chosen: list[Note], screening: ScreenResult, simulate: SimulateAt
) -> ClimbResult:
    options, target = study.climb or ClimbOptions(), study.calibration_target.response
    effects = [screening.effect(name).effect for name in names]
    if options.at_once:
        rows = _leap(study, names, effects, options, simulate, screening.design)
    else:
        rows = _walk(study, names, effects, options, simulate)
    responses = [row.outcome.response for row in rows]
    best, reached = rows[nearest_step(responses, target)], passed(responses, target)
    return ClimbResult(
        head=head,
        target=target,
        condition=study.targets.calibrate_at,
        names=tuple(names),
        rows=Rows(rows),
        best_step=best.step,
        passed=reached,
        solution={name: best.levels[name] for name in names},
        error_percent=best.error_percent or 0.0,
        coding={name: _around(study, name, best.levels[name], len(names), options) for name in names},
        effects=screening.effects,
        significant=screening.active_factors,
        notes=(*_notes(rows, best, reached, Names(study.naming)), *chosen),
    )


def _notes(rows: Sequence[ClimbRow], best: ClimbRow, reached: bool, names: Names) -> Iterator[Note]:
    """Yield where the surface is centred, and that the walk ended before the target."""
    error = minus(f"{best.error_percent or 0.0:+.1f}")
    text = (
        f"Of {counted(len(rows), 'step')} along the slope of the screening, step {best.step} is nearest to the target "
        f"({error} %): the surface is centred there."
    )
    yield Note("nearest_step", "info", text)
    if not reached:
        response = names.response.long
        text = (
            f"The walk ended at the edge of the ranges before the {response} passed the target, which may lie outside."
        )
        remedy = Remedy(f"Widen the ranges, or check whether the {response} can reach the target at all.")
        yield Note("target_not_passed", "warning", text, remedy)


def _walk(
    study: Study, names: list[str], effects: Sequence[float], options: ClimbOptions, simulate: SimulateAt
) -> list[ClimbRow]:
    """Simulate the centre, then step along the slope until the response has passed the target."""
    target = study.calibration_target.response
    start = _rows(study, names, [[0.0] * len(names)], simulate)
    if start[0].outcome.response is None:
        failed = start[0].outcome
        raise RunsFailed(f"climb: the run at mid-levels failed ({failed.reason}): {failed.message}")
    rows = start
    path = _path(study, names, effects, options, start[0].outcome.response < target)
    for step, point in enumerate(path[1:], 1):
        rows += _rows(study, names, [point], simulate, step)
        if passed([row.outcome.response for row in rows], target):
            break
    return rows


def _leap(
    study: Study,
    names: list[str],
    effects: Sequence[float],
    options: ClimbOptions,
    simulate: SimulateAt,
    design: DesignRuns,
) -> list[ClimbRow]:
    """Simulate the whole path together; the mean of the screening is what a plane has at its centre."""
    known = [run.response for run in design.runs if run.response is not None]
    rise = sum(known) / len(known) < study.calibration_target.response
    rows = _rows(study, names, _path(study, names, effects, options, rise), simulate)
    if all(row.outcome.response is None for row in rows):
        raise RunsFailed(f"climb: all {len(rows)} runs failed ({rows[0].outcome.reason}): {rows[0].outcome.message}")
    return rows


def _path(study: Study, names: list[str], effects: Sequence[float], options: ClimbOptions, rise: bool) -> Array:
    """Return the coded points of the walk; with steps of one's own where the spec has them."""
    own = options.step_sizes
    if not any(name in own for name in names):
        return ascent_path(effects, options.steps, rise)
    sizes = [own[name] / study.factor(name).half_range if name in own else None for name in names]
    return own_path(effects, sizes, options.steps, rise)


def _rows(
    study: Study, names: list[str], points: Iterable[Sequence[float]], simulate: SimulateAt, first: int = 0
) -> list[ClimbRow]:
    """Simulate coded points together; `first` is the step of the first one."""
    coded = [dict(zip(names, map(float, point), strict=True)) for point in points]
    levels = [study.midlevels() | {name: _natural(study, name, at) for name, at in one.items()} for one in coded]
    found, target = simulate(first, levels, [study.targets.calibrate_at]), study.calibration_target.response
    return [
        ClimbRow(step, at, point, error_percent(target, outcome.response), outcome)
        for step, (at, point, outcome) in enumerate(zip(levels, coded, found, strict=True), first)
    ]


def _natural(study: Study, name: str, coded: float) -> float:
    factor = study.factor(name)
    return float(f"{factor.centre + factor.half_range * coded:.12g}")


def _around(study: Study, name: str, level: float, k: int, options: ClimbOptions) -> CodedScale:
    """Return the coding of a design that reaches over a share of the range about a level, inside the range."""
    factor, reach = study.factor(name), surface_reach(k, surface_options(study))
    span = _SHARE * factor.half_range
    center = min(max(level, factor.low + span), factor.high - span)
    return CodedScale(float(f"{center:.12g}"), float(f"{span / reach:.12g}"))


def outcome(stage: ClimbResult, names: Names) -> list[str]:
    """Return how near the steps came to the target."""
    stepped = f"{len(stage.rows)} runs stepped {names.factors(stage.names)} together towards the target."
    reached = "The target was passed" if stage.passed else "The target was not reached"
    return [
        "1 run was made at the centre." if len(stage.rows) == 1 else stepped,
        f"{reached}; step {stage.best_step} came nearest, {fixed(abs(stage.error_percent), 1)} % from it.",
    ]
