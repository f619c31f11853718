"""The analysis of the stage climb: steepest ascent between screening and response surface.

The first-order model of a two-level screening, F = F₀ + Σ bⱼxⱼ with bⱼ half the effect, increases fastest along b (Box
and Wilson, J. R. Stat. Soc. B 13 (1951) 1–45). As the target is one value of the response, the steps follow this line
up or down until the response has passed the target.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from stemcal.arrays import Array
from stemcal.doe.comparison import error_percent
from stemcal.errors import RunsFailed, UsageError
from stemcal.formats import counted, direction
from stemcal.notes import Note, Remedy
from stemcal.solvers.protocol import Request
from stemcal.stages.climb.options import ClimbOptions
from stemcal.stages.climb.result import ClimbResult, ClimbRow
from stemcal.stages.design import AdaptiveRuns
from stemcal.stages.result import CodedScale, Head
from stemcal.stages.rsm.options import RsmOptions, surface_factors
from stemcal.stages.screen.result import ScreenResult
from stemcal.stages.work import SimulateAt, Work, a_stage
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST, Wording

_SHARE = 0.5  # share of each range that the response surface design around the best step covers


@a_stage(ClimbResult)
def climb(work: Work, head: Head) -> ClimbResult:
    """Change the significant factors together towards the target; the best step becomes the next design centre."""
    study, before, simulate = work.study, work.result(ScreenResult), work.simulating("climb")
    names, chosen = surface_factors(study, work.solver, before)
    target = study.calibration_target.response
    rows = (_leap if study.of(ClimbOptions).at_once else _walk)(study, names, before, simulate)
    responses = [row.outcome.response for row in rows]
    known = [row for row in rows if row.outcome.response is not None]
    best, reached = min(known, key=lambda row: abs(row.outcome.number(FIRST) - target)), passed(responses, target)
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
        coding={name: _around(study, name, best.levels[name], len(names)) for name in names},
        notes=(*_notes(rows, best, reached, Wording(study.naming)), *chosen),
    )


def _notes(rows: Sequence[ClimbRow], best: ClimbRow, reached: bool, names: Wording) -> Iterator[Note]:
    error = direction(best.error_percent or 0.0, " %", 1)
    text = (
        f"The response surface design is centred at step {best.step} of {len(rows)} on the path of steepest "
        f"ascent, where the response is closest to the target (error: {error})."
    )
    yield Note("nearest_step", "info", text)
    if not reached:
        before = f"before the {names.response.long} reached the target. The target may be out of reach."
        text = f"Steepest ascent ended at the limits of the factor ranges {before}"
        yield Note("target_not_passed", "warning", text, Remedy("Widen the factor ranges, or check the target value."))


def _walk(study: Study, names: list[str], screened: ScreenResult, simulate: SimulateAt) -> list[ClimbRow]:
    """Simulate step by step, from the centre of the ranges, until the response has passed the target."""
    target = study.calibration_target.response
    rows = _rows(study, names, [[0.0] * len(names)], simulate)
    start = rows[0].outcome
    if start.response is None:
        raise RunsFailed(f"climb: the run at the centre of the factor ranges failed ({start.reason}): {start.message}")
    path = _path(study, names, screened, rise=start.response < target)
    for step, point in enumerate(path[1:], 1):
        rows += _rows(study, names, [point], simulate, step)
        if passed([row.outcome.response for row in rows], target):
            break
    return rows


def _leap(study: Study, names: list[str], screened: ScreenResult, simulate: SimulateAt) -> list[ClimbRow]:
    """Simulate all steps at once; the mean response of the screening decides whether to increase the response."""
    known = [run.response for run in screened.design.runs if run.response is not None]
    rise = sum(known) / len(known) < study.calibration_target.response
    rows = _rows(study, names, _path(study, names, screened, rise), simulate)
    if all(row.outcome.response is None for row in rows):
        raise RunsFailed(f"climb: all {len(rows)} runs failed ({rows[0].outcome.reason}): {rows[0].outcome.message}")
    return rows


def _rows(
    study: Study, names: list[str], points: Iterable[Sequence[float]], simulate: SimulateAt, first: int = 0
) -> list[ClimbRow]:
    coded = [dict(zip(names, map(float, point), strict=True)) for point in points]
    factors = [study.factor(name) for name in names]
    varied = [{f.name: float(f"{f.centre + f.half_range * point[f.name]:.12g}") for f in factors} for point in coded]
    levels = [study.midlevels() | each for each in varied]
    outcomes, target = simulate(first, levels, [study.targets.calibrate_at]), study.calibration_target.response
    return [
        ClimbRow(step, at, point, error_percent(target, outcome.response), outcome)
        for step, (at, point, outcome) in enumerate(zip(levels, coded, outcomes, strict=True), first)
    ]


def _around(study: Study, name: str, level: float, k: int) -> CodedScale:
    """Return the coding of a design over `_SHARE` of a range: centred at a level, or shifted to stay in the range."""
    factor, reach = study.factor(name), study.of(RsmOptions).reach(k)
    span = _SHARE * factor.half_range
    center = min(max(level, factor.low + span), factor.high - span)
    return CodedScale(float(f"{center:.12g}"), float(f"{span / reach:.12g}"))


def later(study: Study) -> AdaptiveRuns | None:
    """Return the usual runs of the stage, one per round, with a note on their largest number; None without a climb."""
    if (options := study.section(ClimbOptions)) is None:
        return None
    when = "simultaneously" if options.at_once else "one after another"
    text = f"Steepest ascent requires at most {counted(options.steps + 1, 'additional run')}, simulated {when}."
    run = Request("climb", 0, study.midlevels(), study.targets.calibrate_at)
    return AdaptiveRuns([[run]] * (options.steps // 2), Note("decided_later", "caution", text))


def _path(study: Study, names: list[str], screened: ScreenResult, rise: bool) -> Array:
    return ascent_path([screened.effect(name).effect for name in names], study.of(ClimbOptions).steps, rise)


def ascent_path(effects: ArrayLike, steps: int, rise: bool) -> Array:
    """Return the coded points, (steps + 1, k), from the centre to where the strongest factor reaches its limit.

    `effects` (k,) are mean(high) − mean(low); `rise` if the target is above the response at the centre.

    >>> ascent_path([40.0, -20.0], 2, rise=True).tolist()
    [[0.0, -0.0], [0.5, -0.25], [1.0, -0.5]]
    """
    slopes = np.asarray(effects, dtype=float)
    longest = float(np.abs(slopes).max(initial=0.0))
    if longest == 0.0:
        raise UsageError(
            "climb: the estimated effects of all significant factors are zero, so the direction is undefined. Remove "
            "the `climb` section."
        )
    return np.linspace(0.0, 1.0, steps + 1)[:, None] * (slopes / longest * (1.0 if rise else -1.0))


def passed(responses: Sequence[float | None], target: float) -> bool:
    """Check that there are responses on both sides of the target.

    >>> passed([100.0, None, 150.0], 159.2), passed([100.0, 150.0, 165.0], 159.2)
    (False, True)
    """
    known = [response for response in responses if response is not None]
    return bool(known) and min(known) <= target <= max(known)
