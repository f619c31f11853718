"""The search region, a box in coded units that a sphere may limit further, and optimisation in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from stemcal.arrays import Array, Mask
from stemcal.doe.regression.section import AnySurface
from stemcal.errors import UsageError

_ROUNDING = 1e-9
_MOST_CORNERS = 256  # the cloud of points includes the corners of a box only up to this number of corners, 2^k
_CLOUD = 11  # 2^11 points fill a region of up to five factors closely enough to find each branch of a quadratic
_STARTS, _SPACING = 8, 0.25  # number of local searches; `_SPACING`: coded distance between their starts, at least


@dataclass(frozen=True, eq=False)
class Region:
    """The convex region of all coded x with low ≤ x ≤ high and, unless the radius is None, ‖x‖ ≤ radius."""

    low: Array
    high: Array
    radius: float | None

    def __post_init__(self) -> None:
        if self.low.shape != self.high.shape or np.any(self.low >= self.high):
            raise UsageError("invert: the lower limit of a factor is not below its upper limit; correct the limits")
        if self.radius is not None and not np.linalg.norm(np.clip(0.0, self.low, self.high)) < self.radius:
            raise UsageError("invert: the factor ranges contain no point of the experimental region; widen the ranges")

    @property
    def k(self) -> int:
        """Number of factors."""
        return int(self.low.size)

    @property
    def middle(self) -> Array:
        """The point of the region that is nearest to the centre of the design, x = 0."""
        return np.asarray(np.clip(0.0, self.low, self.high))

    def contains(self, points: Array, tolerance: float = _ROUNDING) -> Mask:
        """Return a mask of the points (m, k) that are inside, (m,)."""
        inside = np.all((points >= self.low - tolerance) & (points <= self.high + tolerance), axis=1)
        if self.radius is not None:
            inside &= np.linalg.norm(points, axis=1) <= self.radius + tolerance
        return np.asarray(inside)

    def widened(self, times: float) -> Region:
        """Return a larger region with the same middle: all widths and the radius are multiplied by `times`."""
        more = 0.5 * (times - 1.0) * np.subtract(*self.bounds()[::-1])
        low, high = self.bounds()
        return Region(low - more, high + more, None if self.radius is None else times * self.radius)

    def bounds(self) -> tuple[Array, Array]:
        """Return the lower and upper limits of the region along each axis: those of the box, cut at ± the radius."""
        reach = np.inf if self.radius is None else self.radius
        return np.maximum(self.low, -reach), np.minimum(self.high, reach)

    def nearest(self, point: Array) -> Array:
        """Move a point into the region: first into the box, then on the line towards `middle` onto the sphere."""
        inside = np.clip(point, self.low, self.high)
        if self.radius is None or np.linalg.norm(inside) <= self.radius:
            return np.asarray(inside)
        anchor = self.middle
        line = inside - anchor
        # |anchor + s·line| = radius: a quadratic equation in s with one root between 0 and 1
        a, b, c = float(line @ line), float(anchor @ line), float(anchor @ anchor) - self.radius**2
        return np.asarray(anchor + (-b + np.sqrt(b * b - a * c)) / a * line)

    def cloud(self, log2_points: int) -> Array:
        """Return points (m, k) that fill the region: a Sobol sequence of 2^`log2_points`, corners, ends of the axes."""
        from scipy.stats.qmc import Sobol

        low, high = self.bounds()
        nearest = self.middle
        axes = np.vstack([np.where(np.eye(self.k, dtype=bool), end, nearest) for end in (low, high)])
        corners = list(product(*zip(low, high, strict=True))) if 2**self.k <= _MOST_CORNERS else []
        filling = low + (high - low) * Sobol(self.k, scramble=False).random_base2(log2_points)
        points = np.vstack([nearest, axes, *corners, filling])
        if self.radius is not None:  # points outside the sphere are moved onto it
            length = np.linalg.norm(points, axis=1)
            points *= np.minimum(1.0, self.radius / np.maximum(length, 1e-300))[:, None]
        return np.asarray(points[self.contains(points)])


@dataclass(frozen=True, eq=False)
class Objective:
    """A function to be minimised: its value and gradient at one point (k,), and its values at `many` points (m, k)."""

    value: Callable[[Array], float]
    gradient: Callable[[Array], Array]
    many: Callable[[Array], Array]


def coordinate(j: int, sign: float, k: int) -> Objective:
    """Return the objective sign·xⱼ."""
    direction = np.zeros(k)
    direction[j] = sign
    return Objective(lambda x: sign * float(x[j]), lambda x: direction, lambda points: sign * points[:, j])


def height(surface: AnySurface, sign: float) -> Objective:
    """Return the objective sign·ŷ(x)."""
    return Objective(
        lambda x: sign * float(surface.predict(x)[0]),
        lambda x: sign * surface.gradient(x),
        lambda points: sign * surface.predict(points),
    )


def squared_distance() -> Objective:
    """Return the objective ‖x‖², the squared coded distance from the centre."""
    return Objective(lambda x: float(x @ x), lambda x: 2.0 * x, lambda points: np.sum(points**2, axis=1))


def extremes(surface: AnySurface, region: Region) -> tuple[Array, Array]:
    """Return the points of the region with the smallest and the largest ŷ."""
    cloud = region.cloud(_CLOUD)
    lowest = optimise(height(surface, 1.0), cloud, region)[0]
    return lowest, optimise(height(surface, -1.0), cloud, region)[0]


def optimise(objective: Objective, seeds: Array, region: Region, rule: dict[str, Any] | None = None) -> list[Array]:
    """Minimise from several `seeds` (m, k) under a constraint `rule` of SLSQP; return distinct optima, best first."""
    starts = _distinct(seeds[np.argsort(objective.many(seeds), kind="stable")], _SPACING)[:_STARTS]
    ends = [search_from(start, objective, region, rule) for start in starts]
    optima = [*starts[:1], *(point for point in ends if point is not None)]
    values = [round(objective.value(x), 10) for x in optima]
    order = sorted(range(len(optima)), key=lambda i: (values[i], tuple(-np.round(optima[i], 6))))
    return list(_distinct(np.array([optima[i] for i in order]), 1e-3))


def _distinct(points: Array, spacing: float) -> Array:
    """Return up to `_STARTS` of the points, the first ones with at least this spacing."""
    kept: list[Array] = []
    while len(points) and len(kept) < _STARTS:
        kept.append(points[0])
        points = points[np.linalg.norm(points - points[0], axis=1) > spacing]
    return np.array(kept)


def search_from(
    start: Array, objective: Objective, region: Region, rule: dict[str, Any] | None = None, kept: float = 1e-7
) -> Array | None:
    """Minimise with SLSQP from a point; None if it ends outside the region or violates the rule by more than `kept`."""
    from scipy.optimize import minimize

    low, high = region.bounds()
    rules = [] if rule is None else [rule]
    if (radius := region.radius) is not None:
        rules.append({"type": "ineq", "fun": lambda x: radius**2 - x @ x, "jac": lambda x: -2.0 * x})
    result = minimize(
        objective.value,
        start,
        jac=objective.gradient,
        method="SLSQP",
        bounds=list(zip(low, high, strict=True)),
        constraints=rules,
        options={"maxiter": 300, "ftol": 1e-14},
    )
    point: Array = np.clip(np.asarray(result.x, dtype=float), low, high)
    if not np.all(np.isfinite(point)) or not region.contains(point[None, :], 1e-7)[0]:
        return None
    value = np.atleast_1d(rule["fun"](point)) if rule else np.zeros(1)
    return point if np.all((-np.abs(value) if rule and rule["type"] == "eq" else value) >= -kept) else None
