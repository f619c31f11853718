"""Profile likelihood: how far each factor can go while the others make up for it.

The profile of factor j is D(v) = min over the other factors of the misfit with xⱼ = v. Its confidence interval
holds all v whose D rises above the least by no more than

    χ²(1, level)                          where the variances are known
    F(1, df; level)                       where they were estimated, with df degrees of freedom: few specimens
    Dmin·F(1, m − k; level)/(m − k)       where their common factor is told by the misfit of m observations

each times the share by which the factor's variance, of each diameter's own scatter, differs from what D takes it for
(`Misfit.freedom`). A rise counts by the variances where it is (`Misfit.looseness`). An end that reaches the edge of the
region is an end of the region, not of what the data allow. See Venzon and Moolgavkar, Applied Statistics 37 (1988)
87–94; Raue et al., Bioinformatics 25 (2009) 1923–1929.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stemcal.doe.calibration.levelset import Objective, optimise
from stemcal.doe.calibration.misfit import Misfit, best_fit, scale_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array

GRID = 25
FREE = 0.5
"""Share of its range from which a factor counts as free: data that only halve a range tell little more than it."""
_CLOUD, _SEEDS = 9, 3
_SMALL_PART = 0.05
_SLACK = 1e-6  # coded: at its ends a region is a point, which rounding must not lose


@dataclass(frozen=True, eq=False)
class Profile:
    """One factor's profile: `rise` of the misfit over its least, on a grid of coded `values`.

    `low` and `high` end the interval; `bounded` tells for each end whether the data set it (else the region).
    """

    factor: str
    values: Array
    rise: Array
    allowed: float
    low: float
    high: float
    bounded: tuple[bool, bool]
    share: float

    @property
    def free(self) -> bool:
        """Whether the data leave the factor free over most of the region."""
        return self.share >= FREE


def profiles_of(misfit: Misfit, region: Region, best: Array, level: float = 0.95) -> list[Profile]:
    """Return the profile of every factor; `best` is the point of least misfit."""
    names = misfit.observations[0].surface.names
    search = _Search(misfit, region, best)
    allowed = allowed_rises(misfit, best, level)
    return [_profile(search, j, name, allowed[j]) for j, name in enumerate(names)]


def allowed_rises(misfit: Misfit, best: Array, level: float = 0.95) -> list[float]:
    """Return for each factor how much the misfit may rise above its least within the confidence interval."""
    least = misfit.value(best)
    share, freedom = (part.tolist() for part in misfit.freedom(best))
    return [s * allowed_rise(misfit, least, level, df) for s, df in zip(share, freedom, strict=True)]


def allowed_rise(misfit: Misfit, least: float, level: float = 0.95, df: float | None = None) -> float:
    """Return how much the misfit may rise above its least within the confidence interval of one factor.

    `df` are the degrees of freedom behind that factor's interval, by default those of the whole misfit.
    """
    from scipy.special import chdtri, fdtri

    freedom = misfit.scale_df if df is None else df
    if not misfit.scale_known:
        return float(least * fdtri(1.0, misfit.df, level) / misfit.df)
    if np.isfinite(freedom):
        return float(fdtri(1.0, freedom, level))
    return float(chdtri(1.0, 1.0 - level))


def chance_of_rise(rise: float, df: float) -> float:
    """Return the probability of a rise as large with one degree of freedom: χ²(1), or F(1, df)."""
    from scipy.special import chdtrc, fdtrc

    return float(fdtrc(1.0, df, rise) if np.isfinite(df) else chdtrc(1.0, rise))


def holds(misfit: Misfit, region: Region, point: Array, level: float = 0.95) -> list[bool]:
    """Tell for each factor whether its confidence interval holds the value at a point."""
    search = _Search(misfit, region, best_fit(misfit, region))
    allowed = allowed_rises(misfit, search.best, level)
    return [search.rise(j, float(value), search.best)[0] <= allowed[j] for j, value in enumerate(point)]


def _profile(search: _Search, j: int, name: str, allowed: float) -> Profile:
    low, high = (float(end[j]) for end in search.region.bounds())
    values = np.unique(np.append(np.linspace(low, high, GRID), search.best[j]))
    middle = int(np.searchsorted(values, search.best[j]))
    rise = np.zeros(len(values))
    for walk in (range(middle - 1, -1, -1), range(middle + 1, len(values))):
        last = search.best
        for i in walk:
            rise[i], last = search.rise(j, float(values[i]), last)
    inside = np.flatnonzero(rise <= allowed)
    first, final = int(inside[0]), int(inside[-1])
    bottom = low if first == 0 else search.crossing(j, values[first], values[first - 1], allowed)
    top = high if final == len(values) - 1 else search.crossing(j, values[final], values[final + 1], allowed)
    share = (top - bottom) / (high - low)
    return Profile(name, values, rise, allowed, bottom, top, (first > 0, final < len(values) - 1), share)


class _Search:
    """The misfit with one factor held."""

    def __init__(self, misfit: Misfit, region: Region, best: Array) -> None:
        self.misfit, self.region, self.best = misfit, region, best
        self.least, self.of_data = misfit.value(best), float(misfit.of_data(best[None])[0])
        self.cloud = region.cloud(_CLOUD)
        self.scale = scale_of(misfit, self.cloud)

    def rise(self, j: int, value: float, start: Array) -> tuple[float, Array]:
        """Return the least rise with xⱼ = value and the point of it; `start` is the point of a neighbour."""
        if self.region.k == 1:
            point = np.array([value])
            return self._risen(point), point
        slice_ = _slice(self.region, j, value)
        seeds = np.array([slice_.nearest(np.delete(x, j)) for x in [start, *self._nearby(j, value)]])
        found = optimise(_held(self.misfit.objective(self.scale), j, value), seeds, slice_)[0]
        point = np.insert(found, j, value)
        return self._risen(point), point

    def _risen(self, point: Array) -> float:
        """Return the rise, that of the observations over how much looser they are at the point."""
        of_data = float(self.misfit.of_data(point[None])[0])
        of_priors = sum(float(prior.z(point[None])[0] ** 2) for prior in self.misfit.priors)
        by_priors = of_priors - (self.least - self.of_data)
        return max((of_data - self.of_data) / self.misfit.looseness(point) + by_priors, 0.0)

    def crossing(self, j: int, inside: float, outside: float, allowed: float) -> float:
        """Return where the rise passes what is allowed, between a value inside and one outside."""
        from scipy.optimize import brentq

        return float(brentq(lambda v: self.rise(j, v, self.best)[0] - allowed, inside, outside, xtol=1e-6))

    def _nearby(self, j: int, value: float) -> Array:
        """Return the points of the cloud that, moved to xⱼ = value, fit best."""
        moved = self.cloud.copy()
        moved[:, j] = value
        moved = moved[self.region.contains(moved)]
        return moved[np.argsort(self.misfit.many(moved), kind="stable")[:_SEEDS]]


def _slice(region: Region, j: int, value: float) -> Region:
    """Return the region of the other factors where xⱼ = value."""
    radius = None
    if region.radius is not None:
        radius = float(np.sqrt(max(region.radius**2 - value**2, 0.0))) + _SLACK
    return Region(np.delete(region.low, j), np.delete(region.high, j), radius)


def _held(objective: Objective, j: int, value: float) -> Objective:
    """Return an objective of the other factors."""
    return Objective(
        lambda x: objective.value(np.insert(x, j, value)),
        lambda x: np.delete(objective.gradient(np.insert(x, j, value)), j),
        lambda points: objective.many(np.insert(points, j, value, axis=1)),
    )


def unseen_directions(misfit: Misfit, x: Array) -> Array:
    """Return unit vectors (coded) along which no response changes at x, to first order; (directions, factors).

    They span the null space of the weighted Jacobian ∂ŷ/∂x, priors among its rows.
    """
    _, sizes, rows = np.linalg.svd(misfit.in_errors(x))
    rank = int(np.sum(sizes > 1e-8 * sizes.max(initial=0.0)))
    return np.asarray(rows[rank:])


def loosest_direction(misfit: Misfit, x: Array) -> Array:
    """Return the unit vector (coded) along which the responses change least at x, for their errors; (factors,)."""
    return np.asarray(np.linalg.svd(misfit.in_errors(x))[2][-1])


def moved_together(direction: Array) -> list[float]:
    """Scale a direction so that its largest part is 1, parts below a twentieth left out.

    >>> moved_together(np.array([-0.2, 0.4, 0.01]))
    [-0.5, 1.0, 0.0]
    """
    scaled = direction / direction[int(np.argmax(np.abs(direction)))]
    return [float(part) if abs(part) >= _SMALL_PART else 0.0 for part in scaled]
