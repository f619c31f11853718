"""Rules that pick one point from all those where the surface takes the target value."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from stemcal.doe.calibration.levelset import Objective, squared_distance
from stemcal.doe.calibration.prior import Prior
from stemcal.doe.calibration.solution_set import SolutionSet
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.terms import term_columns, term_gradient
from stemcal.errors import UsageError


def least_coded_distance(solutions: SolutionSet) -> list[Array]:
    """Stay as near the centre of the design as the target allows."""
    return solutions.best(squared_distance())


def most_probable(solutions: SolutionSet) -> list[Array]:
    """Stay as near to what priors say as the target allows, along factors without one near the centre."""
    return solutions.best(away_from(solutions.priors))


def away_from(priors: Sequence[Prior]) -> Objective:
    """Make Σ z² of the priors small, with x² of the factors that have none."""

    def many(points: Array) -> Array:
        rest = np.delete(points, [prior.j for prior in priors], axis=1)
        return np.asarray(np.sum(rest**2, axis=1) + sum(prior.z(points) ** 2 for prior in priors))

    def gradient(x: Array) -> Array:
        found = 2.0 * x
        for prior in priors:
            found[prior.j] = 2.0 * float(prior.z(x[None])[0] * prior.slope(x[None])[0])
        return np.asarray(found)

    return Objective(lambda x: float(many(x[None])[0]), gradient, many)


def least_prediction_variance(solutions: SolutionSet) -> list[Array]:
    """Go where the surface is known best: make φᵀ(XᵀX)⁻¹φ small; its gradient is 2·φᵀ(XᵀX)⁻¹·∂φ/∂x."""
    surface = solutions.surface
    covariance = surface.unscaled_covariance
    objective = Objective(
        lambda x: float(surface.unscaled_variance(x)[0]),
        lambda x: np.asarray(2.0 * (term_columns(x)[0] @ covariance) @ term_gradient(x)),
        surface.unscaled_variance,
    )
    return solutions.best(objective)


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
    "least_prediction_variance": least_prediction_variance,
    "most_probable": most_probable,
}
