"""Confidence intervals of the factors by profile likelihood, undetermined directions, and contradictory observations.

With the misfit D(x) of `likelihood`, the profile of factor j at v is the least D over all x with xⱼ = v, minus the
least D over all x. The 95 % interval contains all v with a profile of at most `Tangents.allowed`. An interval that ends
at the edge of the region is limited by the region, not by the data.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.likelihood import LEVEL, Fit
from stemcal.doe.calibration.search_region import (
    Objective,
    Region,
    extremes,
    height,
    optimise,
    search_from,
    squared_distance,
)

_GRID, _FREE = 25, 0.5  # values in a profile; `_FREE`: share of the range from which an interval leaves a factor free
_CLOUD, _SEEDS = 9, 3  # 2^9 points fill the region; `_SEEDS`: the number of them where local searches start
_SMALL_PART = 0.05  # smaller components of a direction, relative to the largest, are left out
_NEAR = 0.01  # an end nearer to the limit of the factor than this fraction of its range is at the limit
_WIDER = 1.5  # the ends of a profile are tested in a region wider by this factor
_INSIDE = 0.95  # an end is determined if the profile there is at least this share of `allowed`
_SLACK = 1e-6  # added to the radius: at an extreme xⱼ the region is a single point, which rounding must not exclude
_FLAT = 0.75  # a direction is undetermined if its interval has this fraction of the width of the region
_GOOD_TO = 0.03  # relative error assumed for means without scatter; otherwise no direction would be undetermined
_KEPT = 1e-6  # tolerance of constraints


@dataclass(frozen=True, eq=False)
class _Profile:
    """The profile of one factor, and its 95 % interval from `low` to `high` (coded).

    `bounded`: whether the data determine each end. An end is not determined if it is at the limit of the
    factor, or if it would move outwards in a region wider by half, because another factor is at its limit there.
    """

    factor: str
    values: Array  # coded values of the factor
    rise: Array  # the profile at these values
    allowed: float  # the profile at the ends of the interval
    low: float
    high: float
    bounded: tuple[bool, bool]
    share: float  # width of the interval as a fraction of the range

    @property
    def free(self) -> bool:
        """Whether the interval covers most of the range, so that the data do not determine the factor."""
        return self.share >= _FREE


def profiles_of(fit: Fit) -> list[_Profile]:
    """Return the profile of every factor."""
    names, region = fit.observations[0].surface.names, fit.region.widened(_WIDER)
    wider = replace(fit, region=region)
    wider = replace(wider, best=optimise(fit.objective, region.cloud(_CLOUD), region)[0])
    return [_profile(fit, j, name, wider) for j, name in enumerate(names)]


def _profile(fit: Fit, j: int, name: str, wider: Fit) -> _Profile:
    from scipy.optimize import brentq

    allowed, cloud = fit.tangents.allowed(np.eye(fit.region.k)[j]), fit.region.cloud(_CLOUD)
    low, high = (float(end[j]) for end in fit.region.bounds())
    values = np.unique(np.append(np.linspace(low, high, _GRID), fit.best[j]))
    middle, rise = int(np.searchsorted(values, fit.best[j])), np.zeros(len(values))
    # walk from the solution to both ends of the range; each search starts at the optimum for the previous value
    for walk in (range(middle - 1, -1, -1), range(middle + 1, len(values))):
        last = fit.best
        for i in walk:
            last = _held_at(fit, j, float(values[i]), last, cloud)
            rise[i] = fit.rise(last)

    def beyond(v: float) -> float:
        return fit.rise(_held_at(fit, j, v, fit.best, cloud)) - allowed

    def crossing(inside: int, outside: int) -> float:
        if beyond(values[inside]) > 0.0:  # the walk along the grid found a lower D than this search
            return float(values[inside])
        return float(brentq(beyond, values[inside], values[outside], xtol=1e-6))

    kept = np.flatnonzero(rise <= allowed)
    first, final = int(kept[0]), int(kept[-1])
    while first > 0 and beyond(values[first - 1]) <= 0.0:  # the walk along the grid had found a local minimum only
        first -= 1
    while final < len(values) - 1 and beyond(values[final + 1]) <= 0.0:
        final += 1
    bottom = crossing(first, first - 1) if first > 0 else low
    top = crossing(final, final + 1) if final < len(values) - 1 else high
    around = wider.region.cloud(_CLOUD)

    def determined(end: float, room: float) -> bool:
        in_the_wider = wider.rise(_held_at(wider, j, end, wider.best, around))
        return room > _NEAR * (high - low) and in_the_wider >= _INSIDE * allowed

    bounded = determined(bottom, bottom - low), determined(top, high - top)
    return _Profile(name, values, rise, allowed, bottom, top, bounded, (top - bottom) / (high - low))


def _held_at(fit: Fit, j: int, value: float, start: Array, cloud: Array) -> Array:
    """Return the point with the least D and xⱼ = value; the search starts from `start` and from points of the cloud."""
    region = fit.region
    if region.k == 1:
        return np.array([value])
    radius = None if region.radius is None else float(np.sqrt(max(region.radius**2 - value**2, 0.0))) + _SLACK
    rest = Region(np.delete(region.low, j), np.delete(region.high, j), radius)
    moved = cloud.copy()
    moved[:, j] = value
    moved = moved[region.contains(moved)]
    near = moved[np.argsort(fit.many(moved), kind="stable")[:_SEEDS]]
    seeds = np.array([rest.nearest(np.delete(x, j)) for x in [start, *near]])
    whole, others = fit.objective, np.arange(region.k) != j

    def among(points: Array) -> Array:
        """Return the points with xⱼ inserted; ten times as fast as `np.insert`."""
        whole_points = np.full((*points.shape[:-1], region.k), value)
        whole_points[..., others] = points
        return whole_points

    held = Objective(
        lambda x: whole.value(among(x)),
        lambda x: whole.gradient(among(x))[others],
        lambda points: whole.many(among(points)),
    )
    return among(optimise(held, seeds, rest)[0])


# ---- directions in the space of the factors that the data do not determine


def loose_directions(fit: Fit) -> tuple[Array, Array]:
    """Return coded unit vectors: the directions (n, k) without a first-order change of ŷ, and that of least change."""
    scale = np.sqrt(np.diagonal(fit.draws, axis1=1, axis2=2).T @ fit.weights)
    _, sizes, rows = np.linalg.svd(fit.tangents.slopes / scale[:, None])
    return np.asarray(rows[int(np.sum(sizes > 1e-8 * sizes.max(initial=0.0))) :]), np.asarray(rows[-1])


def moved_together(direction: Array) -> list[float]:
    """Scale a direction such that its largest component is 1; components below 0.05 become zero.

    >>> moved_together(np.array([-0.2, 0.4, 0.01]))
    [-0.5, 1.0, 0.0]
    """
    scaled = direction / direction[int(np.argmax(np.abs(direction)))]
    return [float(part) if abs(part) >= _SMALL_PART else 0.0 for part in scaled]


def _flat_directions(fit: Fit) -> Array:
    """Return coded unit vectors of directions in which the interval fills most of the region, (directions, factors).

    At a distance t along an eigenvector of the information matrix with eigenvalue λ, D rises by λt². The interval, in
    which D rises by at most c (`Tangents.allowed`), is therefore 2√(c/λ) long.
    """
    certainty, vectors = np.linalg.eigh(_scattered(fit).tangents.information)
    allowed = np.array([fit.tangents.allowed(v) for v in vectors.T])
    length = np.array([_chord(fit.region, v) for v in vectors.T])
    return np.asarray(vectors.T[np.maximum(certainty, 0.0) * (_FLAT * length) ** 2 <= 4.0 * allowed])


def settled(fit: Fit, within: Region | None = None) -> tuple[Fit, Array]:
    """Return the fit with its final solution, and the undetermined directions (see `_flat_directions`).

    If there are undetermined directions, the point of least D is arbitrary. The solution is then the point nearest to
    the centre whose D is within the confidence limit, moved at right angles to these directions to the least D.
    `within` is the part of the region for the solution, by default the whole.
    """
    region = within or fit.region
    if within is not None:
        fit = replace(fit, best=optimise(fit.objective, within.cloud(_CLOUD), within)[0])
    flat = _flat_directions(fit)
    if not len(flat):
        return fit, flat
    known, distance, cloud = _scattered(fit), squared_distance(), region.cloud(_CLOUD)
    most = known.least + max(fit.tangents.allowed(v) for v in flat)
    held = cloud[known.many(cloud) <= most]
    starts = [fit.best, *held[np.argsort(distance.many(held), kind="stable")[:_SEEDS]]]
    nearest = min((_least_under(distance, x, region, below(known, most)) for x in starts), key=distance.value)
    along = {"type": "eq", "fun": lambda z: flat @ (z - nearest), "jac": lambda z: flat}
    floor = replace(fit, best=_least_under(known.objective, nearest, region, along))
    there = _flat_directions(floor)  # the directions at the new point, where they may differ
    return floor, there if len(there) == len(flat) else flat


def _scattered(fit: Fit) -> Fit:
    """Return the fit; if the means have no scatter, give each a standard deviation of 3 %."""
    if fit.errors.scatter != "surface":
        return fit
    more = np.append((_GOOD_TO * fit.measured) ** 2, np.zeros(len(fit.priors)))
    return replace(fit, precision=np.linalg.inv(np.linalg.inv(fit.precision) + np.diag(more)))


def _chord(region: Region, direction: Array) -> float:
    """Return the width of a region in a direction, measured through the point of the region nearest to its centre."""
    rise = np.concatenate([direction, -direction])
    room = np.maximum(np.concatenate([region.high - region.middle, region.middle - region.low]), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        forward, backward = (np.where(sign * rise > 1e-12, room / (sign * rise), np.inf).min() for sign in (1.0, -1.0))
    longest = np.inf if region.radius is None else 2.0 * region.radius
    return float(min(sum(part for part in (forward, backward) if np.isfinite(part)), longest))


def below(fit: Fit, most: float) -> dict[str, Any]:
    """Return the constraint D ≤ most for SLSQP, divided by `most` to be of order one."""
    scale = max(most, 1e-300)
    return {"type": "ineq", "fun": lambda z: 1.0 - fit.value(z) / scale, "jac": lambda z: -fit.gradient(z) / scale}


def _least_under(objective: Objective, start: Array, region: Region, rule: dict[str, Any]) -> Array:
    """Minimise an objective under a constraint from a point that satisfies it; return the start if that is better."""
    z = search_from(start, objective, region, rule, _KEPT)
    return start if z is None or objective.value(z) > objective.value(start) else z


# ---- contradictory observations


@dataclass(frozen=True)
class _Contradiction:
    """An observation that contradicts the others: its index, distance from their prediction, and p-value."""

    index: int
    standard_errors: float
    p: float
    allowed: tuple[float, float]  # the interval that the other observations predict


def contradiction(fit: Fit) -> _Contradiction | None:
    """Return the observation that contradicts the others most; None if all agree at the significance level `LEVEL`.

    With degrees of freedom left, the p-value of the misfit decides whether they agree. Without any, each mean is tested
    separately: leaving out a mean that agrees lowers D by an amount with the distribution χ²(1). A mean out of reach of
    its own surface is replaced by the nearest value of the surface before this test.
    """
    from scipy.special import chdtrc

    m = len(fit.observations)
    if m < 2 or fit.errors.scatter == "surface" or (fit.df > 0 and (fit.p_value is None or fit.p_value >= LEVEL)):
        return None
    near = fit
    if fit.df < 1:
        within_reach = zip(fit.observations, _reached(fit).tolist(), strict=True)
        near = replace(fit, observations=tuple(replace(o, measured=value) for o, value in within_reach))
        near = replace(near, best=optimise(near.objective, fit.region.cloud(_CLOUD), fit.region)[0])
    excess = np.array([max(near.least - near.ignoring(i).least, 0.0) for i in range(m)])
    i = max(range(m), key=lambda j: (round(float(excess[j]), 6), j))
    ratio = (1.0 / fit.draws[:, i, i]) / (fit.weights @ (1.0 / fit.draws[:, i, i]))
    p = float(np.mean(chdtrc(1.0, excess[i] * ratio)))
    if fit.df < 1 and p >= LEVEL:
        return None
    return _Contradiction(i, float(excess[i] ** 0.5), p, _allowed(near, near.without(i), i))


def left_out(fit: Fit, groups: Sequence[object]) -> list[float]:
    """Return the error (%) of each observation in a fit without its group; empty if all are in the same group."""
    errors = np.zeros(len(groups))
    for members in _members(groups):
        errors[members] = fit.errors_percent(fit.ignoring(*members).best)[members]
    return errors.tolist() if len(set(groups)) > 1 else []


def left_out_intervals(fit: Fit, groups: Sequence[object]) -> list[tuple[float, float]]:
    """Return the 95 % prediction interval of each mean by a fit without its group, including the error of the mean."""
    fits = [(members, fit.without(*members)) for members in _members(groups)]
    intervals = {i: predicted_interval(fit, others, i) for members, others in fits for i in members}
    return [intervals[i] for i in range(len(groups))]


def predicted_interval(fit: Fit, others: Fit, i: int) -> tuple[float, float]:
    """Return the 95 % prediction interval of mean i by the fit to the `others`, including the error of the mean."""
    middle = float(fit.predict(others.best)[0, i])
    allowed = others.tangents.allowed(fit.slopes(others.best)[i])
    own = (allowed / (fit.weights @ (1.0 / fit.draws[:, i, i]))) ** 0.5
    low, high = _allowed(fit, others, i)
    return float(middle - np.hypot(middle - low, own)), float(middle + np.hypot(high - middle, own))


def _members(groups: Sequence[object]) -> list[list[int]]:
    """Return the indices of the members of each group; empty if there is only one group."""
    labels = list(dict.fromkeys(groups))
    return [[i for i, other in enumerate(groups) if other == label] for label in labels] if len(labels) > 1 else []


def _allowed(fit: Fit, others: Fit, i: int) -> tuple[float, float]:
    """Return the 95 % interval of ŷᵢ by the fit to the `others`: its extreme values over their 95 % region."""
    surface, slope = fit.observations[i].surface, fit.slopes(others.best)[i]
    rule = below(others, most := others.least + others.tangents.allowed(slope))
    cloud = fit.region.cloud(_CLOUD)
    held = np.vstack([others.best, cloud[others.many(cloud) <= most]])
    ends = []
    for sign in (1.0, -1.0):
        objective = height(surface, sign)
        start = held[int(np.argmin(objective.many(held)))]
        ends.append(float(surface.predict(_least_under(objective, start, fit.region, rule))[0]))
    return ends[0], ends[1]


def missed_observations(fit: Fit) -> list[int]:
    """Return the indices of observations out of reach: their surface is nowhere within the error of the mean."""
    variance = 1.0 / np.array([fit.weights @ (1.0 / fit.draws[:, i, i]) for i in range(len(fit.observations))])
    allowed = np.array([fit.tangents.allowed(slope) for slope in fit.tangents.slopes[: len(fit.observations)]])
    return np.flatnonzero((fit.measured - _reached(fit)) ** 2 > allowed * variance).tolist()


def _reached(fit: Fit) -> Array:
    """Return for each observation the value of its surface in the region that is nearest to the measured mean."""
    predicted, nearest = fit.predict(fit.region.cloud(_CLOUD)), fit.measured.copy()
    for i in np.flatnonzero((fit.measured < predicted.min(axis=0)) | (fit.measured > predicted.max(axis=0))):
        surface = fit.observations[i].surface
        low, high = (float(surface.predict(end)[0]) for end in extremes(surface, fit.region))
        nearest[i] = np.clip(nearest[i], low, high)
    return np.asarray(nearest)
