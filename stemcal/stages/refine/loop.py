"""The loop: simulate at the solution, compare, correct, step, until the target is reached.

Its steps choose the next point. `SurfaceSteps` refits the response surface to every point and moves
on it: for the study's own model. `PathSteps` moves one factor after the other: for another program or mesh, whose
response is not that of the surface.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, log
from typing import Any, Protocol

import numpy as np

from stemcal.doe.calibration import approach
from stemcal.doe.calibration.search_path import SearchPath, Tried, best_of, next_step
from stemcal.doe.calibration.search_path import Step as PathStep
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.doe.validation.comparison import error_percent
from stemcal.errors import RunsFailed
from stemcal.naming import FIRST
from stemcal.runs.outcome import Outcome
from stemcal.stages.fitting import fit_over, joint_surfaces, measured_means, measured_of, priors_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import How, RefineRun, Stopped
from stemcal.stages.result import Interval
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import SimulateAt
from stemcal.study.model import Study

_SAME, _SETTLED = 1e-9, 1e-3  # coded: shorter steps of one target, of a joint fit, are not worth a run


@dataclass(frozen=True)
class Predicted:
    """The first response expected at a point, and the interval of one simulation."""

    response: float | None
    interval: Interval | None = None


@dataclass(frozen=True, eq=False)
class Point:
    """A point to simulate: its levels, how it was found, its place among the steps, and the prediction by condition."""

    levels: dict[str, float]
    how: How
    place: Any
    predicted: Mapping[float, Predicted]


@dataclass(frozen=True, eq=False)
class Judged:
    """A simulated point: its largest error, and what the best point has least of; None where a run failed."""

    point: Point
    error_percent: float | None = None
    merit: float = inf


class Steps(Protocol):
    """Which point comes next."""

    @property
    def conditions(self) -> Sequence[float]:
        """Where every point is simulated."""

    def first(self) -> Point:
        """Return the point to begin with."""

    def judge(self, point: Point, outcomes: Mapping[float, Outcome]) -> Judged:
        """Return how far a simulated point is from the target, and include it in the next step."""

    def next(self) -> Point | None:
        """Return the next point; None where no step is left."""

    def end(self) -> Stopped:
        """Return why no step is left."""


class Loop:
    """Simulates point after point; `points`, `runs` and `stopped` hold the result."""

    def __init__(self, steps: Steps, simulate: SimulateAt, tolerance_percent: float, budget: int) -> None:
        self.steps, self.simulate = steps, simulate
        self.tolerance_percent, self.budget = tolerance_percent, budget
        self.points: list[Judged] = []
        self.runs: list[RefineRun] = []
        self.stopped: Stopped = "budget"

    def run(self) -> None:
        """Continue until the target is reached, the budget is spent, or no step is left."""
        point: Point | None = self.steps.first()
        while point is not None:
            self.points.append(self.steps.judge(point, self._simulated(point, self.steps.conditions)))
            error = self.points[-1].error_percent
            if error is not None and abs(error) <= self.tolerance_percent:
                self.stopped = "tolerance"
                return
            if self.left < len(self.steps.conditions):
                return
            point = self.steps.next()
        self.stopped = self.steps.end()

    def run_elsewhere(self, conditions: Sequence[float]) -> None:
        """Simulate the best point, then the first one, at other conditions while runs are left in the budget."""
        for point in dict.fromkeys((self.best.point, self.points[0].point)):
            predicted = {condition: Predicted(None) for condition in conditions}
            self._simulated(Point(point.levels, "elsewhere", point.place, predicted), conditions[: self.left])

    @property
    def left(self) -> int:
        """The number of runs left in the budget."""
        return self.budget - len(self.runs)

    @property
    def best(self) -> Judged:
        """The point that reached the target, or else the best one; raise `RunsFailed` if runs of all points failed."""
        done = [judged for judged in self.points if judged.error_percent is not None]
        if not done:
            failed = [run.outcome for run in self.runs if not run.outcome.ok]
            why = f"{failed[-1].reason}: {failed[-1].message}" if failed else "their records lack a fitted response"
            raise RunsFailed(f"refine: no point was simulated without a failure in {len(self.runs)} runs ({why})")
        return done[-1] if self.stopped == "tolerance" else min(done, key=lambda judged: judged.merit)

    def responses(self, levels: Mapping[str, float]) -> dict[float, Outcome]:
        """Return the outcome at each condition that was simulated with these levels."""
        return {run.condition: run.outcome for run in self.runs if run.levels == levels}

    def _simulated(self, point: Point, conditions: Sequence[float]) -> dict[float, Outcome]:
        found = self.simulate(self._row(point), [point.levels], conditions) if conditions else []
        for condition, outcome in zip(conditions, found, strict=True):
            predicted = point.predicted[condition]
            self.runs.append(
                RefineRun(
                    run=len(self.runs) + 1,
                    how=point.how,
                    condition=condition,
                    levels=point.levels,
                    predicted=predicted.response,
                    prediction_interval=predicted.interval,
                    outcome=outcome,
                )
            )
        return dict(zip(conditions, found, strict=True))

    def _row(self, point: Point) -> int:
        """Return the number of a point from 0: a run elsewhere repeats one that has a number."""
        return next((i for i, one in enumerate(self.points) if one.point.levels == point.levels), len(self.points))


class SurfaceSteps:
    """Steps on the response surface, refitted to every point, inside the region of its design.

    To one target along the slope of the surface or between two points on either side of it; to several means by the
    least misfit of the surfaces, moved through the best point.
    """

    def __init__(self, study: Study, surface: SurfaceResult, solution: InvertResult) -> None:
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


class PathSteps:
    """Steps along the ranges of some factors to one response at one condition; the others stay at `levels`."""

    def __init__(self, path: SearchPath, levels: Mapping[str, float], condition: float, aim: float, expected: float):
        self.path, self.levels, self.aim, self.expected = path, levels, aim, expected
        self.conditions = [condition]
        self.tried: list[Tried] = []

    def first(self) -> Point:
        """Return the start of the path."""
        return self._point(PathStep(0.0, self.expected), "solution")

    def judge(self, point: Point, outcomes: Mapping[float, Outcome]) -> Judged:
        """Compare with the aim, by ratio."""
        tried = Tried(point.place, outcomes[self.conditions[0]].number(FIRST))
        self.tried.append(tried)
        if not isfinite(tried.level):
            return Judged(point)
        return Judged(point, error_percent(self.aim, tried.response), abs(tried.level - log(self.aim)))

    def next(self) -> Point | None:
        """Step along the path, by what the runs so far show of it."""
        step = next_step(self.tried, self.aim, self.path)
        return None if step is None else self._point(step, "path" if isfinite(self.tried[-1].level) else "back")

    def end(self) -> Stopped:
        """Return whether the best point is at an end of the path."""
        best = best_of(self.tried, self.aim)
        return "out_of_reach" if best is not None and best.place in self.path.ends else "settled"

    def _point(self, step: PathStep, how: How) -> Point:
        levels = {**self.levels, **(self.path.at(step.place) if step.place else {})}
        return Point(levels, how, step.place, {self.conditions[0]: Predicted(step.expected)})
