"""Where to simulate next when several responses are to be met together.

As for one response (see `approach`), the surfaces are moved to pass through what was simulated at the best point so
far; the next point has the least misfit of the moved surfaces within a box about it, whose half-width shrinks when
a step has not helped. That is a trust-region method with first-order corrected models: N. M. Alexandrov and others,
Structural Optimization 15 (1998) 16–23.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stemcal.doe.calibration.misfit import Misfit, best_fit
from stemcal.doe.calibration.region import Region
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface

FIRST_REACH, SHRINK = 1.0, 0.5


@dataclass(frozen=True, eq=False)
class JointTrial:
    """A point that was simulated, coded, and every response there in the order of the observations."""

    coded: Array
    responses: Array


def missed(misfit: Misfit, trial: JointTrial) -> float:
    """Return the misfit of what was simulated: Σ (measured − simulated)²/variance."""
    return float(np.sum((misfit.measured - trial.responses) ** 2 / misfit.variance))


def through(misfit: Misfit, surfaces: Sequence[Surface], trial: JointTrial) -> Misfit:
    """Take these surfaces, each moved up or down to pass through a trial; the weights stay."""
    moved = []
    for surface, observation, response in zip(surfaces, misfit.observations, trial.responses, strict=True):
        beta = surface.beta.copy()
        beta[0] += response - float(surface.predict(trial.coded)[0])
        moved.append(replace(observation, surface=replace(surface, beta=beta)))
    return replace(misfit, observations=tuple(moved))


def next_joint_point(misfit: Misfit, region: Region, start: Array, reach: float) -> Array:
    """Return the point of least misfit within `reach` of `start`, factor by factor, and inside the region."""
    near = Region(np.maximum(region.low, start - reach), np.minimum(region.high, start + reach), region.radius)
    return near.nearest(best_fit(misfit, near))
