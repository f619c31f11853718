"""What to change, with numbers: ranges that would hold the target, settings that would mend doubtful physics.

Every kind of remedy is declared here; `stemcal.text.verdict` words them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Literal

import numpy as np

from stemcal.doe.regression.least_squares import Array
from stemcal.stages.invert.result import Certainty
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.verdict.physics import LIMITS, Doubt, DoubtKind
from stemcal.stages.verdict.result import Remedy
from stemcal.study.model import EmbeddedSolver, Factor, Study

# A range is widened by at most so many times its width, and past the target by this part of what was missing.
_WIDEST, _BEYOND = 20.0, 0.25
_CLOUD = 9
_MOST_AVERAGED = 100  # places or replicates that a spec may ask for
# What has to fall below a limit is aimed at this part of it: runs of one study scatter about what their mean says.
_SAFELY = 0.5
# Finer elements are advised up to so many times the time of a run: full integration takes about twenty.
_DEAREST = 12.0


class ContinueStudy(Remedy):
    """Run what is not done yet."""


class EnterResults(Remedy):
    """Do the runs that are awaited and enter what came of them."""


class WidenRange(Remedy):
    """Move an end of a factor's range to a value, in its unit."""

    factor: str
    end: Literal["low", "high"]
    value: float
    unit: str


class NoRangeReaches(Remedy):
    """No factor alone reaches the target: what is held fixed is to be checked."""

    factors: tuple[str, ...]


class VaryAnother(Remedy):
    """Vary a further factor: this one is at the end of what it can be."""

    factor: str


class FitFewer(Remedy):
    """Vary a further factor, or fit fewer responses, or conditions, together."""

    over: Literal["responses", "conditions"] = "conditions"


class AddRefinement(Remedy):
    """Simulate at the solution and correct it."""


class RaiseBudget(Remedy):
    """Give the refinement so many simulations."""

    budget: int


class MendTransfer(Remedy):
    """Give the transfer what it lacks: more runs (so many), a wider range or a further factor, or a smoother model."""

    stopped: Literal["tolerance", "budget", "out_of_reach", "settled"]
    factors: tuple[str, ...]
    budget: int


class SimulateValidation(Remedy):
    """Validate with a solver that simulates."""


class RetryValidation(Remedy):
    """Compute the failed runs again."""


class FitAll(Remedy):
    """Fit all responses, or all conditions, together."""

    over: Literal["responses", "conditions"]


class MeasureMore(Remedy):
    """Measure what can check the result, or fit fewer: so many conditions are fitted together."""

    fitted: int


class MendInput(Remedy):
    """Mend this doubt in the input of a program that is not the embedded solver."""

    doubt: DoubtKind


class ScaleMassLess(Remedy):
    """Take this mass scaling, and where the step is set this time step (µs), to bring inertia below a limit.

    A run then takes so many `times` the time.
    """

    mass_scaling: float
    time_step: float | None
    limit_percent: float
    times: float


@dataclass(frozen=True)
class FinerElements:
    """Elements of this size, and where the step is set this time step (µs); a run takes so many `times` the time."""

    element_size: str
    time_step: float | None
    times: float


class IntegrateFully(Remedy):
    """Full integration has no hourglass energy; finer elements may bring it below a limit, if no dearer than sense."""

    finer: FinerElements | None
    limit_percent: float


class HalveTimeStep(Remedy):
    """Take this safety of the time step, and where the step is set this time step (µs): half of both."""

    time_step_safety: float
    time_step: float | None


class LengthenStroke(Remedy):
    """Take this duration (s), twice today's."""

    duration: float


class Identify(Remedy):
    """Fit what else was measured, or measure what moves along the free direction, or hold this factor at a value.

    `unfitted` tells what was measured already and is left out of the fit.
    """

    factor: str
    unfitted: Literal["responses", "conditions"] | None


class CheckModel(Remedy):
    """Check the law, the units and the expected sign of these factors."""

    factors: tuple[str, ...]


class CheckPrior(Remedy):
    """Check a prior against its source, or leave it out."""

    factor: str
    source: str


class SmoothResponse(Remedy):
    """Average over so many places of the mesh or replicates, where the solver knows these, or add runs."""

    phases: int | None = None
    replicates: int | None = None


def reach(surface: SurfaceResult, study: Study) -> tuple[float, float]:
    """Return the least and the greatest response of a surface within ranges, design region and constraints."""
    from stemcal.doe.calibration.levelset import extremes

    low, high = (surface.fitted.predict(end) for end in extremes(surface.fitted, surface.region(study)))
    return float(low[0]), float(high[0])


def to_reach(study: Study, surface: SurfaceResult, target: float) -> Remedy:
    """Return by which factor alone, widened how far, the target would come within reach.

    The surface is continued from its extreme point as a plane, F = F* + g·(x − x*); the new range is the first for
    which the plane passes the target by a quarter of what was missing, inside the design region of the new range.
    """
    from stemcal.doe.calibration.levelset import extremes

    end = extremes(surface.fitted, surface.region(study))[0 if target < reach(surface, study)[0] else 1]
    found = [
        (width, _widened(factor, up, width))
        for factor in map(study.factor, surface.names)
        for up in (True, False)
        if (width := _least_width(study, surface, end, factor, up, target)) is not None
    ]
    return min(found, key=lambda entry: entry[0])[1] if found else NoRangeReaches(surface.names)


def _widened(factor: Factor, up: bool, width: float) -> WidenRange:
    """Return the new end of a range that grows upwards or downwards by `width` times its own width."""
    end = factor.high + width * (factor.high - factor.low) if up else factor.low - width * (factor.high - factor.low)
    return WidenRange(factor.name, "high" if up else "low", _outwards(end, up), factor.unit)


def _outwards(value: float, up: bool) -> float:
    """Round away from the range to two digits.

    >>> _outwards(44.2, True), _outwards(0.0373, False), _outwards(0.0, False)
    (45.0, 0.037, 0.0)
    """
    if value == 0.0:
        return 0.0
    step = 10.0 ** (floor(log10(abs(value))) - 1)
    return float(f"{(np.ceil if up else np.floor)(round(value / step, 6)) * step:.6g}")


def _least_width(
    study: Study, surface: SurfaceResult, end: Array, factor: Factor, up: bool, target: float
) -> float | None:
    """Return by how much of its width a range has to grow; None where no sensible width does."""
    at_end, slope = float(surface.fitted.predict(end)[0]), surface.fitted.gradient(end)
    missing = target - at_end
    goal, side = missing * (1.0 + _BEYOND), 1.0 if missing > 0.0 else -1.0
    region, j = surface.region(study), surface.names.index(factor.name)
    low, high, inside = region.low, region.high, region.cloud(_CLOUD)

    def gained(width: float) -> float:
        """What the plane gains within the design region of the new range, of which coded points are the old ones."""
        stretch, shift = np.ones(len(slope)), np.zeros(len(slope))
        stretch[j], shift[j] = 1.0 + width, (1.0 if up else -1.0) * 0.5 * width * (high[j] - low[j])
        return float(np.max(side * ((inside * stretch + shift - end) @ slope)))

    most = _WIDEST if up else min(_WIDEST, _above_zero(factor))
    return _first(lambda width: gained(width) >= side * goal, most)


def _above_zero(factor: Factor) -> float:
    """Return how far a range may grow downwards: what is positive stays above a tenth of its low end."""
    return _WIDEST if factor.low < 0.0 else 0.9 * factor.low / (factor.high - factor.low)


def _first(enough: Callable[[float], bool], most: float) -> float | None:
    """Return the least width that is enough, by halving."""
    if most <= 0.0 or not enough(most):
        return None
    low, high = 0.0, most
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def from_the_edge(study: Study, surface: SurfaceResult, coded: Sequence[float]) -> Remedy:
    """Return which range to widen by half, so that a solution on the edge of the region comes to lie inside."""
    region = surface.region(study)
    place = np.asarray(coded) / np.where(np.asarray(coded) > 0.0, region.high, -region.low)
    order = np.argsort(-np.abs(place), kind="stable")
    for j in order:
        factor, up = study.factor(surface.names[j]), bool(coded[j] > 0.0)
        if up or _above_zero(factor) >= 0.5:
            return _widened(factor, up, 0.5)
    return VaryAnother(surface.names[order[0]])


def to_identify(study: Study, known: Certainty) -> Remedy:
    """Return what would fix factors that the fit leaves free: the one to hold is that of the widest interval."""
    widest = max(known.not_identified or known.share, key=lambda name: known.share[name])
    left_out = [name for name in ("travel", "work", *study.own_further) if name not in study.invert.responses]
    if any(study.calibration_target.mean_of(name)[0] is not None for name in left_out):
        return Identify(widest, "responses")
    more = len(study.targets.means) > max(len(study.joint_targets), 1)
    return Identify(widest, "conditions" if more else None)


def for_physics(study: Study, doubt: Doubt) -> Remedy:
    """Return what would bring a doubt below its limit."""
    solver = study.solver
    if not isinstance(solver, EmbeddedSolver):
        return MendInput(doubt.kind)
    match doubt.kind:
        case "inertia":
            return _inertia(solver, doubt.worst or 0.0)
        case "hourglass":
            return _hourglass(solver, doubt.worst or 0.0)
        case "drift":
            return _half_the_step(solver)
        case "stroke":
            return LengthenStroke(2.0 * study.loading.duration)


def _inertia(solver: EmbeddedSolver, worst: float) -> ScaleMassLess:
    """Return mass scaling and time step at which what the blade sets swinging is well below the limit.

    A body of stiffness k and mass m that is struck at the speed V swings with the force V √(k m): the share falls
    with the root of the mass, and the mass that a time step asks for goes with its square.
    """
    swing, step = _SAFELY * LIMITS["inertia"] / worst, solver.time_step
    mass_scaling = _outwards(max(solver.mass_scaling * swing**2, 1.0), False)
    return ScaleMassLess(mass_scaling, _microseconds(step, swing), LIMITS["inertia"], _outwards(1.0 / swing, True))


def to_smooth(study: Study) -> SmoothResponse:
    """Return over what a rough response may be averaged: twice what it is already, five at least."""
    if isinstance(study.solver, EmbeddedSolver):
        return SmoothResponse(phases=min(max(5, 2 * study.solver.phases), _MOST_AVERAGED))
    return SmoothResponse(replicates=min(max(5, 2 * study.replicates), _MOST_AVERAGED) if study.replicates else None)


def _half_the_step(solver: EmbeddedSolver) -> HalveTimeStep:
    """Return half the safety; a set time step stays as it is, with mass added, unless it is halved as well."""
    return HalveTimeStep(_outwards(0.5 * solver.time_step_safety, False), _microseconds(solver.time_step, 0.5))


def _microseconds(step: float | None, part: float) -> float | None:
    """Return a part of a time step that is set (s), in µs."""
    return None if step is None else _outwards(1e6 * step * part, False)


def _hourglass(solver: EmbeddedSolver, worst: float) -> IntegrateFully:
    """Full integration has none; of one-point elements it falls at least with the element size, which need not do.

    Elements finer by a are a³ in number, and their steps 1/a as long; a time step that is set has to follow.
    """
    finer, size = worst / LIMITS["hourglass"], solver.element_size
    if finer**4 > _DEAREST:
        return IntegrateFully(None, LIMITS["hourglass"])
    new = f"d/{np.ceil(finer * size.divisor):g}" if size.divisor else f"{_outwards(size.mm / finer, False):g} mm"
    step = _microseconds(solver.time_step, 1.0 / finer)
    return IntegrateFully(FinerElements(new, step, _outwards(finer**4, True)), LIMITS["hourglass"])
