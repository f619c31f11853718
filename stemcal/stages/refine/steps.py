"""Steps of the refinement in the study's own model, on the response surface."""

from collections.abc import Mapping
from math import isfinite

import numpy as np

from stemcal.doe.calibration import approach
from stemcal.doe.comparison import error_percent
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.naming import FIRST
from stemcal.runs.record import Outcome
from stemcal.stages.fitting import Surfaces, fit_over, joint_surfaces, measured_means, measured_of, priors_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.loop import How, Judged, Point, Predicted, Stopped
from stemcal.study.model import Study

_SAME, _SETTLED = 1e-9, 1e-3  # coded: shorter steps of one target, of a joint fit, are not worth a run


class SurfaceSteps:
    """Steps on the response surface, refitted to every point, inside the region of its design.

    To one target along the slope of the surface or between two points on either side of it; to several means by the
    least misfit of the surfaces, moved through the best point.
    """

    def __init__(self, study: Study, surface: Surfaces, solution: InvertResult) -> None:
        self.study, self.surface, self.solution = study, surface, solution
        self.coding, self.region = surface.scales, surface.region(study)
        self.joint = bool(study.joint_targets)
        self.means = (
            measured_means(study) if self.joint else measured_of(study.calibration_target, [FIRST], study.naming)
        )
        self.conditions = list(dict.fromkeys(mean.condition for mean in self.means))
        self.visited: list[Array] = []
        self.trials: list[approach.JointTrial] = []
        self.surfaces = self._refitted()
        self.fit = fit_over(self.means, self.surfaces, self.region, priors_of(study, self.coding))
        self.reach = approach.FIRST_RADIUS

    def first(self) -> Point:
        """Return the solution of the surface."""
        return self._point(self.coding.point(self.solution.point.coded), "solution")

    def judge(self, point: Point, outcomes: Mapping[float, Outcome]) -> Judged:
        """Compare with the measured means, and refit the surfaces."""
        values = np.array([outcomes[mean.condition].number(mean.response) for mean in self.means])
        self.visited.append(point.place)
        if not np.all(np.isfinite(values)):
            return Judged(point)
        self.trials.append(approach.JointTrial(point.place, values))
        self.surfaces = self._refitted()
        errors = [
            error_percent(mean.value, float(value)) or 0.0
            for mean, value in zip(self.means, values, strict=True)
            if mean.leads
        ]
        worst = max(errors, key=abs)
        return Judged(point, worst, self._missed(self.trials[-1]) if self.joint else abs(worst))

    def next(self) -> Point | None:
        """Step from the best point; after a failed run, half-way back to it."""
        if not self.trials or self.trials[-1].coded is not self.visited[-1]:
            return self._point(0.5 * (self.visited[-1] + self._simulated_before()), "back")
        coded, how = self._to_many() if self.joint else self._to_one()
        shortest = min(float(np.linalg.norm(coded - trial.coded)) for trial in self.trials)
        return None if shortest < (_SETTLED if self.joint else _SAME) else self._point(coded, how)

    def end(self) -> Stopped:
        """The solution no longer moves."""
        return "settled"

    def _point(self, coded: Array, how: How) -> Point:
        (levels,) = self.coding.runs([coded], self.solution.parameters)
        first = [(mean.condition, i) for i, mean in enumerate(self.means) if mean.response == FIRST]
        predicted = {condition: self._predicted(coded, self.surfaces[i]) for condition, i in first}
        return Point(levels, how, coded, {c: predicted.get(c, Predicted(None)) for c in self.conditions})

    def _predicted(self, coded: Array, surface: Surface) -> Predicted:
        low, high = map(float, surface.prediction_interval(coded)[0])
        interval = (low, high) if isfinite(low) and isfinite(high) else None
        return Predicted(float(surface.predict(coded)[0]), interval)

    def _refitted(self) -> list[Surface]:
        """Return the surface of every measured mean, fitted to the design and the points so far."""
        if self.joint:
            return joint_surfaces(self.study, self.surface, [(t.coded, t.responses) for t in self.trials])
        further = [(trial.coded, float(trial.responses[0])) for trial in self.trials]
        return [self.surface.refitted(self.surface.design.runs, further) if further else self.surface.fitted]

    def _simulated_before(self) -> Array:
        """Return a point without failures: the best one, or else the run of the design nearest to the one target."""
        if self.trials:
            return min(self.trials, key=self._missed).coded
        if self.joint:
            return np.zeros(len(self.coding.names))
        runs = [run for run in self.surface.design.runs if run.response is not None]
        trials = [approach.Trial(self.coding.point(run.coded), run.response or 0.0) for run in runs]
        return approach.best_of(trials, self.solution.target).coded

    def _missed(self, trial: approach.JointTrial) -> float:
        return approach.missed(self.fit, trial)

    def _to_one(self) -> tuple[Array, How]:
        trials = [approach.Trial(trial.coded, float(trial.responses[0])) for trial in self.trials]
        step = approach.next_step(self.surfaces[0], self.solution.target, self.region, trials, self.reach)
        self.reach = step.radius
        return step.coded, step.how

    def _to_many(self) -> tuple[Array, How]:
        best, before = min(self.trials, key=self._missed), [self._missed(trial) for trial in self.trials[:-1]]
        if best is not self.trials[-1] or (before and self._missed(best) > approach.SHRINK * min(before)):
            self.reach *= approach.SHRINK
        moved = approach.through(self.fit, self.surfaces, best)
        return approach.next_joint_point(moved, best.coded, self.reach), "surface"
