"""The region a solution may come from: a coded box, cut by a sphere about the centre if there is one."""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

_ROUNDING = 1e-9
# Corners of a box double with each factor; beyond this many they add nothing to the spread points.
_MOST_CORNERS = 256


@dataclass(frozen=True, eq=False)
class Region:
    """All x with low ≤ x ≤ high, and ‖x‖ ≤ radius if one is given. It is convex."""

    low: Array
    high: Array
    radius: float | None

    def __post_init__(self) -> None:
        if self.low.shape != self.high.shape or np.any(self.low >= self.high):
            raise UsageError("invert: the lower end of a factor's range is not below its upper end")
        if self.radius is not None and not np.linalg.norm(np.clip(0.0, self.low, self.high)) < self.radius:
            raise UsageError("invert: the factor ranges and the design sphere have no common point")

    @property
    def k(self) -> int:
        """Number of factors."""
        return int(self.low.size)

    @property
    def middle(self) -> Array:
        """The point of the region nearest to the centre."""
        return np.asarray(np.clip(0.0, self.low, self.high))

    def contains(self, points: Array, tolerance: float = _ROUNDING) -> NDArray[np.bool_]:
        """Tell for each of (m, k) points whether it lies inside."""
        inside = np.all((points >= self.low - tolerance) & (points <= self.high + tolerance), axis=1)
        if self.radius is not None:
            inside &= np.linalg.norm(points, axis=1) <= self.radius + tolerance
        return np.asarray(inside)

    def bounds(self) -> tuple[Array, Array]:
        """Return the smallest box around the region's reach along each axis."""
        reach = np.inf if self.radius is None else self.radius
        return np.maximum(self.low, -reach), np.minimum(self.high, reach)

    def rules(self, more: int = 0) -> list[dict[str, Any]]:
        """Return |x| ≤ radius, if there is one, as SLSQP takes it; x precedes further variables."""
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
        """Draw a point into the region: into the box, then along the ray to the point nearest the centre."""
        inside = np.clip(point, self.low, self.high)
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
        return np.asarray(inside if len(inside) else points)

    def cloud(self, log2_points: int) -> Array:
        """Fill the region and its boundary: spread points, corners, axes, drawn in to the sphere."""
        from scipy.stats.qmc import Sobol

        low, high = self.bounds()
        nearest = self.middle
        axes = np.vstack([np.where(np.eye(self.k, dtype=bool), end, nearest) for end in (low, high)])
        corners = list(product(*zip(low, high, strict=True))) if 2**self.k <= _MOST_CORNERS else []
        filling = low + (high - low) * Sobol(self.k, scramble=False).random_base2(log2_points)
        points = np.vstack([nearest, axes, *corners, filling])
        if self.radius is not None:
            length = np.linalg.norm(points, axis=1)
            points *= np.minimum(1.0, self.radius / np.maximum(length, 1e-300))[:, None]
        return np.asarray(points[self.contains(points)])
