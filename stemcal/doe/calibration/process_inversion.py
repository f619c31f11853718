"""Where does a Gaussian process take the target, and what does that leave possible, where a quadratic predicts badly?

A point agrees with a measured mean F of variance v where |F − ŷ(x)| ≤ t·√(v + s²(x)), s the standard error of the
process there: its own uncertainty is part of the likelihood. The profile of factor j is the least value of
D(x) = (F − ŷ)²/(v + s²) over all others, taken over points that fill the region densely; every branch is among them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.calibration.infill import crossings, nearest_crossing
from stemcal.doe.calibration.prior import Prior
from stemcal.doe.calibration.profile import GRID, Profile
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.calibration.solution_rules import away_from
from stemcal.doe.regression.gaussian_process import GaussianProcess
from stemcal.doe.regression.least_squares import Array, t_quantile

_CLOUD = 13


@dataclass(frozen=True, eq=False)
class ProcessSolution:
    """The point where a process takes the target, and what the target leaves possible.

    `reachable` are the least and greatest response that the region may have, by the process and its 95 % errors.
    """

    coded: Array
    reachable: tuple[float, float]
    profiles: tuple[Profile, ...]


def reach_of(process: GaussianProcess, region: Region) -> tuple[float, float]:
    """Return the least and greatest response that a region may have: ŷ ∓ t·s, and never less than the runs show."""
    cloud = region.cloud(_CLOUD)
    low, high = process.mean_interval(cloud).T
    seen = process.response[region.contains(process.design, 1e-6)]
    return float(np.append(low, seen).min()), float(np.append(high, seen).max())


def solve_by_process(
    process: GaussianProcess,
    names: tuple[str, ...],
    target: float,
    variance: float,
    df: float,
    region: Region,
    priors: Sequence[Prior] = (),
) -> ProcessSolution:
    """Return the point nearest to the centre where the process takes the target, or comes nearest to it.

    With priors that is the point nearest to them (`solution_rules.most_probable`).

    Parameters
    ----------
    variance, df : float
        Of the measured mean; the fewer of these degrees of freedom and of the process's count.
    """
    taken, x = crossings(process, target, region), nearest_crossing(process, target, region)
    if priors and len(taken):
        x = taken[int(np.argmin(away_from(priors).many(taken)))]
    t = t_quantile(0.95, int(min(df, len(process.response) - 1)))
    points = np.vstack([x, taken, region.cloud(_CLOUD)])
    total = np.maximum(variance + process.standard_error(points) ** 2, (1e-9 * target) ** 2)
    misfit = (target - process.predict(points)) ** 2 / total + sum(prior.z(points) ** 2 for prior in priors)
    return ProcessSolution(
        coded=x,
        reachable=reach_of(process, region),
        profiles=tuple(_profile(points, misfit, j, name, t**2, region) for j, name in enumerate(names)),
    )


def _profile(points: Array, misfit: Array, j: int, name: str, allowed: float, region: Region) -> Profile:
    """Return the least rise of the misfit in each of `GRID` bins of factor j, and where it is allowed."""
    low, high = (float(end[j]) for end in region.bounds())
    least = float(misfit.min())
    edges = np.linspace(low, high, GRID + 1)
    bins = np.clip(np.searchsorted(edges, points[:, j], side="right") - 1, 0, GRID - 1)
    rise = np.full(GRID, np.inf)
    np.minimum.at(rise, bins, misfit - least)
    held = points[misfit - least <= allowed, j]
    bottom, top = float(held.min()), float(held.max())
    margin = 0.5 * (edges[1] - edges[0])
    bounded = bottom > low + margin, top < high - margin
    return Profile(
        name, 0.5 * (edges[1:] + edges[:-1]), rise, allowed, bottom, top, bounded, (top - bottom) / (high - low)
    )
