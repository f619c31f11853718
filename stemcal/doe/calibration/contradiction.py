"""Do measured values agree with each other, where a fit has no degree of freedom left to tell?

As many values as factors are met exactly unless the region forbids it, so their misfit has no distribution to test. But
each value may be held against what the others allow: leaving out value i lowers the least misfit by
T = D_min − D_min(without i), which for values that agree is within χ²(1), or F(1, ν) with estimated variances; √T is
how many standard errors apart they are. A value that its own surface takes nowhere in the region is out of reach; it
contradicts the others where the nearest value within reach does.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stemcal.doe.calibration.levelset import extremes, height
from stemcal.doe.calibration.misfit import Misfit, best_fit
from stemcal.doe.calibration.profile import allowed_rise, chance_of_rise
from stemcal.doe.calibration.ridge import below, least_under
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array

LEVEL = 0.05


@dataclass(frozen=True)
class Contradiction:
    """Observation `index` lies so many standard errors from what the others allow it, which has probability p."""

    index: int
    standard_errors: float
    p: float
    allowed: tuple[float, float]


def contradiction(misfit: Misfit, region: Region) -> Contradiction | None:
    """Return the observation that the others contradict most, at `LEVEL`.

    None where degrees of freedom are left (the misfit test tells), or where no scatter is known.
    """
    m = len(misfit.observations)
    if m < 2 or misfit.df > 0 or misfit.scatter not in ("measured", "pooled"):
        return None
    misfit = _within_reach(misfit, region)
    least = misfit.value(best_fit(misfit, region))
    rest = [misfit.without(i) for i in range(m)]
    best = [best_fit(others, region) for others in rest]
    excess = [max(least - others.value(point), 0.0) for others, point in zip(rest, best, strict=True)]
    i = max(range(m), key=lambda j: (round(excess[j], 6), j))
    p = chance_of_rise(excess[i], misfit.scale_df)
    if p >= LEVEL:
        return None
    return Contradiction(i, float(excess[i] ** 0.5), p, _allowed(misfit, rest[i], i, region, best[i]))


def allowed_by_others(misfit: Misfit, region: Region, groups: Sequence[object]) -> list[tuple[float, float]]:
    """Return for each observation between which values the others predict its measured mean, in 95 % of studies.

    What they leave to ŷᵢ and the variance of the mean about ŷᵢ add up as squares: ŷᵢ ± t √(var ŷᵢ + vᵢ).

    Parameters
    ----------
    groups : sequence
        A label per observation, two different ones at least: those of its own group do not count either.
    """
    found: dict[int, tuple[float, float]] = {}
    for group in dict.fromkeys(groups):
        members = [i for i, label in enumerate(groups) if label == group]
        others = misfit.without(*members)
        best = best_fit(others, region)
        rise = allowed_rise(misfit, others.value(best))
        for i in members:
            middle, own = float(misfit.observations[i].surface.predict(best)[0]), rise * misfit.whole_variance[i]
            low, high = _allowed(misfit, others, i, region, best)
            found[i] = (
                middle - float(np.hypot(middle - low, own**0.5)),
                middle + float(np.hypot(high - middle, own**0.5)),
            )
    return [found[i] for i in range(len(groups))]


def out_of_reach(misfit: Misfit, region: Region) -> list[int]:
    """Return which observations their own surface misses everywhere in the region, by more than their scatter."""
    known = misfit.scatter in ("measured", "pooled")
    most = allowed_rise(misfit, 0.0) * misfit.whole_variance if known else (1e-9 * misfit.measured) ** 2
    return np.flatnonzero((misfit.measured - _reached(misfit, region)) ** 2 > most).tolist()


def _reached(misfit: Misfit, region: Region) -> Array:
    """Return the value nearest to each measured one that its own surface takes in the region."""
    ends = [[float(o.surface.predict(end)[0]) for end in extremes(o.surface, region)] for o in misfit.observations]
    return np.asarray(np.clip(misfit.measured, *np.array(ends).T))


def _within_reach(misfit: Misfit, region: Region) -> Misfit:
    observations = zip(misfit.observations, _reached(misfit, region).tolist(), strict=True)
    return replace(misfit, observations=tuple(replace(o, measured=value) for o, value in observations))


def _allowed(misfit: Misfit, others: Misfit, i: int, region: Region, best: Array) -> tuple[float, float]:
    """Return the least and greatest ŷᵢ over the points that the other observations allow."""
    surface, least = misfit.observations[i].surface, others.value(best)
    rule = below(others, least + allowed_rise(misfit, least))
    cloud = region.cloud(9)
    held = np.vstack([best, cloud[others.many(cloud) <= least + allowed_rise(misfit, least)]])
    ends = []
    for sign in (1.0, -1.0):
        objective = height(surface, sign)
        start = held[int(np.argmin(objective.many(held)))]
        ends.append(float(surface.predict(least_under(objective, start, region, rule))[0]))
    return ends[0], ends[1]
