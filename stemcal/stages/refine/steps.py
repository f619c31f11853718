"""Steps of the refinement in the study's own model: search on the response surface, refitted to every new point.

A surface fitted over a whole design has a small error everywhere. At the best simulated point that error is known, so
the next point is sought on the surface shifted by it: Newton's method with the slope of the surface (a quasi-Newton
step, Broyden 1965). Steps stay within a radius that shrinks after a step without progress. Once two points bracket the
target, the next point is interpolated linearly between them (regula falsi), which cannot leave the bracket.

For several responses the surfaces are shifted to pass through the responses of the best point. The next point has the
least misfit of the shifted surfaces within a box about it, whose half-width shrinks after a step without progress. This
is a trust-region method with first-order corrected models: N. M. Alexandrov and others, Structural Optimization 15
(1998) 16–23.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.confidence_intervals import settled
from stemcal.doe.calibration.likelihood import Fit
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.comparison import error_percent
from stemcal.doe.regression.section import AnySurface
from stemcal.runs.record import Outcome
from stemcal.stages.fitting import Surfaces, fit_over, fitted_surfaces, measured_means, priors_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.loop import NO_PREDICTION, How, JudgedPoint, PointToTry, Predicted, Stopped
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST

FIRST_RADIUS, SHRINK = 1.0, 0.5  # coded radius of the first step; `SHRINK`: its factor after a step without progress
_NEWTON_STEPS = 60
_PROGRESS = 0.5  # a step makes progress if it reduces the error to less than this share
_SAME = 1e-9  # coded: a shorter step to a single target is not worth a run
_SETTLED = 1e-3  # coded: a shorter step of a joint fit is not worth a run


@dataclass(frozen=True, eq=False)
class Trial:
    """A simulated point in coded factors, and its responses in the order of the fitted means."""

    coded: Array
    responses: Array

    @property
    def response(self) -> float:
        return float(self.responses[0])


class MeanSteps:
    """Base class of `Steps` that vary all factors and compare the responses of each point with the fitted means."""

    precision: Array  # W of the misfit rᵀWr, r = measured − simulated

    def __init__(self, study: Study) -> None:
        self.study, self.joint = study, bool(study.joint_targets)
        self.means = measured_means(study)
        self.measured = np.array([mean.value for mean in self.means])
        self.conditions = list(dict.fromkeys(mean.condition for mean in self.means))
        self.visited: list[Array] = []
        self.trials: list[Trial] = []
        self.failed = False  # whether a run of the last point failed

    def judge(self, point: PointToTry, outcomes: Mapping[float, Outcome]) -> JudgedPoint:
        values = np.array([outcomes[mean.condition].number(mean.response) for mean in self.means])
        self.visited.append(point.place)
        self.failed = not np.all(np.isfinite(values))
        if self.failed or not self.learn(Trial(point.place, values)):
            return JudgedPoint(point)
        pairs = zip(self.means, values.tolist(), strict=True)
        worst = max((error_percent(mean.value, value) or 0.0 for mean, value in pairs if mean.leads), key=abs)
        return JudgedPoint(point, worst, self._missed(self.trials[-1]) if self.joint else abs(worst))

    def learn(self, trial: Trial) -> bool:
        """Include a trial in the basis of the next step; return whether its point may be the result."""
        self.trials.append(trial)
        return True

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Factors that stay at mid-range."""
        return ()

    @property
    def best(self) -> Trial:
        """Trial of least misfit."""
        return min(self.trials, key=self._missed)

    def shrunk(self, reach: float) -> float:
        """Return the half-width of the box for the next step: smaller after a step without progress."""
        before = [self._missed(trial) for trial in self.trials[:-1]]
        helped = self.best is self.trials[-1] and not (before and self._missed(self.best) > SHRINK * min(before))
        return reach if helped else SHRINK * reach

    def _missed(self, trial: Trial) -> float:
        gap = self.measured - trial.responses
        return float(gap @ self.precision @ gap)


class SurfaceSteps(MeanSteps):
    """Steps on the response surface, refitted to every point, inside the region of its design.

    A single target is searched along the slope or between two points, several means by least misfit.
    """

    def __init__(self, study: Study, surface: Surfaces, solution: InvertResult) -> None:
        super().__init__(study)
        self.surface, self.solution = surface, solution
        self.coding, self.region = surface.scales, surface.region
        self.surfaces = self._refitted()
        self.fit = fit_over(self.means, self.surfaces, self.region, priors_of(study, self.coding))
        self.precision = self.fit.precision[: len(self.means), : len(self.means)]
        self.reach = FIRST_RADIUS

    def first(self) -> PointToTry:
        return self._point(self.coding.point(self.solution.point.coded), "solution")

    def next(self) -> PointToTry | None:
        """Return the next point from the best one; after a failed run, half-way back to it or to the design centre."""
        if self.failed:
            known = self.best.coded if self.trials else np.zeros(len(self.coding.names))
            return self._point(0.5 * (self.visited[-1] + known), "back")
        how: How = "surface"
        if self.joint:
            self.reach = self.shrunk(self.reach)
            moved, start, region = through(self.fit, self.surfaces, self.best), self.best.coded, self.region
            low, high = np.maximum(region.low, start - self.reach), np.minimum(region.high, start + self.reach)
            near = replace(region, low=low, high=high)
            coded = near.nearest(settled(moved, near)[0].best)
        else:
            at, target = self.surfaces[0], self.solution.target
            coded, how, self.reach = next_trial(at, target, self.region, self.trials, self.reach)
        shortest = min(float(np.linalg.norm(coded - trial.coded)) for trial in self.trials)
        return None if shortest < (_SETTLED if self.joint else _SAME) else self._point(coded, how)

    def end(self) -> Stopped:
        return "settled"

    def _point(self, coded: Array, how: How) -> PointToTry:
        (levels,) = self.coding.runs([coded], self.solution.parameters)
        predicted: dict[float, Predicted] = dict.fromkeys(self.conditions, NO_PREDICTION)
        for mean, surface in zip(self.means, self.surfaces, strict=True):
            if mean.response == FIRST:
                low, high = map(float, surface.prediction_interval(coded)[0])
                interval = (low, high) if isfinite(low) and isfinite(high) else None
                predicted[mean.condition] = float(surface.predict(coded)[0]), interval
        return PointToTry(levels, how, coded, predicted)

    def learn(self, trial: Trial) -> bool:
        self.trials.append(trial)
        self.surfaces = self._refitted()
        return True

    def _refitted(self) -> list[AnySurface]:
        return fitted_surfaces(self.study, self.surface, [(t.coded, t.responses) for t in self.trials])


def nearest_trial(trials: Sequence[Trial], target: float) -> Trial:
    """Return the trial nearest to the target, the earliest of equals."""
    return min(trials, key=lambda trial: abs(trial.response - target))


def next_trial(
    surface: AnySurface, target: float, region: Region, trials: Sequence[Trial], radius: float
) -> tuple[Array, How, float]:
    """Return the next point, the rule that chose it, and the trust radius (coded).

    `surface` is fitted to all `trials`, at least one, in the order of simulation; `radius` limited the last step.
    """
    best = nearest_trial(trials, target)
    before = nearest_trial(trials[:-1] or trials, target)
    helped = len(trials) < 2 or abs(trials[-1].response - target) <= _PROGRESS * abs(before.response - target)
    radius = radius if helped else SHRINK * radius
    other = _across(trials, best, target)
    if other is not None and not helped:
        return _between(best, other, target), "bracket", radius
    shifted = target - (best.response - float(surface.predict(best.coded)[0]))
    return toward(surface, shifted, region, best.coded, radius), "surface", radius


def toward(surface: AnySurface, level: float, region: Region, start: Array, radius: float) -> Array:
    """Return the point nearest to `start` with ŷ = level, as far as radius and region allow.

    Newton steps along the gradient, x ← x + (level − ŷ)·∇ŷ/|∇ŷ|², each followed by a projection into the region.
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


def _across(trials: Sequence[Trial], best: Trial, target: float) -> Trial | None:
    """Return the trial nearest to `best` on the other side of the target, if there is one."""
    others = [trial for trial in trials if np.sign(trial.response - target) == -np.sign(best.response - target)]
    return min(others, key=lambda trial: float(np.linalg.norm(trial.coded - best.coded)), default=None)


def _between(best: Trial, other: Trial, target: float) -> Array:
    """Interpolate linearly between two trials to the target, at least 10 % away from either."""
    share = (target - best.response) / (other.response - best.response)
    return np.asarray(best.coded + np.clip(share, 0.1, 0.9) * (other.coded - best.coded))


def through(fit: Fit, surfaces: Sequence[AnySurface], trial: Trial) -> Fit:
    """Return the fit with each surface shifted so that it passes through the trial; the weights stay the same."""
    pairs = zip(surfaces, fit.observations, trial.responses.tolist(), strict=True)
    moved = (replace(mean, surface=surface.moved(trial.coded, response)) for surface, mean, response in pairs)
    return replace(fit, observations=tuple(moved))
