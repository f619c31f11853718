"""What to change, with numbers: ranges that would hold the target, settings that would mend doubtful physics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import floor, log10, sqrt

import numpy as np

from stemcal.doe.calibration.levelset import extremes
from stemcal.doe.calibration.region import Region
from stemcal.doe.regression.least_squares import Array
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.verdict.physics import LIMITS, Doubt
from stemcal.study.model import EmbeddedSolver, Factor, Study

# A range is widened by at most so many times its width, and past the target by this part of what was missing.
_WIDEST, _BEYOND = 20.0, 0.25
_CLOUD = 9
# What has to fall below a limit is aimed at this part of it: runs of one study scatter about what their mean says.
_SAFELY = 0.5
_FULL = "about six"


def region_of(surface: SurfaceResult) -> Region:
    """Return the region of a surface: the factors' ranges within the design's radius, coded."""
    centre = np.array([entry.center for entry in surface.factors])
    reach = surface.radius * np.array([entry.half_step for entry in surface.factors])
    low = [end if entry.low is None else entry.low for entry, end in zip(surface.factors, centre - reach, strict=True)]
    high = [
        end if entry.high is None else entry.high for entry, end in zip(surface.factors, centre + reach, strict=True)
    ]
    return Region(surface.scales.to_coded(low), surface.scales.to_coded(high), surface.radius)


def reach(surface: SurfaceResult) -> tuple[float, float]:
    """Return the least and the greatest response of a surface within ranges and design region."""
    low, high = (surface.fitted.predict(end) for end in extremes(surface.fitted, region_of(surface)))
    return float(low[0]), float(high[0])


def to_reach(study: Study, surface: SurfaceResult, target: float) -> str:
    """Say by which factor alone, widened how far, the target would come within reach.

    The surface is continued from its extreme point as a plane, F = F* + g·(x − x*); the new range is the first for
    which the plane passes the target by a quarter of what was missing, inside the design region of the new range.
    """
    end = extremes(surface.fitted, region_of(surface))[0 if target < reach(surface)[0] else 1]
    found = [
        (width, widened(factor, up, width))
        for factor in map(study.factor, surface.names)
        for up in (True, False)
        if (width := _least_width(surface, end, factor, up, target)) is not None
    ]
    if found:
        return min(found)[1]
    check = "units, loading and specimen" if study.naming.is_cutting else "units and what the simulation holds fixed"
    return f"no factor of {', '.join(surface.names)} reaches it by its range alone; check {check}"


def widened(factor: Factor, up: bool, width: float) -> str:
    """Write the new end of a range that grows upwards or downwards by `width` times its own width."""
    end = factor.high + width * (factor.high - factor.low) if up else factor.low - width * (factor.high - factor.low)
    unit = "" if factor.unit == "1" else f" {factor.unit}"
    verb, name = ("raise", "high") if up else ("lower", "low")
    return f"{verb} `{name}` of {factor.name} to about {_outwards(end, up):g}{unit}"


def _outwards(value: float, up: bool) -> float:
    """Round away from the range to two digits.

    >>> _outwards(44.2, True), _outwards(0.0373, False), _outwards(0.0, False)
    (45.0, 0.037, 0.0)
    """
    if value == 0.0:
        return 0.0
    step = 10.0 ** (floor(log10(abs(value))) - 1)
    return float(f"{(np.ceil if up else np.floor)(round(value / step, 6)) * step:.6g}")


def _least_width(surface: SurfaceResult, end: Array, factor: Factor, up: bool, target: float) -> float | None:
    """Return by how much of its width a range has to grow; None where no sensible width does."""
    at_end, slope = float(surface.fitted.predict(end)[0]), surface.fitted.gradient(end)
    missing = target - at_end
    goal, side = missing * (1.0 + _BEYOND), 1.0 if missing > 0.0 else -1.0
    region, j = region_of(surface), surface.names.index(factor.name)
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


def from_the_edge(study: Study, surface: SurfaceResult, coded: Sequence[float]) -> str:
    """Say which range to widen by half its width, so that a solution on the edge of the region comes to lie inside."""
    region = region_of(surface)
    place = np.asarray(coded) / np.where(np.asarray(coded) > 0.0, region.high, -region.low)
    order = np.argsort(-np.abs(place), kind="stable")
    for j in order:
        factor, up = study.factor(surface.names[j]), bool(coded[j] > 0.0)
        if up or _above_zero(factor) >= 0.5:
            return widened(factor, up, 0.5)
    return f"vary a further factor: {surface.names[order[0]]} is at the end of what it can be"


def for_physics(study: Study, doubt: Doubt) -> str:
    """Say what would bring a doubt below its limit."""
    solver = study.solver
    if not isinstance(solver, EmbeddedSolver):
        return f"mend it in the solver's own input: {_AIMS[doubt.kind]}"
    return _SETTINGS[doubt.kind](study, solver, doubt.worst or 0.0)


def _kinetic(_study: Study, solver: EmbeddedSolver, worst: float) -> str:
    """Kinetic energy goes with the mass, and that with the square of the time step."""
    share = _SAFELY * LIMITS["kinetic"] / worst
    settings = [f"`mass_scaling: {_outwards(max(solver.mass_scaling * share, 1.0), False):g}`"]
    if solver.time_step is not None:
        settings.append(f"`time_step: {_outwards(1e6 * solver.time_step * sqrt(share), False):g} us`")
    aim = f"would bring kinetic energy under {LIMITS['kinetic']:g} % in most runs"
    return f"{' and '.join(settings)} under `solver` {aim}"


def _hourglass(study: Study, solver: EmbeddedSolver, worst: float) -> str:
    """Full integration has none; of one-point elements it falls at least with the element size, which need not do."""
    finer = worst / LIMITS["hourglass"]
    size = solver.element_size
    new = f"d/{np.ceil(finer * size.divisor):g}" if size.divisor else f"{_outwards(size.mm / finer, False):g} mm"
    return (
        f"`element: full` under `solver` has no hourglass energy, at {_FULL} times the time; elements of {new} or "
        f"smaller may bring it under {LIMITS['hourglass']:g} %"
    )


def _drift(_study: Study, solver: EmbeddedSolver, _worst: float) -> str:
    safety = _outwards(0.5 * solver.time_step_safety, False)
    return f"`time_step_safety: {safety:g}` under `solver` halves the time step"


def _stroke(study: Study, _solver: EmbeddedSolver, _worst: float) -> str:
    return f"`duration: {2.0 * study.loading.duration:g} s` under `loading` doubles the blade's way"


_SETTINGS: dict[str, Callable[[Study, EmbeddedSolver, float], str]] = {
    "kinetic": _kinetic,
    "hourglass": _hourglass,
    "drift": _drift,
    "stroke": _stroke,
}
_AIMS = {
    "kinetic": "less mass scaling or a slower blade",
    "hourglass": "a finer mesh or fully integrated elements",
    "drift": "a smaller time step",
    "stroke": "a longer way of the blade",
}
