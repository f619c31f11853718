"""Parameters taken to another program: which way to go there, how far, and what was learnt of it.

The way is a line through the box of the factors that may move: the first of them goes to the end of its range, then the
second, and so on. Along it counts what the surface expects: a place s is the change of the logarithm of the response,

    s = Σ eⱼ·Δvⱼ        eⱼ = ∂ ln ŷ/∂vⱼ at the calibrated point        vⱼ = ln xⱼ, or xⱼ where its range holds zero

so that the response there, corrected by a scale a and a tilt k, is

    ln y = ln ŷ₀ + a + k·s

The first run tells a, with k = 1 as the surface has it; the second tells k. Once runs lie on both sides of the target,
the parabola through the three nearest or the line through two takes over, which stays between them (Brent, Algorithms
for Minimization without Derivatives, 1973, chapter 4).
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
# A tilt below this is none: the response does not follow.
_LEAST_TILT = 0.02
# How near the ends of a bracket a step may come.
_MARGIN = 0.03
_SAME = 1e-6
# Where the search goes on while not even the start could be simulated.
_ASIDE = (0.1, -0.1)


@dataclass(frozen=True)
class Mover:
    """A factor that may move: where it starts, its range, and ∂y/∂x over y as the surface has it at the start."""

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
        """Return how far s goes up or down until the factor stands at an end of its range; never negative."""
        end = self.high if upwards == (self._slope > 0.0) else self.low
        way = log(end / self.start) if self._by_ratio else end - self.start
        return max(0.0, self._slope * way if upwards else -self._slope * way)

    def moved(self, change: float) -> float:
        """Return the value after a change of s that is within reach."""
        way = change / self._slope
        value = self.start * exp(way) if self._by_ratio else self.start + way
        return min(max(value, self.low), self.high)


@dataclass(frozen=True)
class Way:
    """The movers in their order."""

    movers: tuple[Mover, ...]

    def __post_init__(self) -> None:
        for mover in self.movers:
            if mover.relative_slope == 0.0 or not isfinite(mover.relative_slope):
                raise UsageError(f"transfer.adjust: the surface does not tell how {mover.name} moves the response")

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest place."""
        down, up = (sum(mover.reach(upwards) for mover in self.movers) for upwards in (False, True))
        return -down, up

    def at(self, place: float) -> dict[str, float]:
        """Return the values of the movers at a place."""
        left, found = abs(place), {}
        for mover in self.movers:
            here = min(left, mover.reach(place > 0.0))
            left -= here
            found[mover.name] = mover.moved(here if place > 0.0 else -here)
        return found

    def longest(self, place: float, upwards: bool) -> float:
        """Return the longest step from a place, that of the mover whose turn it is there."""
        passed, away = 0.0, (place > 0.0) == upwards
        for mover in self.movers:
            passed += mover.reach(place > 0.0)
            if abs(place) < passed or (abs(place) == passed and not away):
                return mover.longest
        return self.movers[-1].longest


@dataclass(frozen=True)
class Tried:
    """A place that was simulated and the response there, NaN where the run failed."""

    place: float
    response: float

    @property
    def level(self) -> float:
        """The logarithm of the response; −∞ of none or less."""
        return log(self.response) if self.response > 0.0 else -inf


@dataclass(frozen=True)
class Step:
    """A place to be simulated, and the response that is expected there by what was learnt so far, if that tells any."""

    place: float
    expected: float | None


def best_of(tried: Sequence[Tried], aim: float) -> Tried | None:
    """Return the run nearest to the aim by ratio, the earliest of equals; None where all failed."""
    whole = [one for one in tried if isfinite(one.level)]
    return min(whole, key=lambda one: abs(one.level - log(aim)), default=None)


def next_step(tried: Sequence[Tried], aim: float, way: Way) -> Step | None:
    """Return where to simulate next to come to the response `aim`; None where nothing is left to be tried.

    `tried` are in the order in which they were simulated, one at least; after a failed run it is half-way back to the
    best of the others, or a little aside of the start while there are no others.
    """
    whole, best = [one for one in tried if isfinite(one.level)], best_of(tried, aim)
    if best is None:
        low, high = way.ends
        aside = (min(max(place, low), high) for place in _ASIDE)
        return next((Step(place, None) for place in aside if _new(place, tried)), None)
    step = _step(whole, best, tried[-1], aim, way)
    return step if _new(step.place, tried) else None


def _step(whole: Sequence[Tried], best: Tried, last: Tried, aim: float, way: Way) -> Step:
    if not isfinite(last.level):
        return Step(0.5 * (best.place + last.place), None)
    inline = sorted(whole, key=lambda one: one.place)
    sides = [pair for pair in pairwise(inline) if (pair[0].response < aim) != (pair[1].response < aim)]
    if sides:
        nearest = min(sides, key=lambda pair: sum(abs(one.level - log(aim)) for one in pair))
        return Step(_between(*nearest, whole, log(aim)), aim)
    place = _beyond(whole, best, log(aim), way)
    return Step(place, exp(best.level + _slope(whole, best) * (place - best.place)))


def _new(place: float, tried: Sequence[Tried]) -> bool:
    return all(abs(place - one.place) > _SAME for one in tried)


def _between(one: Tried, other: Tried, whole: Sequence[Tried], aim: float) -> float:
    """Return a place between two of either side: by the parabola through them and a third run, or by a line."""
    low, high = one.place, other.place
    line = low + (aim - one.level) / (other.level - one.level) * (high - low)
    others = [run for run in whole if run is not one and run is not other]
    third = min(others, key=lambda run: abs(run.level - aim), default=None)
    place = line if third is None else _inverse_parabola((one, other, third), aim)
    first, last = low + _MARGIN * (high - low), high - _MARGIN * (high - low)
    return min(max(place if first <= place <= last else line, first), last)


def _inverse_parabola(points: Sequence[Tried], aim: float) -> float:
    """Return s(aim) of Lagrange's parabola through s over the logarithms; NaN where two of these are equal."""
    total = 0.0
    for i, one in enumerate(points):
        rest = [other for j, other in enumerate(points) if j != i]
        if any(one.level == other.level for other in rest):
            return float("nan")
        total += one.place * float(np.prod([(aim - other.level) / (one.level - other.level) for other in rest]))
    return total


def _beyond(whole: Sequence[Tried], best: Tried, aim: float, way: Way) -> float:
    """Return a place beyond the best run, as far as step and range allow; beyond all where the response is level."""
    tilt, upwards, start = _slope(whole, best), aim > best.level, best.place
    wanted = (aim - best.level) / tilt if tilt > _LEAST_TILT else (inf if upwards else -inf)
    if tilt <= _LEAST_TILT:
        start = (max if upwards else min)(one.place for one in whole)
    longest = way.longest(start, upwards)
    low, high = way.ends
    return min(max(start + min(max(wanted, -longest), longest), low), high)


def _slope(whole: Sequence[Tried], best: Tried) -> float:
    """Return ∂ ln y/∂s between the best run and the one nearest to it; 1, as the surface has it, while there is one."""
    others = [one for one in whole if one is not best]
    if not others:
        return 1.0
    near = min(others, key=lambda one: abs(one.place - best.place))
    return (best.level - near.level) / (best.place - near.place)


@dataclass(frozen=True)
class Learnt:
    """What corrects the surface there: response = scale·ŷ^tilt along the way, both told by the runs.

    `scale` is that of the calibrated point, `tilt` 1 where nothing was learnt beside it; `sd_percent` is what the line
    leaves of the runs, with its degrees of freedom, None where it passes through them.
    """

    scale: float
    tilt: float
    sd_percent: float | None
    df: int


def learnt_of(tried: Sequence[Tried], expected: float) -> Learnt | None:
    """Return scale and tilt by least squares over all runs that succeeded, for the response `expected` at the start."""
    whole = [one for one in tried if isfinite(one.level)]
    if not whole:
        return None
    places, levels = np.array([one.place for one in whole]), np.array([one.level for one in whole]) - log(expected)
    if len(whole) == 1:
        return Learnt(exp(float(levels[0] - places[0])), 1.0, None, 0)
    tilt, shift = np.polyfit(places, levels, 1)
    df = len(whole) - 2
    left = levels - (shift + tilt * places)
    return Learnt(exp(float(shift)), float(tilt), 100.0 * float(np.sqrt(left @ left / df)) if df else None, df)


def ends_of(
    tried: Sequence[Tried], best: Tried, way: Way, relative_error: float, df: float
) -> dict[str, tuple[float, float]]:
    """Return the 95 % interval of each mover for a target known with this relative standard error.

    The others stay where they are: Δs = t·σ/|∂ ln y/∂s| with the slope between the best run and its neighbour.
    """
    slope = _slope([one for one in tried if isfinite(one.level)], best)
    half = t_quantile(0.95, df) * relative_error / abs(slope) if abs(slope) > _LEAST_TILT else inf
    low, high = way.ends
    one, other = way.at(max(best.place - half, low)), way.at(min(best.place + half, high))
    return {name: (min(one[name], other[name]), max(one[name], other[name])) for name in one}
