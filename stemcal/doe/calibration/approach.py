"""Where to simulate next, when a surface alone does not hit the target: learn from the points simulated so far.

A surface fitted over a whole design is off by a little everywhere. Near the best point simulated so far its
shape is good and its height is known to be wrong by f − ŷ, so the next point is sought on the surface moved by
that much. This is Newton's method with the slope of the surface (Broyden 1965 calls such steps quasi-Newton).
Steps stay within a radius that shrinks when a step has not helped; once the target is bracketed by two simulated
points, the straight line between them takes over, which cannot leave the bracket (regula falsi).

Where several responses are to be met together, their surfaces are moved to pass through what was simulated at the best
point so far; the next point has the least misfit of the moved surfaces within a box about it, whose half-width shrinks
when a step has not helped. That is a trust-region method with first-order corrected models: N. M. Alexandrov and
others, Structural Optimization 15 (1998) 16–23.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stemcal.doe.calibration.fit import Fit
from stemcal.doe.calibration.intervals import settled
from stemcal.doe.calibration.region import Region
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface

How = Literal["surface", "bracket"]
FIRST_RADIUS, SHRINK = 1.0, 0.5
_NEWTON_STEPS = 60
# A step is good if it leaves less than this part of the error.
_PROGRESS = 0.5


@dataclass(frozen=True, eq=False)
class Trial:
    """A point that was simulated, in coded units, and the response there."""

    coded: Array
    response: float


@dataclass(frozen=True, eq=False)
class ApproachStep:
    """The next point, how it was found, and the radius it was sought within."""

    coded: Array
    how: How
    radius: float


def best_of(trials: Sequence[Trial], target: float) -> Trial:
    """Return the trial nearest to the target, the earliest of equals."""
    return min(trials, key=lambda trial: abs(trial.response - target))


def next_step(surface: Surface, target: float, region: Region, trials: Sequence[Trial], radius: float) -> ApproachStep:
    """Return where to simulate next.

    Parameters
    ----------
    surface : Surface
        Fitted to all points, the trials included.
    trials : sequence of Trial
        In the order they were simulated; one at least.
    radius : float
        How far the last step was allowed to go, in coded units.
    """
    best = best_of(trials, target)
    helped = len(trials) < 2 or _helped(trials, target)
    radius = radius if helped else SHRINK * radius
    other = _across(trials, best, target)
    if other is not None and not helped:
        return ApproachStep(_between(best, other, target), "bracket", radius)
    shifted = target - (best.response - float(surface.predict(best.coded)[0]))
    return ApproachStep(toward(surface, shifted, region, best.coded, radius), "surface", radius)


def toward(surface: Surface, level: float, region: Region, start: Array, radius: float) -> Array:
    """Go from `start` to the nearest point with ŷ = level, as far as the radius and the region allow.

    Newton steps along the gradient, x ← x + (level − ŷ)·∇ŷ/|∇ŷ|², drawn back into the region after each.
    """
    x = start.copy()
    for _ in range(_NEWTON_STEPS):
        gap, slope = level - float(surface.predict(x)[0]), surface.gradient(x)
        size = float(slope @ slope)
        if size == 0.0 or abs(gap) <= 1e-10 * max(abs(level), 1.0):
            break
        step = x + gap / size * slope - start
        length = float(np.linalg.norm(step))
        x = region.nearest(start + step * min(1.0, radius / length) if length > 0.0 else start)
    return x


def _helped(trials: Sequence[Trial], target: float) -> bool:
    """Whether the last trial left less than half of the error of the best before it."""
    before = abs(best_of(trials[:-1], target).response - target)
    return abs(trials[-1].response - target) <= _PROGRESS * before


def _across(trials: Sequence[Trial], best: Trial, target: float) -> Trial | None:
    """Return the trial nearest to `best` among those on the other side of the target."""
    side = np.sign(best.response - target)
    others = [trial for trial in trials if np.sign(trial.response - target) == -side]
    return min(others, key=lambda trial: float(np.linalg.norm(trial.coded - best.coded)), default=None)


def _between(best: Trial, other: Trial, target: float) -> Array:
    """Interpolate between two trials to the target, staying off the very ends."""
    share = (target - best.response) / (other.response - best.response)
    return np.asarray(best.coded + np.clip(share, 0.1, 0.9) * (other.coded - best.coded))


# ---- several responses together


@dataclass(frozen=True, eq=False)
class JointTrial:
    """A point that was simulated, coded, and every response there in the order of the observations."""

    coded: Array
    responses: Array


def missed(fit: Fit, trial: JointTrial) -> float:
    """Return the misfit of what was simulated: rᵀWr, r = measured − simulated."""
    gap = fit.measured - trial.responses
    m = len(gap)
    return float(gap @ fit.precision[:m, :m] @ gap)


def through(fit: Fit, surfaces: Sequence[Surface], trial: JointTrial) -> Fit:
    """Take these surfaces, each moved up or down to pass through a trial; the weights stay."""
    moved = []
    for surface, observation, response in zip(surfaces, fit.observations, trial.responses, strict=True):
        beta = surface.beta.copy()
        beta[0] += response - float(surface.predict(trial.coded)[0])
        moved.append(replace(observation, surface=replace(surface, beta=beta)))
    return replace(fit, observations=tuple(moved))


def next_joint_point(fit: Fit, start: Array, reach: float) -> Array:
    """Return the point that fits best within `reach` of `start`, factor by factor, and inside the region."""
    region = fit.region
    near = replace(region, low=np.maximum(region.low, start - reach), high=np.minimum(region.high, start + reach))
    return near.nearest(settled(fit, near)[0].best)
