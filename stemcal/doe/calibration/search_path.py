"""Search for a target response in another program or on another mesh, along a path through the ranges of some factors.

From the calibrated point, the first factor moves to the end of its range, then the second, and so on. The coordinate s
of the path, its `place` in the code, is the change of the logarithm of the response that the surface predicts:

    s = Σ eⱼ·Δvⱼ        eⱼ = ∂ ln ŷ/∂vⱼ at the calibrated point        vⱼ = ln xⱼ, or xⱼ where its range includes zero

The response y of another program or mesh differs from the surface by a scale a and a slope k:

    ln y = ln ŷ₀ + a + k·s

ŷ₀ is the prediction at the calibrated point. The first run determines a, with k = 1 as on the surface; the second
determines k. Once two runs bracket the target, the next place is interpolated linearly between them (regula falsi).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import exp, inf, isfinite, log

from stemcal.doe.regression.least_squares import t_quantile
from stemcal.errors import UsageError

_MOST_LOG, _MOST_SHARE = log(3.0), 0.5  # largest step of ln x; `_MOST_SHARE`: of x, as a share of the range
_LEAST_SLOPE = 0.02  # below this slope k the response practically does not depend on the factors
_MARGIN = 0.03  # smallest distance of the next place from an end of a bracket, as a fraction of its width
_SAME = 1e-6  # places nearer than this are equal
_ASIDE = (0.1, -0.1)  # places to try after the run at the start has failed


@dataclass(frozen=True)
class Mover:
    """A factor that may move: its start, its range, and its relative slope (∂ŷ/∂x)/ŷ on the surface at the start."""

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
        """The slope e = ∂ ln ŷ/∂v."""
        return self.relative_slope * (self.start if self._by_ratio else 1.0)

    @property
    def longest(self) -> float:
        """The largest change of s in one step."""
        return abs(self._slope) * (_MOST_LOG if self._by_ratio else _MOST_SHARE * (self.high - self.low))

    def reach(self, upwards: bool) -> float:
        """Return the distance along s, never negative, from the start to the end of the range."""
        end = self.high if upwards == (self._slope > 0.0) else self.low
        way = log(end / self.start) if self._by_ratio else end - self.start
        return max(0.0, self._slope * way if upwards else -self._slope * way)

    def moved(self, change: float) -> float:
        """Return the value of the factor after a change of s, which must be within `reach`."""
        way = change / self._slope
        value = self.start * exp(way) if self._by_ratio else self.start + way
        return min(max(value, self.low), self.high)


@dataclass(frozen=True)
class SearchPath:
    """A path along which one factor after another changes: the factors (`movers`) in the order of their changes."""

    movers: tuple[Mover, ...]

    def __post_init__(self) -> None:
        for mover in self.movers:
            if mover.relative_slope == 0.0 or not isfinite(mover.relative_slope):
                no_effect = f"{mover.name} has no effect on the response surface"
                raise UsageError(f"refine.adjust: {no_effect}; remove the factor")

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest place on the path."""
        down, up = (sum(mover.reach(upwards) for mover in self.movers) for upwards in (False, True))
        return -down, up

    def at(self, place: float) -> dict[str, float]:
        """Return the factor values at a place."""
        left, values = abs(place), {}
        for mover in self.movers:
            here = min(left, mover.reach(place > 0.0))
            left -= here
            values[mover.name] = mover.moved(here if place > 0.0 else -here)
        return values

    def longest(self, place: float, upwards: bool) -> float:
        """Return the longest step up or down from a place: that of the factor that changes on this part of the path."""
        passed, away = 0.0, (place > 0.0) == upwards
        for mover in self.movers:
            passed += mover.reach(place > 0.0)
            if abs(place) < passed or (abs(place) == passed and not away):
                return mover.longest
        return self.movers[-1].longest


@dataclass(frozen=True)
class Tried:
    """A simulated place on the path and its response, which is NaN if the run failed."""

    place: float
    response: float

    @property
    def level(self) -> float:
        """The logarithm of the response; −∞ if the response is not positive or the run failed."""
        return log(self.response) if self.response > 0.0 else -inf


def best_of(tried: Sequence[Tried], aim: float) -> Tried | None:
    """Return the run of least |ln(y/aim)|, the earliest of equals; None if all runs failed."""
    whole = [run for run in tried if isfinite(run.level)]
    return min(whole, key=lambda run: abs(run.level - log(aim)), default=None)


def next_step(tried: Sequence[Tried], aim: float, path: SearchPath) -> tuple[float, float | None] | None:
    """Return the next place to simulate to reach the response `aim`, and the response predicted there, if known.

    `tried` contains at least one run, in the order of simulation. After a failed run the next place is half-way back to
    the best run; while all runs have failed, it is near the start. Return None if no new place is left.
    """
    whole, best = [run for run in tried if isfinite(run.level)], best_of(tried, aim)
    ordered = sorted(whole, key=lambda run: run.place)
    brackets = [pair for pair in pairwise(ordered) if (pair[0].response < aim) != (pair[1].response < aim)]
    if best is None:
        low, high = path.ends
        places: list[tuple[float, float | None]] = [(min(max(place, low), high), None) for place in _ASIDE]
    elif not isfinite(tried[-1].level):
        places = [(0.5 * (best.place + tried[-1].place), None)]
    elif brackets:
        nearest = min(brackets, key=lambda pair: sum(abs(run.level - log(aim)) for run in pair))
        places = [(_between(*nearest, log(aim)), aim)]
    else:
        place = _beyond(whole, best, log(aim), path)
        places = [(place, exp(best.level + _slope(whole, best) * (place - best.place)))]
    return next((step for step in places if all(abs(step[0] - run.place) > _SAME for run in tried)), None)


def _between(left: Tried, right: Tried, aim: float) -> float:
    """Interpolate ln y linearly between two runs that bracket the target, and keep off the ends of the bracket."""
    share = (aim - left.level) / (right.level - left.level)
    return left.place + min(max(share, _MARGIN), 1.0 - _MARGIN) * (right.place - left.place)


def _beyond(whole: Sequence[Tried], best: Tried, aim: float, path: SearchPath) -> float:
    """Extrapolate ln y from the best run, as far as the longest step and the range allow.

    If the response hardly depends on the place, move on from the outermost run by the longest step.
    """
    slope, upwards, start = _slope(whole, best), aim > best.level, best.place
    wanted = (aim - best.level) / slope if slope > _LEAST_SLOPE else (inf if upwards else -inf)
    if slope <= _LEAST_SLOPE:
        start = (max if upwards else min)(run.place for run in whole)
    longest = path.longest(start, upwards)
    low, high = path.ends
    return min(max(start + min(max(wanted, -longest), longest), low), high)


def _slope(whole: Sequence[Tried], best: Tried) -> float:
    """Return k = ∂ ln y/∂s between the best run and its nearest neighbour; 1, as on the surface, for a single run."""
    others = [run for run in whole if run is not best]
    if not others:
        return 1.0
    near = min(others, key=lambda run: abs(run.place - best.place))
    return (best.level - near.level) / (best.place - near.place)


def ends_of(
    tried: Sequence[Tried], best: Tried, path: SearchPath, relative_error: float, df: float
) -> dict[str, tuple[float, float]]:
    """Return the 95 % confidence interval of each factor, with the other factors fixed: Δs = t·σ/k.

    σ is the relative standard error of the measured mean with `df` degrees of freedom, k the slope at the best run.
    """
    slope = _slope([run for run in tried if isfinite(run.level)], best)
    half = t_quantile(0.95, df) * relative_error / abs(slope) if abs(slope) > _LEAST_SLOPE else inf
    low, high = path.ends
    below, above = path.at(max(best.place - half, low)), path.at(min(best.place + half, high))
    return {name: (min(below[name], above[name]), max(below[name], above[name])) for name in below}
