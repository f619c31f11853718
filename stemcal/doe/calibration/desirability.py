"""Several responses by one number: the desirability of G. Derringer and R. Suich, J. Quality Technology 12 (1980) 214.

    dᵢ = (ŷᵢ − Lᵢ)/(Tᵢ − Lᵢ) from the low end to the target, (Uᵢ − ŷᵢ)/(Uᵢ − Tᵢ) from there to the high one, 0 outside
    D  = (d₁·d₂·…·dₘ)^(1/m)

The ends are the smallest and largest value of the design's runs, as Design-Expert takes them. Nothing in D knows how
well a response is measured: it is the field's usual form, and stands beside the fit that does.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.gaussian_process import GaussianProcess
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface

_CLOUD, _STARTS = 12, 6
_LEAST = 1e-9  # in place of a desirability of 0, which has no logarithm
_AS_GOOD = 1e-6


@dataclass(frozen=True, eq=False)
class Aim:
    """A response with its target, and the values from which it is not wanted at all."""

    surface: Surface | GaussianProcess
    low: float
    target: float
    high: float

    def sides(self, y: Array) -> tuple[Array, Array]:
        """Return how desirable a value is as far as the low end goes, and the high one: d is the smaller of both."""
        rise, fall = max(self.target - self.low, _LEAST), max(self.high - self.target, _LEAST)
        return np.asarray((y - self.low) / rise), np.asarray((self.high - y) / fall)

    def of(self, points: Array) -> Array:
        """Return d at (m, k) points."""
        return np.asarray(np.clip(np.minimum(*self.sides(self.surface.predict(points))), 0.0, 1.0))

    def slopes(self, x: Array) -> tuple[Array, Array]:
        """Return the gradients of both sides at a point."""
        slope = self.surface.gradient(x)
        return slope / max(self.target - self.low, _LEAST), -slope / max(self.high - self.target, _LEAST)


@dataclass(frozen=True, eq=False)
class Desirable:
    """The most desirable point of a region (coded), D there, and each response with its own d."""

    coded: Array
    overall: float
    each: tuple[float, ...]
    predicted: tuple[float, ...]


def most_desirable(aims: Sequence[Aim], region: Region) -> Desirable:
    """Return the point of the region where D is greatest; of those as good the one nearest to the centre."""
    cloud = region.cloud(_CLOUD)
    starts = cloud[np.argsort(_cost(aims, cloud), kind="stable")[:_STARTS]]
    found = np.vstack([starts, *(_raised(aims, region, start) for start in starts)])
    found = found[region.contains(found, 1e-7)]
    cost = _cost(aims, found)
    best = found[cost <= cost.min() + _AS_GOOD]
    point = _drawn_in(aims, region, best[np.argmin(np.sum(best**2, axis=1))])
    each = tuple(float(aim.of(point[None, :])[0]) for aim in aims)
    predicted = tuple(float(aim.surface.predict(point)[0]) for aim in aims)
    return Desirable(point, float(np.prod(each) ** (1.0 / len(aims))), each, predicted)


def _cost(aims: Sequence[Aim], points: Array) -> Array:
    """Return −ln D."""
    return np.asarray(-np.mean([np.log(np.maximum(aim.of(points), _LEAST)) for aim in aims], axis=0))


def _raised(aims: Sequence[Aim], region: Region, start: Array) -> Array:
    """Make D greater from a point on: −Σ ln dᵢ over x and d, each dᵢ below both of its sides, which are smooth."""
    k = region.k
    desired = np.maximum([float(aim.of(start[None, :])[0]) for aim in aims], 1e-3)

    def room(z: Array) -> Array:
        return _sides(aims, z[:k]) - np.repeat(z[k:], 2)

    def slopes(z: Array) -> Array:
        return np.hstack([_slopes(aims, z[:k]), -np.repeat(np.eye(len(aims)), 2, axis=0)])

    return _searched(
        lambda z: -float(np.sum(np.log(z[k:]))),
        lambda z: np.concatenate([np.zeros(k), -1.0 / z[k:]]),
        np.concatenate([start, desired]),
        {"type": "ineq", "fun": room, "jac": slopes},
        region,
    )


def _drawn_in(aims: Sequence[Aim], region: Region, point: Array) -> Array:
    """Draw a point towards the centre as far as no response loses by it: many points may be as desirable."""
    held = np.repeat([float(aim.of(point[None, :])[0]) for aim in aims], 2) * (1.0 - _AS_GOOD)
    if held.min() <= 0.0:
        return point
    keep = {"type": "ineq", "fun": lambda x: _sides(aims, x) - held, "jac": lambda x: _slopes(aims, x)}
    nearer = _searched(lambda x: float(x @ x), lambda x: 2.0 * x, point, keep, region)
    kept = region.contains(nearer[None, :], 1e-7)[0] and np.all(_sides(aims, nearer) >= held - _AS_GOOD)
    return nearer if kept and nearer @ nearer < point @ point else point


def _sides(aims: Sequence[Aim], x: Array) -> Array:
    """Return both sides of every response at a point."""
    return np.concatenate([np.concatenate(aim.sides(aim.surface.predict(x[None, :]))) for aim in aims])


def _slopes(aims: Sequence[Aim], x: Array) -> Array:
    return np.vstack([np.array(aim.slopes(x)) for aim in aims])


def _searched(
    value: Callable[[Array], float],
    gradient: Callable[[Array], Array],
    start: Array,
    rule: dict[str, Any],
    region: Region,
) -> Array:
    """Return the x at which SLSQP ends, whose first k variables are the coded factors; its start if it gets lost."""
    from scipy.optimize import minimize

    k, more, (low, high) = region.k, len(start) - region.k, region.bounds()
    rules = [rule, *region.rules(more)]
    bounds = [*zip(low, high, strict=True), *[(_LEAST, 1.0)] * more]
    options = {"maxiter": 300, "ftol": 1e-12}
    result = minimize(value, start, jac=gradient, method="SLSQP", bounds=bounds, constraints=rules, options=options)
    point = np.asarray(result.x[:k], dtype=float)
    return np.clip(point, low, high) if np.all(np.isfinite(point)) else start[:k]
