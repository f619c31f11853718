"""The loop of the refinement: simulate a point, compare it with the target and choose the next, until it is reached.

A `Steps` object chooses the points. `PathSteps` moves one factor after the other; it is for another program or mesh,
whose response differs from the response surface.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, log
from typing import Any, Literal, Protocol

from stemcal.doe.calibration.search_path import SearchPath, Tried, best_of, ends_of, next_step
from stemcal.doe.comparison import error_percent
from stemcal.errors import RunsFailed
from stemcal.runs.record import Outcome
from stemcal.stages.result import Interval
from stemcal.stages.work import SimulateAt
from stemcal.storage.typed import Spread, absent, inline
from stemcal.vocabulary import FIRST

Stopped = Literal["tolerance", "budget", "settled", "out_of_reach"]
How = Literal["solution", "surface", "bracket", "middle", "probe", "secant", "back", "path", "elsewhere"]


@dataclass(frozen=True, kw_only=True)
class RefineRun(Spread):
    """One run of the refinement: how its point was chosen, the response predicted before the run, and the outcome.

    `how` is ``solution`` (of the surface), ``surface`` (of the surface corrected by new runs), ``bracket`` (between two
    points), ``path`` (only factors in `refine.adjust` move), ``back`` (half-way back from a failed run) or
    ``elsewhere`` (an earlier point, simulated at another condition). Without a response surface it is ``middle`` (of
    the ranges), ``probe`` (one factor moved) or ``secant`` (by the slopes between earlier points).
    """

    run: int
    how: How
    condition: float
    levels: dict[str, float]
    predicted: float | None
    prediction_interval: Interval | None = absent()
    outcome: Outcome = inline()

    @property
    def inside_interval(self) -> bool | None:
        """Whether the response is inside the prediction interval; None if the response or the interval is missing."""
        response, interval = self.outcome.response, self.prediction_interval
        return None if response is None or interval is None else interval[0] <= response <= interval[1]


Predicted = tuple[float | None, Interval | None]
"""Predicted first response at a point, and the prediction interval of a single run."""
NO_PREDICTION: Predicted = (None, None)


@dataclass(frozen=True, eq=False)
class PointToTry:
    """A point to simulate; `place` is its coded point or position on a path, `predicted` has a value per condition."""

    levels: dict[str, float]
    how: How
    place: Any
    predicted: Mapping[float, Predicted]


@dataclass(frozen=True, eq=False)
class JudgedPoint:
    """A simulated point with its largest error (None if a run failed) and its `merit`, least for the best point."""

    point: PointToTry
    error_percent: float | None = None
    merit: float = inf


class Steps(Protocol):
    """Choice of the points to simulate."""

    @property
    def conditions(self) -> Sequence[float]:
        """Conditions at which every point is simulated."""

    def first(self) -> PointToTry:
        """Return the first point."""

    def judge(self, point: PointToTry, outcomes: Mapping[float, Outcome]) -> JudgedPoint:
        """Return the error of a simulated point; the next steps use its responses."""

    def next(self) -> PointToTry | None:
        """Return the next point; None if no step is left."""

    def end(self) -> Stopped:
        """Return the reason why no step is left."""


class Loop:
    """Simulate point after point; after `run`, the attributes `points`, `runs` and `stopped` contain the result."""

    def __init__(self, steps: Steps, simulate: SimulateAt, tolerance_percent: float, budget: int) -> None:
        self.steps, self.simulate = steps, simulate
        self.tolerance_percent, self.budget = tolerance_percent, budget
        self.points: list[JudgedPoint] = []
        self.runs: list[RefineRun] = []
        self.stopped: Stopped = "budget"

    def run(self) -> None:
        """Simulate points until the target is reached, the budget is spent, or no step is left."""
        point: PointToTry | None = self.steps.first()
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
        """Simulate the best point, then the first point, at other conditions, as far as the budget allows."""
        for point in dict.fromkeys((self.best.point, self.points[0].point)):
            predicted = dict.fromkeys(conditions, NO_PREDICTION)
            self._simulated(PointToTry(point.levels, "elsewhere", point.place, predicted), conditions[: self.left])

    @property
    def left(self) -> int:
        return self.budget - len(self.runs)

    @property
    def best(self) -> JudgedPoint:
        """The point that reached the target, or else the best one; `RunsFailed` if every point has a failed run."""
        done = [judged for judged in self.points if judged.error_percent is not None]
        if not done:
            failed = [f"{run.outcome.reason}: {run.outcome.message}" for run in self.runs if not run.outcome.ok]
            why = failed[-1] if failed else "the records do not contain all fitted responses"
            runs = f"{len(self.runs)} runs; {why}"
            raise RunsFailed(f"refine: at least one run failed at every simulated point ({runs}).")
        return done[-1] if self.stopped == "tolerance" else min(done, key=lambda judged: judged.merit)

    def responses(self, levels: Mapping[str, float]) -> dict[float, Outcome]:
        """Return the outcomes of the runs with these levels, by condition."""
        return {run.condition: run.outcome for run in self.runs if run.levels == levels}

    def _simulated(self, point: PointToTry, conditions: Sequence[float]) -> dict[float, Outcome]:
        numbered = [judged.point.levels for judged in self.points]  # a point keeps its row at other conditions
        row = numbered.index(point.levels) if point.levels in numbered else len(numbered)
        outcomes = self.simulate(row, [point.levels], conditions) if conditions else []
        for condition, outcome in zip(conditions, outcomes, strict=True):
            expected, interval = point.predicted[condition]
            self.runs.append(
                RefineRun(
                    run=len(self.runs) + 1,
                    how=point.how,
                    condition=condition,
                    levels=point.levels,
                    predicted=expected,
                    prediction_interval=interval,
                    outcome=outcome,
                )
            )
        return dict(zip(conditions, outcomes, strict=True))


class PathSteps:
    """Steps along a path to the response `aim` at one condition; the factors that do not move stay at `levels`."""

    def __init__(self, path: SearchPath, levels: Mapping[str, float], condition: float, aim: float, expected: float):
        self.path, self.levels, self.aim, self.expected = path, levels, aim, expected
        self.conditions = [condition]
        self.tried: list[Tried] = []

    def first(self) -> PointToTry:
        return self._point(0.0, self.expected, "solution")

    def judge(self, point: PointToTry, outcomes: Mapping[float, Outcome]) -> JudgedPoint:
        tried = Tried(point.place, outcomes[self.conditions[0]].number(FIRST))
        self.tried.append(tried)
        if not isfinite(tried.level):
            return JudgedPoint(point)
        return JudgedPoint(point, error_percent(self.aim, tried.response), abs(tried.level - log(self.aim)))

    def next(self) -> PointToTry | None:
        step = next_step(self.tried, self.aim, self.path)
        return None if step is None else self._point(*step, "path" if isfinite(self.tried[-1].level) else "back")

    def end(self) -> Stopped:
        best = best_of(self.tried, self.aim)
        return "out_of_reach" if best is not None and best.place in self.path.ends else "settled"

    def intervals(self, point: PointToTry, relative_error: float, df: float) -> dict[str, Interval]:
        """Return the 95 % interval of each factor at a simulated point, from the relative standard error of the aim."""
        tried = next(run for run in self.tried if run.place == point.place)
        return ends_of(self.tried, tried, self.path, relative_error, df)

    def _point(self, place: float, expected: float | None, how: How) -> PointToTry:
        levels = {**self.levels, **(self.path.at(place) if place else {})}
        return PointToTry(levels, how, place, {self.conditions[0]: (expected, None)})
