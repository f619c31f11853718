"""The closed loop: simulate at the solution, compare, learn from it, go on until the force is right.

One loop serves one force and many measured means. They differ in the step: to one force along the slope of the
surface or between two points that bracket it (`doe.calibration.approach`), to many by the least misfit of the
surfaces moved through the best point.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from stemcal.doe.calibration import approach
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.doe.validation.comparison import error_percent
from stemcal.files.rows import Rows
from stemcal.naming import FIRST
from stemcal.runs.outcome import Outcome
from stemcal.stages.invert.certainty import measured_of, misfit_over, priors_of
from stemcal.stages.invert.joint import joint_surfaces, measured_means
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import Iteration, Place, RefineRow, ResponseRow, Stopped
from stemcal.stages.result import Interval
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import SimulateAt
from stemcal.study.model import RefineOptions, Study

_SETTLED = 1e-3  # steps shorter than this, in coded units, tell nothing new


class Loop:
    """Everything learnt so far; `run` goes round until there is a reason to stop."""

    def __init__(self, study: Study, surface: SurfaceResult, solution: InvertResult, simulate: SimulateAt) -> None:
        self.study, self.surface, self.solution, self.simulate = study, surface, solution, simulate
        self.options = study.refine or RefineOptions()
        self.coding = surface.scales
        self.region = surface.region(study)
        self.alone = not study.joint_targets
        self.means = (
            measured_of(study.calibration_target, [FIRST], study.naming) if self.alone else measured_means(study)
        )
        self.conditions = list(dict.fromkeys(mean.condition for mean in self.means))
        self.trials: list[approach.JointTrial] = []
        self.surfaces = self._surfaces()
        misfit = misfit_over(self.means, self.surfaces, self.region)
        self.misfit = misfit.with_priors(priors_of(study, self.coding), self.region)
        self.rows: list[RefineRow] = []
        self.iterations: list[Iteration] = []
        self.reach = approach.FIRST_RADIUS
        self.stopped: Stopped = "budget"

    def run(self) -> None:
        """Go round until the forces are right, the budget is spent, or the joint fit no longer moves."""
        point, how = self.coding.point(self.solution.point.coded), "solution"
        while True:
            self._visit([point], how)
            error = self.iterations[-1].max_abs_error_percent
            if error is not None and error <= self.options.tolerance_percent:
                self.stopped = "tolerance"
                return
            if len(self.rows) + len(self.conditions) > self.options.budget:
                return
            last, (point, how) = point, self._next_point(point)
            if not self.alone and self._settled(point, last):
                self.stopped = "settled"
                return

    def _settled(self, point: Array, last: Array) -> bool:
        return min(float(np.linalg.norm(point - x)) for x in [last, *(t.coded for t in self.trials)]) < _SETTLED

    # ---- simulate and learn

    def _visit(self, points: Sequence[Array], how: str) -> None:
        """Simulate points at every diameter, keep what came of them, and refit the surfaces that learnt."""
        levels = self.coding.runs(points, self.solution.parameters)
        found = iter(self.simulate(len(self.iterations), levels, self.conditions))
        for point, at in zip(points, levels, strict=True):
            self._keep(point, how, at, {condition: next(found) for condition in self.conditions})

    def _keep(self, point: Array, how: str, levels: dict[str, float], runs: Mapping[float, Outcome]) -> None:
        values = np.array([runs[mean.condition].number(mean.response) for mean in self.means])
        compared = [self._compared(point, i, float(value)) for i, value in enumerate(values)]
        trial, whole = approach.JointTrial(point, values), bool(np.all(np.isfinite(values)))
        leading = [row for mean, row in zip(self.means, compared, strict=True) if mean.leads]
        errors = [row.error_percent for row in leading if row.error_percent is not None]
        self.iterations.append(
            Iteration(
                len(self.iterations) + 1,
                how,
                levels,
                self.coding.by_name(point),
                float(np.linalg.norm(point)),
                self.reach if self.iterations else None,
                approach.missed(self.misfit, trial) if whole else None,
                max(map(abs, errors)) if whole else None,
                max(errors, key=abs) if whole else None,
            )
        )
        self.rows += [self._row(condition, compared, run) for condition, run in runs.items()]
        if whole:
            self.trials.append(trial)
            self.surfaces = self._surfaces()

    def _surfaces(self) -> list[Surface]:
        """Return the surface of every measured mean, fitted to design and trials."""
        if not self.alone:
            return joint_surfaces(self.study, self.surface, [(t.coded, t.responses) for t in self.trials])
        further = [(trial.coded, float(trial.responses[0])) for trial in self.trials]
        return [self.surface.refitted(self.surface.design.runs, further) if further else self.surface.fitted]

    def _predicted(self, point: Array, i: int) -> tuple[float, Interval | None]:
        """Return the prediction of a measured mean, and the interval of one simulation."""
        model = self.surfaces[i]
        low, high = map(float, model.prediction_interval(point)[0])
        interval = (low, high) if math.isfinite(low) and math.isfinite(high) else None
        return float(model.predict(point)[0]), interval

    def _compared(self, point: Array, i: int, value: float) -> ResponseRow:
        mean, (predicted, interval) = self.means[i], self._predicted(point, i)
        simulated = value if math.isfinite(value) else None
        inside = None if simulated is None or interval is None else interval[0] <= simulated <= interval[1]
        error, named = error_percent(mean.value, simulated), mean.named
        return ResponseRow(
            mean.condition, named.name, named.unit, mean.value, predicted, interval, simulated, inside, error
        )

    def _row(self, condition: float, compared: Sequence[ResponseRow], outcome: Outcome) -> RefineRow:
        """Return the row of one run: of the first response, others under ``further``."""
        now = self.iterations[-1]
        at = [(mean, row) for mean, row in zip(self.means, compared, strict=True) if mean.condition == condition]
        first = next(row for mean, row in at if mean.response == FIRST)
        return RefineRow(
            iteration=now.iteration,
            how=now.how,
            condition=None if self.alone else condition,
            levels=now.levels,
            place=Place(now.coded, now.coded_radius, now.reach) if self.alone else None,
            measured=None if self.alone else first.measured,
            predicted=first.predicted,
            prediction_interval=first.prediction_interval,
            inside_interval=first.inside_interval,
            error_percent=first.error_percent,
            outcome=outcome,
            further=Rows(row for mean, row in at if mean.response != FIRST),
        )

    # ---- step

    def _next_point(self, last: Array) -> tuple[Array, str]:
        """Step on from the best that was simulated; after a failed run, half-way back to it."""
        if self.iterations[-1].misfit is None:
            return 0.5 * (last + self._firm_ground()), "back"
        return self._to_one() if self.alone else self._to_many()

    def _firm_ground(self) -> Array:
        """Return a point known to simulate: the best trial, or else the design's run nearest to the one target."""
        if self.trials:
            return self.best_trial().coded
        if not self.alone:
            return np.zeros(len(self.coding.names))
        runs = [run for run in self.surface.design.runs if run.response is not None]
        trials = [approach.Trial(self.coding.point(run.coded), run.response or 0.0) for run in runs]
        return approach.best_of(trials, self.solution.target).coded

    def _to_one(self) -> tuple[Array, str]:
        trials = [approach.Trial(trial.coded, float(trial.responses[0])) for trial in self.trials]
        step = approach.next_step(self.surfaces[0], self.solution.target, self.region, trials, self.reach)
        self.reach = step.radius
        return step.coded, step.how

    def _to_many(self) -> tuple[Array, str]:
        best = self.best_trial()
        if best is not self.trials[-1] or (
            len(self.trials) > 1 and approach.missed(self.misfit, best) > approach.SHRINK * self._misfit_before()
        ):
            self.reach *= approach.SHRINK
        moved = approach.through(self.misfit, self.surfaces, best)
        return approach.next_joint_point(moved, self.region, best.coded, self.reach), "surface"

    def _misfit_before(self) -> float:
        """Return the least misfit of all trials but the last."""
        return min(approach.missed(self.misfit, trial) for trial in self.trials[:-1])

    def best_trial(self) -> approach.JointTrial:
        """Return the trial of least misfit, the earliest of equals."""
        return min(self.trials, key=lambda trial: approach.missed(self.misfit, trial))
