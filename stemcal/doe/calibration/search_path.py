"""A path through the ranges of the factors that may move, and the search along it for a target response.

The first factor goes to the end of its range, then the second, and so on. The coordinate s along the path is the change
of the logarithm of the response that the surface predicts:

    s = Σ eⱼ·Δvⱼ        eⱼ = ∂ ln ŷ/∂vⱼ at the calibrated point        vⱼ = ln xⱼ, or xⱼ where its range includes zero

In another program or mesh the response is corrected by a scale a and a slope k:

    ln y = ln ŷ₀ + a + k·s

The first run determines a, with k = 1 as on the surface; the second determines k. Once runs lie on both sides of the
target, the next point is between them, on the parabola through the three nearest runs or the line through two (Brent,
Algorithms for Minimization without Derivatives, 1973, chapter 4).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import exp, inf, isfinite, log

import numpy as np

from stemcal.doe.regression.least_squares import t_quantile
from stemcal.errors import UsageError

# No step changes a factor by more than this: the logarithm of three, or half of its range where that holds zero.
_MOST_LOG, _MOST_SHARE = log(3.0), 0.5
# With a slope below this the response does not follow the factors.
_LEAST_TILT = 0.02
# How near the ends of a bracket a step may come.
_MARGIN = 0.03
_SAME = 1e-6
# Where the search continues while all runs, the start included, have failed.
_ASIDE = (0.1, -0.1)


@dataclass(frozen=True)
class Mover:
    """A factor that may move: its start, its range, and ∂y/∂x divided by y on the surface at the start."""

    name: str
    start: float
    low: float
    high: float
    relative_slope: float

    @property
    def _by_ratio(self) -> bool:
        return self.low > 0.0 and self.start > 0.0

    @property
    def _slope(self) -> float:
        """∂ ln y/∂v."""
        return self.relative_slope * (self.start if self._by_ratio else 1.0)

    @property
    def longest(self) -> float:
        """The longest step, as a change of s."""
        return abs(self._slope) * (_MOST_LOG if self._by_ratio else _MOST_SHARE * (self.high - self.low))

    def reach(self, upwards: bool) -> float:
        """Return the change of s, up or down, at which the factor reaches the end of its range; never negative."""
        end = self.high if upwards == (self._slope > 0.0) else self.low
        way = log(end / self.start) if self._by_ratio else end - self.start
        return max(0.0, self._slope * way if upwards else -self._slope * way)

    def moved(self, change: float) -> float:
        """Return the value after a change of s within `reach`."""
        way = change / self._slope
        value = self.start * exp(way) if self._by_ratio else self.start + way
        return min(max(value, self.low), self.high)


@dataclass(frozen=True)
class SearchPath:
    """The factors that may move, in their order."""

    movers: tuple[Mover, ...]

    def __post_init__(self) -> None:
        for mover in self.movers:
            if mover.relative_slope == 0.0 or not isfinite(mover.relative_slope):
                no_effect = f"{mover.name} has no effect on the response surface"
                raise UsageError(f"refine.adjust: {no_effect}; remove the factor")

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest place."""
        down, up = (sum(mover.reach(upwards) for mover in self.movers) for upwards in (False, True))
        return -down, up

    def at(self, place: float) -> dict[str, float]:
        """Return the values of the movers at a place."""
        left, values = abs(place), {}
        for mover in self.movers:
            here = min(left, mover.reach(place > 0.0))
            left -= here
            values[mover.name] = mover.moved(here if place > 0.0 else -here)
        return values

    def longest(self, place: float, upwards: bool) -> float:
        """Return the longest step from a place: that of the factor that moves there."""
        passed, away = 0.0, (place > 0.0) == upwards
        for mover in self.movers:
            passed += mover.reach(place > 0.0)
            if abs(place) < passed or (abs(place) == passed and not away):
                return mover.longest
        return self.movers[-1].longest


@dataclass(frozen=True)
class Tried:
    """A place that was simulated, and the response; NaN where the run failed."""

    place: float
    response: float

    @property
    def level(self) -> float:
        """The logarithm of the response; −∞ of none or less."""
        return log(self.response) if self.response > 0.0 else -inf


@dataclass(frozen=True)
class Step:
    """A place to simulate, and the response predicted there by the runs so far; None where they predict none."""

    place: float
    expected: float | None


def best_of(tried: Sequence[Tried], aim: float) -> Tried | None:
    """Return the run nearest to the aim by ratio, the earliest of equals; None where all failed."""
    whole = [run for run in tried if isfinite(run.level)]
    return min(whole, key=lambda run: abs(run.level - log(aim)), default=None)


def next_step(tried: Sequence[Tried], aim: float, path: SearchPath) -> Step | None:
    """Return the next place to simulate to reach the response `aim`; None if no new place is left.

    `tried` has at least one run, in the order of simulation. After a failed run the next place is half-way back to the
    best run, or a little next to the start while all runs have failed.
    """
    whole, best = [run for run in tried if isfinite(run.level)], best_of(tried, aim)
    inline = sorted(whole, key=lambda run: run.place)
    sides = [pair for pair in pairwise(inline) if (pair[0].response < aim) != (pair[1].response < aim)]
    if best is None:
        low, high = path.ends
        steps = [Step(min(max(place, low), high), None) for place in _ASIDE]
    elif not isfinite(tried[-1].level):
        steps = [Step(0.5 * (best.place + tried[-1].place), None)]
    elif sides:
        nearest = min(sides, key=lambda pair: sum(abs(run.level - log(aim)) for run in pair))
        steps = [Step(_between(*nearest, whole, log(aim)), aim)]
    else:
        place = _beyond(whole, best, log(aim), path)
        steps = [Step(place, exp(best.level + _slope(whole, best) * (place - best.place)))]
    return next((step for step in steps if all(abs(step.place - run.place) > _SAME for run in tried)), None)


def _between(left: Tried, right: Tried, whole: Sequence[Tried], aim: float) -> float:
    """Return a place between two runs on either side: by the parabola through them and a third run, or by a line."""
    low, high = left.place, right.place
    line = low + (aim - left.level) / (right.level - left.level) * (high - low)
    others = [run for run in whole if run is not left and run is not right]
    third = min(others, key=lambda run: abs(run.level - aim), default=None)
    place = line
    if third is not None and third.level not in (left.level, right.level):
        # s(aim) of Lagrange's parabola through s over the logarithms
        place, points = 0.0, (left, right, third)
        for run in points:
            rest = [other for other in points if other is not run]
            place += run.place * float(np.prod([(aim - other.level) / (run.level - other.level) for other in rest]))
    first, last = low + _MARGIN * (high - low), high - _MARGIN * (high - low)
    return min(max(place if first <= place <= last else line, first), last)


def _beyond(whole: Sequence[Tried], best: Tried, aim: float, path: SearchPath) -> float:
    """Return a place beyond the best run, limited by step and range; beyond all runs where the response is level."""
    tilt, upwards, start = _slope(whole, best), aim > best.level, best.place
    wanted = (aim - best.level) / tilt if tilt > _LEAST_TILT else (inf if upwards else -inf)
    if tilt <= _LEAST_TILT:
        start = (max if upwards else min)(run.place for run in whole)
    longest = path.longest(start, upwards)
    low, high = path.ends
    return min(max(start + min(max(wanted, -longest), longest), low), high)


def _slope(whole: Sequence[Tried], best: Tried) -> float:
    """Return ∂ ln y/∂s between the best run and the one nearest to it; 1, as on the surface, while there is one run."""
    others = [run for run in whole if run is not best]
    if not others:
        return 1.0
    near = min(others, key=lambda run: abs(run.place - best.place))
    return (best.level - near.level) / (best.place - near.place)


def ends_of(
    tried: Sequence[Tried], best: Tried, path: SearchPath, relative_error: float, df: float
) -> dict[str, tuple[float, float]]:
    """Return the 95 % interval of each factor, others fixed: Δs = t·σ/|∂ ln y/∂s|, slope from best run to neighbour."""
    slope = _slope([one for one in tried if isfinite(one.level)], best)
    half = t_quantile(0.95, df) * relative_error / abs(slope) if abs(slope) > _LEAST_TILT else inf
    low, high = path.ends
    one, other = path.at(max(best.place - half, low)), path.at(min(best.place + half, high))
    return {name: (min(one[name], other[name]), max(one[name], other[name])) for name in one}
