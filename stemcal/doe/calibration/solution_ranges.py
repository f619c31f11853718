"""The level set {x : ŷ(x) = target} of one surface: the range of each factor over it, and one chosen solution."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from stemcal.arrays import Array
from stemcal.doe.calibration.search_region import Objective, Region, coordinate, extremes, optimise, squared_distance
from stemcal.doe.regression.section import AnySurface
from stemcal.doe.regression.surface import Surface
from stemcal.errors import TargetUnreachable, UsageError

Interval = tuple[float, float]
_CLOUD = 11  # 2^11 points fill the region
_PARTNERS = 4  # in `_level_points`, each point is connected by lines with this number of distant points


@dataclass(frozen=True)
class Assessment:
    """The predicted response at one coded point with 95 % intervals, which are None for a saturated fit."""

    coded: tuple[float, ...]
    coded_radius: float
    response: float
    mean_interval: Interval | None
    prediction_interval: Interval | None
    inside: bool  # whether the point is within the experimental region


@dataclass(frozen=True)
class Calibration:
    """The solution of ŷ(x) = target."""

    point: Assessment  # the solution chosen by `rule`
    ranges: tuple[Interval, ...]  # coded range of each factor over all solutions
    reachable: Interval  # smallest and largest ŷ in the region
    rule: str


@dataclass(frozen=True, eq=False)
class _LevelSet:
    """All points x of a region with ŷ(x) = target; `seeds` are some of them, from which searches start."""

    surface: Surface
    target: float
    region: Region
    seeds: Array

    def best(self, objective: Objective) -> list[Array]:
        """Return local optima of an objective over the set, best first."""
        # the constraint ŷ(x) = target for SLSQP, divided by the largest coefficient to be of order one
        surface, scale = self.surface, max(float(np.abs(self.surface.beta[1:]).max(initial=0.0)), 1e-300)
        level = {
            "type": "eq",
            "fun": lambda x: (surface.predict(x)[0] - self.target) / scale,
            "jac": lambda x: surface.gradient(x) / scale,
        }
        return optimise(objective, self.seeds, self.region, level)


def solve_target(
    surface: Surface,
    target: float,
    low: ArrayLike,
    high: ArrayLike,
    radius: float | None = None,
    rule: str = "least_coded_distance",
    unit: str = " N",
) -> Calibration:
    """Solve ŷ(x) = target: choose one solution, and find the range of each factor over all solutions.

    `low` and `high` (k,) are the coded ends of the factor ranges; the surface is valid within a sphere of this
    `radius`. The `rule` is ``least_coded_distance`` or ``others_at_centre``. Raises `TargetUnreachable`, with the
    `unit` in its message, if ŷ reaches the target nowhere in the region.
    """
    rules = {
        "least_coded_distance": lambda solutions: solutions.best(squared_distance()),
        "others_at_centre": _others_at_centre,
    }
    if rule not in rules:
        raise UsageError(f"invert.rule: unknown rule {rule!r}; choose one of {', '.join(rules)}")
    region = Region(np.asarray(low, dtype=float), np.asarray(high, dtype=float), radius)
    ends = extremes(surface, region)
    bottom, top = (float(surface.predict(end)[0]) for end in ends)
    slack = 1e-9 * abs(target)
    if not bottom - slack <= target <= top + slack:
        raise TargetUnreachable(target, bottom, top, unit)
    level_set = _LevelSet(surface, target, region, _level_points(surface, target, region, ends))
    point, k = assess_point(surface, rules[rule](level_set)[0], low, high, radius), region.k
    limits = ([float(level_set.best(coordinate(j, sign, k))[0][j]) for j in range(k)] for sign in (1.0, -1.0))
    return Calibration(point, tuple(zip(*limits, strict=True)), (bottom, top), rule)


def assess_point(
    surface: AnySurface,
    coded: ArrayLike,
    low: ArrayLike | None = None,
    high: ArrayLike | None = None,
    radius: float | None = None,
) -> Assessment:
    """Predict at one coded point; `inside` tests the box and the radius (default: distance of the outermost run)."""
    x = np.asarray(coded, dtype=float)
    distance = float(np.linalg.norm(x))
    reach = surface.design_radius if radius is None else radius
    inside = distance <= reach + 1e-6
    if low is not None and high is not None:
        inside = inside and bool(np.all((x >= np.asarray(low) - 1e-6) & (x <= np.asarray(high) + 1e-6)))
    return Assessment(
        coded=tuple(map(float, x)),
        coded_radius=distance,
        response=float(surface.predict(x)[0]),
        mean_interval=_interval(surface.mean_interval(x)[0]),
        prediction_interval=_interval(surface.prediction_interval(x)[0]),
        inside=inside,
    )


def _interval(ends: Array) -> Interval | None:
    return (float(ends[0]), float(ends[1])) if np.all(np.isfinite(ends)) else None


def _level_points(surface: Surface, target: float, region: Region, ends: tuple[Array, Array]) -> Array:
    """Return points spread over the level set: one on each of many lines between points below and above the target."""
    cloud = np.vstack([*ends, region.cloud(_CLOUD)])
    gap = surface.predict(cloud) - target
    below, above = cloud[gap <= 0.0], cloud[gap > 0.0]
    if len(below) == 0 or len(above) == 0:  # the target is the smallest or largest ŷ
        return cloud[[int(np.argmin(np.abs(gap)))]]
    from scipy.spatial import cKDTree

    # each point is connected with the nearest point on the other side, and with a few distant ones
    starts, stops = [below, above], [above[cKDTree(above).query(below)[1]], below[cKDTree(below).query(above)[1]]]
    longest = max(len(below), len(above))
    for shift in range(_PARTNERS):
        starts.append(below[np.arange(longest) % len(below)])
        stops.append(above[(np.arange(longest) * (2 * shift + 1) + shift) % len(above)])
    return _crossings(surface, target, np.vstack(starts), np.vstack(stops))


def _crossings(surface: Surface, target: float, starts: Array, stops: Array) -> Array:
    """Return the points with ŷ = target on the lines from starts a to stops b, x = a + s·(b − a) with s from 0 to 1.

    Along a line ŷ − target is the quadratic q₂s² + q₁s + q₀, which follows from its values at s = 0, ½ and 1.
    """
    y0 = surface.predict(starts) - target
    y1 = surface.predict(stops) - target
    half = surface.predict(0.5 * (starts + stops)) - target
    q2, q1, q0 = 2.0 * (y0 + y1 - 2.0 * half), 4.0 * half - 3.0 * y0 - y1, y0
    # numerically stable formula; y0 and y1 differ in sign, so exactly one root is between 0 and 1
    root = np.sqrt(np.maximum(q1**2 - 4.0 * q2 * q0, 0.0))
    w = -0.5 * (q1 + np.where(q1 >= 0.0, root, -root))
    with np.errstate(divide="ignore", invalid="ignore"):
        candidates = np.column_stack([w / q2, q0 / w])
    candidates = np.where(np.isfinite(candidates), candidates, np.inf)
    nearest = np.argmin(np.abs(candidates - 0.5), axis=1)
    s = np.clip(candidates[np.arange(len(w)), nearest], 0.0, 1.0)
    return np.asarray(starts + s[:, None] * (stops - starts))


def _others_at_centre(solutions: _LevelSet) -> list[Array]:
    """Return solutions in the box, maybe outside the sphere, with all factors except the `leading` one at 0."""
    surface, region, j = solutions.surface, solutions.region, solutions.surface.leading
    line = np.zeros((3, region.k))
    line[:, j] = (-1.0, 0.0, 1.0)
    minus, middle, plus = surface.predict(line)
    # ŷ − target = q₂x² + q₁x + q₀ along the leading factor
    roots = np.roots([0.5 * (minus + plus) - middle, 0.5 * (plus - minus), middle - solutions.target])
    real = [float(root.real) for root in roots if abs(root.imag) <= 1e-9]
    inside = sorted((r for r in real if region.low[j] <= r <= region.high[j]), key=lambda r: (abs(r), -r))
    points = [np.where(np.arange(region.k) == j, r, 0.0) for r in inside]
    points = [x for x in points if replace(region, radius=None).contains(x[None])[0]]
    if not points:
        raise UsageError(
            f"invert.rule: `others_at_centre` has no solution for the target {solutions.target:g} within the range of "
            f"{surface.names[j]}; choose `least_coded_distance`"
        )
    return points
