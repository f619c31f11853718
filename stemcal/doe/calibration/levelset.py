"""Points of a region where the surface takes one value, and the best of them by some measure."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface

# 2^11 points fill a region of up to five factors closely enough to find every branch of a quadratic.
_CLOUD = 11
# Local searches start from this many of the best points, no two closer than the spacing (coded units).
_STARTS, _SPACING = 8, 0.25
_PARTNERS = 4


@dataclass(frozen=True, eq=False)
class Objective:
    """What to make small, for one point of (k,), and its gradient; `many` is the same for (m, k) points."""

    value: Callable[[Array], float]
    gradient: Callable[[Array], Array]
    many: Callable[[Array], Array]


def coordinate(j: int, sign: float, k: int) -> Objective:
    """Make sign·xⱼ small."""
    direction = np.zeros(k)
    direction[j] = sign
    return Objective(lambda x: sign * float(x[j]), lambda x: direction, lambda points: sign * points[:, j])


def height(surface: Surface, sign: float) -> Objective:
    """Make sign·ŷ small."""
    return Objective(
        lambda x: sign * float(surface.predict(x)[0]),
        lambda x: sign * surface.gradient(x),
        lambda points: sign * surface.predict(points),
    )


def squared_distance() -> Objective:
    """Make the squared coded distance to the centre small."""
    return Objective(lambda x: float(x @ x), lambda x: 2.0 * x, lambda points: np.sum(points**2, axis=1))


def extremes(surface: Surface, region: Region) -> tuple[Array, Array]:
    """Return the points of the region where ŷ is least and greatest."""
    cloud = region.cloud(_CLOUD)
    lowest = optimise(height(surface, 1.0), cloud, region)[0]
    return lowest, optimise(height(surface, -1.0), cloud, region)[0]


def level_points(surface: Surface, target: float, region: Region, ends: tuple[Array, Array]) -> Array:
    """Scatter points over {x in region : ŷ(x) = target}.

    Between two points of the region with ŷ on either side of the target there is one where ŷ, a quadratic
    along the way, equals it; the region is convex, so that point is inside.
    """
    cloud = np.vstack([*ends, region.cloud(_CLOUD)])
    gap = surface.predict(cloud) - target
    below, above = cloud[gap <= 0.0], cloud[gap > 0.0]
    if len(below) == 0 or len(above) == 0:  # the target is an extreme of the surface itself
        return cloud[[int(np.argmin(np.abs(gap)))]]
    starts, stops = _pairs(below, above)
    return _crossings(surface, target, starts, stops)


def _pairs(below: Array, above: Array) -> tuple[Array, Array]:
    """Pair each point with its nearest on the other side, and with a few far away."""
    near = neighbours_across(below, above)
    starts, stops = [near[0]], [near[1]]
    longest = max(len(below), len(above))
    for shift in range(_PARTNERS):
        starts.append(below[np.arange(longest) % len(below)])
        stops.append(above[(np.arange(longest) * (2 * shift + 1) + shift) % len(above)])
    return np.vstack(starts), np.vstack(stops)


def neighbours_across(below: Array, above: Array) -> tuple[Array, Array]:
    """Pair each point with its nearest on the other side: starts and stops, (m, k) each."""
    from scipy.spatial import cKDTree

    stops = above[cKDTree(above).query(below)[1]], below[cKDTree(below).query(above)[1]]
    return np.vstack([below, above]), np.vstack(stops)


def _crossings(surface: Surface, target: float, starts: Array, stops: Array) -> Array:
    """Solve ŷ(a + s·(b − a)) = target for s in [0, 1]: q₂s² + q₁s + q₀ = 0 from its values at 0, ½, 1."""
    y0 = surface.predict(starts) - target
    y1 = surface.predict(stops) - target
    half = surface.predict(0.5 * (starts + stops)) - target
    q2, q1, q0 = 2.0 * (y0 + y1 - 2.0 * half), 4.0 * half - 3.0 * y0 - y1, y0
    # Stable root formula; y0 and y1 differ in sign, so exactly one root lies between.
    root = np.sqrt(np.maximum(q1**2 - 4.0 * q2 * q0, 0.0))
    w = -0.5 * (q1 + np.where(q1 >= 0.0, root, -root))
    with np.errstate(divide="ignore", invalid="ignore"):
        candidates = np.column_stack([w / q2, q0 / w])
    candidates = np.where(np.isfinite(candidates), candidates, np.inf)
    nearest = np.argmin(np.abs(candidates - 0.5), axis=1)
    s = np.clip(candidates[np.arange(len(w)), nearest], 0.0, 1.0)
    return np.asarray(starts + s[:, None] * (stops - starts))


def optimise(
    objective: Objective,
    seeds: Array,
    region: Region,
    surface: Surface | None = None,
    target: float = 0.0,
) -> list[Array]:
    """Search from several seeds; return the distinct local optima, best first.

    Parameters
    ----------
    seeds : array (m, k)
        Points that meet the constraints.
    surface, target
        If given, ŷ(x) = target is a constraint.
    """
    starts = _distinct(seeds[np.argsort(objective.many(seeds), kind="stable")], _SPACING)[:_STARTS]
    rule = None if surface is None else _on_level(surface, target)
    ends = [search_from(start, objective, region, rule) for start in starts]
    found = [*starts[:1], *(point for point in ends if point is not None)]
    values = [round(objective.value(x), 10) for x in found]
    order = sorted(range(len(found)), key=lambda i: (values[i], tuple(-np.round(found[i], 6))))
    return list(_distinct(np.array([found[i] for i in order]), 1e-3))


def _distinct(points: Array, spacing: float) -> Array:
    """Keep the first of every bunch of points, in order."""
    kept: list[Array] = []
    left = points
    while len(left) and len(kept) < _STARTS:
        kept.append(left[0])
        left = left[np.linalg.norm(left - left[0], axis=1) > spacing]
    return np.array(kept)


def search_from(
    start: Array, objective: Objective, region: Region, rule: dict[str, Any] | None = None, kept: float = 1e-7
) -> Array | None:
    """Run SLSQP from a point; None if it ends outside the region, or breaks a rule by more than `kept`."""
    from scipy.optimize import minimize

    low, high = region.bounds()
    result = minimize(
        objective.value,
        start,
        jac=objective.gradient,
        method="SLSQP",
        bounds=list(zip(low, high, strict=True)),
        constraints=[*([rule] if rule else []), *region.rules()],
        options={"maxiter": 300, "ftol": 1e-14},
    )
    point: Array = np.clip(np.asarray(result.x, dtype=float), low, high)
    if not np.all(np.isfinite(point)) or not region.contains(point[None, :], 1e-7)[0]:
        return None
    room = np.atleast_1d(rule["fun"](point)) if rule else np.zeros(1)
    return point if np.all((-np.abs(room) if rule and rule["type"] == "eq" else room) >= -kept) else None


def _on_level(surface: Surface, target: float) -> dict[str, Any]:
    """Return ŷ(x) = target as SLSQP takes it, of order one by the size of the surface's variation."""
    scale = max(float(np.abs(surface.beta[1:]).max(initial=0.0)), 1e-300)
    return {
        "type": "eq",
        "fun": lambda x: (surface.predict(x)[0] - target) / scale,
        "jac": lambda x: surface.gradient(x) / scale,
    }
