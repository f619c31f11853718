"""Does what was measured, with the other priors, contradict a prior?

Leaving a prior out lowers the least misfit by T = D_min − D_min(without it), within χ²(1) where they agree, or F(1, ν)
with variances that were estimated: as for a measured mean (`contradiction`).
"""

from dataclasses import dataclass

from stemcal.doe.calibration.misfit import Misfit, best_fit
from stemcal.doe.calibration.prior import Prior
from stemcal.doe.calibration.profile import chance_of_rise, profiles_of
from stemcal.doe.calibration.ridge import with_scatter
from stemcal.doe.calibration.search_region import Region

LEVEL = 0.05


@dataclass(frozen=True)
class Agreement:
    """The probability of a prior so far from the rest, None if untested; where below `LEVEL`, what the rest allows."""

    prior: Prior
    p: float | None
    allowed: tuple[float, float] | None


def agreements(misfit: Misfit, region: Region) -> list[Agreement]:
    """Return for each prior of a misfit whether the rest agrees with it."""
    return [_agreement(misfit, region, prior) for prior in misfit.priors]


def _agreement(misfit: Misfit, region: Region, prior: Prior) -> Agreement:
    whole = with_scatter(misfit, misfit.value(best_fit(misfit, region)))
    rest = whole.without_prior(prior)
    best = best_fit(rest, region)
    rise = max(whole.value(best_fit(whole, region)) - rest.value(best), 0.0)
    p = chance_of_rise(rise, whole.scale_df)
    if p >= LEVEL:
        return Agreement(prior, p, None)
    profile = profiles_of(rest, region, best)[prior.j]
    return Agreement(prior, p, (profile.low, profile.high))
