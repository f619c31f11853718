"""Where to simulate next, several runs at a time, where a quadratic does not follow the force: on a Gaussian process.

The first of a batch is the point nearest to the centre where the process takes the target. Each further one lies where
the process knows least on which side of the target the force is: the greatest s·exp(−½((ŷ − target)/s)²), the process
taking its own prediction at the points chosen before for runs (kriging believer).

Sources: P. Ranjan, D. Bingham and G. Michailidis, Technometrics 50 (2008), 527–541; D. Ginsbourger, R. Le Riche and
L. Carraro, in Computational Intelligence in Expensive Optimization Problems (2010), 131–162.
"""

import numpy as np

from stemcal.doe.calibration.levelset import neighbours_across
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.gaussian_process import GaussianProcess
from stemcal.doe.regression.least_squares import Array

_CLOUD, _HALVINGS = 12, 40
_FINEST = 1e-12  # of what is predicted: errors below are rounding
_APART = 0.05  # least coded distance between a point of a batch and any run


def nearest_crossing(process: GaussianProcess, target: float, region: Region) -> Array:
    """Return the point nearest to the centre where the process takes the target, or is nearest to it."""
    found = crossings(process, target, region)
    if len(found):
        return np.asarray(found[int(np.argmin(np.linalg.norm(found, axis=1)))])
    cloud = region.cloud(_CLOUD)
    return np.asarray(cloud[int(np.argmin(np.abs(process.predict(cloud) - target)))])


def crossings(process: GaussianProcess, target: float, region: Region) -> Array:
    """Return where the process takes the target, (m, k): on the ways from the middle, and between near neighbours.

    A branch that the ways from the middle miss lies between points of the cloud on either side of it.
    """
    cloud = region.cloud(_CLOUD)
    side = np.sign(process.predict(cloud) - target)
    beyond = cloud[side != side[0]]
    below, above = cloud[side <= 0.0], cloud[side > 0.0]
    if not len(below) or not len(above):
        return np.empty((0, region.k))
    starts, stops = neighbours_across(below, above)
    low = np.vstack([np.repeat(cloud[:1], len(beyond), axis=0), starts])
    high = np.vstack([beyond, stops])
    from_low = np.sign(process.predict(low) - target)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        same = (np.sign(process.predict(middle) - target) == from_low)[:, None]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray(high)


def next_batch(process: GaussianProcess, target: float, region: Region, count: int) -> list[Array]:
    """Return up to so many points to simulate together; none that is among the runs already."""
    cloud, known = region.cloud(_CLOUD), process
    chosen: list[Array] = []
    for _ in range(count):
        if not chosen and _gap(crossing := nearest_crossing(process, target, region)[None], known)[0] > 0.1 * _APART:
            x = crossing[0]
        elif len(cloud := cloud[_gap(cloud, known) > _APART]):
            x = _most_telling(known, target, cloud)
        else:
            break
        chosen.append(x)
        known = known.with_fantasy_point(x)
    return chosen


def _gap(points: Array, process: GaussianProcess) -> Array:
    """Return how far points are from the nearest run."""
    return np.asarray(np.linalg.norm(points[:, None] - process.design[None], axis=2).min(axis=1))


def _most_telling(process: GaussianProcess, target: float, cloud: Array) -> Array:
    predicted = process.predict(cloud)
    finest = _FINEST * max(abs(target), float(np.abs(predicted).max()))
    error = np.maximum(process.standard_error(cloud), finest)
    worth = np.log(error) - 0.5 * ((predicted - target) / error) ** 2
    return np.asarray(cloud[int(np.argmax(worth))])


def possible(process: GaussianProcess, target: float, region: Region, level: float = 0.95) -> Array:
    """Return the least and the greatest coded value of each factor where the target is within the interval, (k, 2)."""
    cloud = region.cloud(_CLOUD)
    low, high = process.mean_interval(cloud, level).T
    held = cloud[(low <= target) & (target <= high)]
    held = np.vstack([held, crossings(process, target, region), nearest_crossing(process, target, region)])
    return np.column_stack([held.min(axis=0), held.max(axis=0)])
