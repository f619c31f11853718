"""Rules that pick one point from all those where the surface takes the target value."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from stemcal.doe.calibration.levelset import squared_distance
from stemcal.doe.calibration.solution_set import SolutionSet
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError


def least_coded_distance(solutions: SolutionSet) -> list[Array]:
    """Stay as near the centre of the design as the target allows."""
    return solutions.best(squared_distance())


def others_at_centre(solutions: SolutionSet) -> list[Array]:
    """Hold every factor but the leading one at 0 and solve the quadratic that is left.

    The result stays in the box and keeps the constraints, but may leave the sphere.
    """
    surface, region, j = solutions.surface, solutions.region, solutions.surface.leading
    line = np.zeros((3, region.k))
    line[:, j] = (-1.0, 0.0, 1.0)
    minus, middle, plus = surface.predict(line)
    # ŷ − target = q₂x² + q₁x + q₀ along the leading factor
    roots = _real_roots(0.5 * (minus + plus) - middle, 0.5 * (plus - minus), middle - solutions.target)
    inside = sorted((r for r in roots if region.low[j] <= r <= region.high[j]), key=lambda r: (abs(r), -r))
    points = [np.where(np.arange(region.k) == j, r, 0.0) for r in inside]
    points = [x for x in points if replace(region, radius=None).contains(x[None])[0]]
    if not points:
        raise UsageError(
            f"invert.rule others_at_centre: with the other factors at their centres no {surface.names[j]} "
            f"within its range gives the target {solutions.target:g}; choose least_coded_distance"
        )
    return points


def _real_roots(q2: float, q1: float, q0: float) -> list[float]:
    size = max(abs(q2), abs(q1))
    if size == 0.0:
        return []
    if abs(q2) <= 1e-12 * size:
        return [-q0 / q1]
    square = q1**2 - 4.0 * q2 * q0
    if square < 0.0:
        return []
    # w has the sign that avoids cancellation; the roots are w/q₂ and q₀/w
    w = -0.5 * (q1 + float(np.copysign(np.sqrt(square), q1)))
    return [w / q2, q0 / w] if w else [0.0]


RULES: dict[str, Callable[[SolutionSet], list[Array]]] = {
    "least_coded_distance": least_coded_distance,
    "others_at_centre": others_at_centre,
}
