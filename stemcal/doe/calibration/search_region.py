"""The region a solution may come from: a coded box, cut by a sphere about the centre and by planes if there are any."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.designs.i_optimal import HalfSpace
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

_ROUNDING = 1e-9
# Corners of a box double with each factor; beyond this many they add nothing to the spread points.
_MOST_CORNERS = 256


@dataclass(frozen=True, eq=False)
class Region:
    """All x with low ≤ x ≤ high, ‖x‖ ≤ radius if one is given, and a·x ≤ b of each half space. It is convex."""

    low: Array
    high: Array
    radius: float | None
    within: tuple[HalfSpace, ...] = ()

    def __post_init__(self) -> None:
        if self.low.shape != self.high.shape or np.any(self.low >= self.high):
            raise UsageError("invert: the lower end of a factor's range is not below its upper end")
        if self.radius is not None and not np.linalg.norm(np.clip(0.0, self.low, self.high)) < self.radius:
            raise UsageError("invert: the factor ranges and the design sphere have no common point")
        if self.within:
            self._require_room()

    def _require_room(self) -> None:
        nearest = _nearest_in(self.planes, np.zeros(self.k))
        if nearest is None or (self.radius is not None and np.linalg.norm(nearest) > self.radius):
            raise UsageError("constraints: they leave no point of the region; raise their at_most, or widen a range")

    @property
    def k(self) -> int:
        """Number of factors."""
        return int(self.low.size)

    @cached_property
    def planes(self) -> tuple[Array, Array]:
        """The box and the half spaces as Ax ≤ b."""
        normals = np.array([half.normal for half in self.within]).reshape(-1, self.k)
        limits = np.array([half.limit for half in self.within])
        one = np.eye(self.k)
        return np.vstack([one, -one, normals]), np.concatenate([self.high, -self.low, limits])

    @cached_property
    def middle(self) -> Array:
        """The point of the region nearest to the centre."""
        if not self.within:
            return np.asarray(np.clip(0.0, self.low, self.high))
        nearest = _nearest_in(self.planes, np.zeros(self.k))
        assert nearest is not None
        return nearest

    def contains(self, points: Array, tolerance: float = _ROUNDING) -> NDArray[np.bool_]:
        """Tell for each of (m, k) points whether it lies inside."""
        inside = np.all((points >= self.low - tolerance) & (points <= self.high + tolerance), axis=1)
        if self.radius is not None:
            inside &= np.linalg.norm(points, axis=1) <= self.radius + tolerance
        if self.within:
            normals, limits = self.planes
            inside &= np.all(points @ normals.T <= limits + tolerance, axis=1)
        return np.asarray(inside)

    def bounds(self) -> tuple[Array, Array]:
        """Return the smallest box around the region's reach along each axis."""
        if self.within:
            return self._ends
        reach = np.inf if self.radius is None else self.radius
        return np.maximum(self.low, -reach), np.minimum(self.high, reach)

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """Least and greatest value of each coordinate, by SLSQP from the middle: the region is convex."""
        from scipy.optimize import minimize

        found = np.empty((2, self.k))
        for row, sign in enumerate((1.0, -1.0)):
            for j, slope in enumerate(sign * np.eye(self.k)):
                box, rules = list(zip(self.low, self.high, strict=True)), self.rules()
                done = minimize(
                    lambda x, c=slope: c @ x, self.middle, jac=lambda x, c=slope: c, bounds=box, constraints=rules
                )
                found[row, j] = np.clip(done.x[j], self.low[j], self.high[j])
        return found[0], found[1]

    def rules(self, more: int = 0) -> list[dict[str, Any]]:
        """Return |x| ≤ radius and the planes, if there are any, as SLSQP takes them; x precedes further variables."""
        return [*self._sphere(more), *self._cut(more)]

    def _cut(self, more: int) -> list[dict[str, Any]]:
        if not self.within:
            return []
        k, (normals, limits) = self.k, (part[2 * self.k :] for part in self.planes)
        slopes = np.hstack([-normals, np.zeros((len(limits), more))])
        return [{"type": "ineq", "fun": lambda z: limits - normals @ z[:k], "jac": lambda z: slopes}]

    def _sphere(self, more: int) -> list[dict[str, Any]]:
        if (radius := self.radius) is None:
            return []
        k, rest = self.k, np.zeros(more)
        inside = {
            "type": "ineq",
            "fun": lambda z: radius**2 - z[:k] @ z[:k],
            "jac": lambda z: np.concatenate([-2.0 * z[:k], rest]),
        }
        return [inside]

    def nearest(self, point: Array) -> Array:
        """Draw a point into the region: into box and planes, then along the ray to the point nearest the centre."""
        inside = np.clip(point, self.low, self.high)
        if self.within and not self.contains(inside[None])[0]:
            nearest = _nearest_in(self.planes, inside)
            inside = self.middle if nearest is None else nearest
        if self.radius is None or np.linalg.norm(inside) <= self.radius:
            return np.asarray(inside)
        anchor = self.middle
        way = inside - anchor
        # |anchor + s·way| = radius: a quadratic in s with one root between 0 and 1
        a, b, c = float(way @ way), float(anchor @ way), float(anchor @ anchor) - self.radius**2
        return np.asarray(anchor + (-b + np.sqrt(b * b - a * c)) / a * way)

    def spread(self, log2_points: int) -> Array:
        """Fill the region evenly, the same way every time (Sobol' sequence)."""
        from scipy.stats.qmc import Sobol

        low, high = self.bounds()
        points = low + (high - low) * Sobol(self.k, scramble=False).random_base2(log2_points)
        inside = points[self.contains(points)]
        return np.asarray(inside if len(inside) else self._drawn_in(points))

    def _drawn_in(self, points: Array) -> Array:
        """Draw points in along the rays to the middle, as far as box and planes ask for it."""
        normals, limits = self.planes
        way = points - self.middle
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = (limits - normals @ self.middle) / (way @ normals.T)
        reach = np.where(way @ normals.T > _ROUNDING, np.maximum(reach, 0.0), 1.0)
        return np.asarray(self.middle + np.minimum(reach.min(axis=1), 1.0)[:, None] * way)

    def cloud(self, log2_points: int) -> Array:
        """Fill the region and its boundary: spread points, corners, axes, drawn in to the sphere."""
        from scipy.stats.qmc import Sobol

        low, high = self.bounds()
        nearest = self.middle
        axes = np.vstack([np.where(np.eye(self.k, dtype=bool), end, nearest) for end in (low, high)])
        corners = list(product(*zip(low, high, strict=True))) if 2**self.k <= _MOST_CORNERS else []
        filling = low + (high - low) * Sobol(self.k, scramble=False).random_base2(log2_points)
        points = np.vstack([nearest, axes, *corners, filling])
        if self.within:  # points inside, and those outside on the planes
            points = self._drawn_in(points)
        if self.radius is not None:
            length = np.linalg.norm(points, axis=1)
            points *= np.minimum(1.0, self.radius / np.maximum(length, 1e-300))[:, None]
        return np.asarray(points[self.contains(points)])


def _nearest_in(planes: tuple[Array, Array], point: Array) -> Array | None:
    """Return the point with Ax ≤ b nearest to another, None if there is none.

    Least distance programming: u ≥ 0 with least |Eu − f|, E = [−Aᵀ; −(b − Ap)ᵀ], f = (0, …, 0, 1), residual r, gives
    x = p − r₁…ₖ/rₖ₊₁. Source: C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23.
    """
    from scipy.optimize import nnls

    normals, limits = planes
    e = -np.vstack([normals.T, limits - normals @ point])
    f = np.append(np.zeros(len(point)), 1.0)
    u, size = nnls(e, f)
    if size <= _ROUNDING:
        return None
    r = e @ u - f
    return np.asarray(point - r[:-1] / r[-1])
