"""A joint fit that cannot separate its parameters: the point of the flat valley that lies nearest to the centre.

Near the point of least misfit D ≈ D_min + (x − x̂)ᵀA(x − x̂) with A = JᵀV⁻¹J, J = ∂ŷ/∂x. Along an eigenvector of A the
data fix x̂ to σ = 1/√λ, and its interval is 2·σ·√(allowed rise) long. Where that fills three quarters of the region or
more the direction is flat: x̂ lies at whichever end of it the scatter of the laboratory has put it. In place of x̂ the
point is taken that

1. is nearest to the centre among those that the data cannot tell from x̂ (D ≤ D_min + allowed rise), and
2. from there has the least misfit at the same place along the flat directions: the floor of the valley.

Where no scatter is known at all, a measured mean is taken to be good to 3 % for this question alone: with an exact mean
no direction would ever be flat.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from stemcal.doe.calibration.levelset import Objective, search_from, squared_distance
from stemcal.doe.calibration.misfit import Misfit, best_fit, scale_of
from stemcal.doe.calibration.profile import allowed_rise
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array

_MEAN_GOOD_TO, _MOST = 0.03, 0.75
_CLOUD = 9
_STARTS = 3
_KEPT = 1e-6


def flat_directions(misfit: Misfit, region: Region, x: Array) -> Array:
    """Return unit vectors (coded) along which the data leave x free over the region, (directions, factors)."""
    known = with_scatter(misfit, misfit.value(x))
    certainty, vectors = np.linalg.eigh(known.information(x))
    length = np.array([_chord(region, v) for v in vectors.T])
    by_priors = np.sum((known.told(x) @ vectors) ** 2, axis=0) / np.maximum(certainty, 1e-300)
    allowed = np.array([_allowed(known, known.value(x), min(part, 1.0)) for part in by_priors.tolist()])
    flat = np.maximum(certainty, 0.0) * (_MOST * length) ** 2 <= 4.0 * allowed
    return np.asarray(vectors.T[flat])


def _allowed(misfit: Misfit, least: float, by_priors: float) -> float:
    """Return the rise allowed along a direction of which priors, known exactly, tell such a part."""
    data = 1.0 - by_priors
    return allowed_rise(misfit, least, df=misfit.scale_df / data**2 if data > 0.0 else np.inf)


def nearest_on_floor(misfit: Misfit, region: Region, x: Array, flat: Array) -> Array:
    """Return the point of the valley's floor nearest to the centre; `x` has the least misfit, `flat` its directions."""
    known = with_scatter(misfit, misfit.value(x))
    most = known.value(x) + allowed_rise(known, known.value(x))
    cloud = region.cloud(_CLOUD)
    objective, distance = known.objective(scale_of(known, cloud)), squared_distance()
    held = cloud[known.many(cloud) <= most]
    starts = [x, *held[np.argsort(distance.many(held), kind="stable")[:_STARTS]]]
    nearest = min((least_under(distance, start, region, below(known, most)) for start in starts), key=distance.value)
    along = {"type": "eq", "fun": lambda z: flat @ (z - nearest), "jac": lambda z: flat}
    return least_under(objective, nearest, region, along)


def settled(misfit: Misfit, region: Region, within: Region | None = None) -> tuple[Array, Array]:
    """Return the point of least misfit in a region, or its place on the floor of a flat valley, and flat directions.

    The valley may be bent: its directions are those at the point that is returned, unless fewer are flat there.
    `within` is a part of the region that the point is sought in.
    """
    x = best_fit(misfit, within or region)
    flat = flat_directions(misfit, region, x)
    if not len(flat):
        return x, flat
    floor = nearest_on_floor(misfit, within or region, x, flat)
    there = flat_directions(misfit, region, floor)
    return floor, there if len(there) == len(flat) else flat


def presses_outwards(misfit: Misfit, region: Region, x: Array) -> bool:
    """Tell whether the data ask for a point beyond the region: a wider one lowers the misfit by more than chance.

    The surfaces are continued over half the region's width more to each side. `x` has the least misfit of the region.
    """
    known = with_scatter(misfit, misfit.value(x))
    low, high = region.bounds()
    more = 0.5 * (high - low)
    radius = None if region.radius is None else 2.0 * region.radius
    wider = best_fit(known, replace(region, low=low - more, high=high + more, radius=radius))
    return known.value(x) - known.value(wider) > allowed_rise(known, known.value(wider))


def with_scatter(misfit: Misfit, least: float) -> Misfit:
    """Return it with variances that mean something: those of the data, else of the misfit, else 3 % of each mean."""
    if misfit.scatter == "surface":
        variance = np.maximum(misfit.variance, (_MEAN_GOOD_TO * misfit.measured) ** 2)
        return replace(misfit, variance=variance, scale_df=np.inf)
    return misfit if misfit.scale_known else misfit.scaled(least)


def _chord(region: Region, direction: Array) -> float:
    """Return the length of the chord of a region through its point nearest to the centre."""
    rise = np.concatenate([direction, -direction])
    room = np.maximum(np.concatenate([region.high - region.middle, region.middle - region.low]), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        forward, backward = (np.where(sign * rise > 1e-12, room / (sign * rise), np.inf).min() for sign in (1.0, -1.0))
    longest = np.inf if region.radius is None else 2.0 * region.radius
    reach = float((forward if np.isfinite(forward) else 0.0) + (backward if np.isfinite(backward) else 0.0))
    return min(reach, longest)


def below(misfit: Misfit, most: float) -> dict[str, Any]:
    """Return D ≤ most as SLSQP takes it, of order one."""
    scale = max(most, 1e-300)
    return {
        "type": "ineq",
        "fun": lambda z: 1.0 - misfit.value(z) / scale,
        "jac": lambda z: -misfit.gradient(z) / scale,
    }


def least_under(objective: Objective, start: Array, region: Region, rule: dict[str, Any]) -> Array:
    """Return where SLSQP ends under a rule, from a point that keeps it; its start where that is outside or worse."""
    z = search_from(start, objective, region, rule, _KEPT)
    return start if z is None or objective.value(z) > objective.value(start) else z
