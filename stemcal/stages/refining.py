"""The closed loop: simulate at the solution, compare, learn from it, go on until the force is right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from stemcal.errors import RunsFailed
from stemcal.stages.stepping import Simulate, SimulateAt, at_one
from stemcal.stages.turning import box_of, coding_of, surface_of
from stemcal.study.model import RefineOptions, Study

if TYPE_CHECKING:
    from stemcal.doe.approach import Trial
    from stemcal.doe.coding import Coding
    from stemcal.doe.region import Region
    from stemcal.doe.regression import Array
    from stemcal.doe.surface import Surface


def close_loop(study: Study, rsm: Mapping[str, Any], invert: Mapping[str, Any], simulate: SimulateAt) -> dict[str, Any]:
    """Simulate at the solution, add the point, refit, step, until the tolerance or the budget is met.

    ``rows`` tells of every iteration; its ``how`` is ``solution`` (of the stage before), ``surface`` (the refitted
    one), ``bracket`` (between two simulated points) or ``back`` (half-way back from a run that failed).
    """
    at_target = at_one(study.targets.calibrate_at, simulate)
    loop = _Loop(study, rsm, invert, at_target, study.refine or RefineOptions())
    loop.run()
    return loop.as_dict()


@dataclass
class _Loop:
    """Everything learnt so far."""

    study: Study
    rsm: Mapping[str, Any]
    invert: Mapping[str, Any]
    simulate: Simulate
    options: RefineOptions
    rows: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        from stemcal.doe.approach import FIRST_RADIUS
        from stemcal.doe.region import Region

        self.coding: Coding = coding_of(self.rsm)
        self.region: Region = Region(*box_of(self.study, self.coding), self.rsm["radius"])
        self.target = float(self.invert["target"])
        self.surface: Surface = surface_of(self.rsm)
        self.trials: list[Trial] = []
        self.radius = FIRST_RADIUS

    @property
    def done(self) -> bool:
        """Whether the last simulated force is within the tolerance."""
        error = self.rows[-1]["error_percent"] if self.rows else None
        return error is not None and abs(error) <= self.options.tolerance_percent

    def run(self) -> None:

        point, how = self.coding.point(self.invert["coded"]), "solution"
        while True:
            self.visit(point, how)
            if self.done or len(self.rows) >= self.options.budget:
                return
            point, how = self.next_point(point)

    def visit(self, point: Array, how: str) -> None:
        """Simulate one point, keep what came of it, and refit."""
        from stemcal.doe.approach import Trial
        from stemcal.doe.inversion import assess_point

        guess = assess_point(self.surface, point, self.region.low, self.region.high, self.region.radius)
        number = len(self.rows) + 1
        levels = {**self.invert["parameters"], **self.coding.levels(point)}
        entry = self.simulate(number - 1, levels)
        force = entry["force"]
        self.rows.append(
            {
                "iteration": number,
                "how": how,
                "levels": levels,
                "coded": self.coding.by_name(point),
                "coded_radius": guess.coded_radius,
                "step_radius": None if number == 1 else self.radius,
                "predicted": guess.predicted,
                "prediction_interval": guess.prediction_interval,
                "inside_interval": inside(force, guess.prediction_interval),
                "error_percent": None if force is None else 100.0 * (self.target - force) / self.target,
                **entry,
            }
        )
        if force is not None:
            self.trials.append(Trial(point, force))
            self.surface = surface_of(self.rsm, [(trial.coded, trial.response) for trial in self.trials])

    def next_point(self, last: Array) -> tuple[Array, str]:
        """Step on from what was simulated; after a failed run, half-way back to the last that was not."""
        from stemcal.doe.approach import next_step

        if self.rows[-1]["force"] is None:
            return 0.5 * (last + self.firm_ground()), "back"
        step = next_step(self.surface, self.target, self.region, self.trials, self.radius)
        self.radius = step.radius
        return step.coded, step.how

    def firm_ground(self) -> Array:
        """Return a point that is known to simulate: the best trial, or the design's run nearest to the target."""
        from stemcal.doe.approach import best_of

        return best_of(self.trials or _design_trials(self.rsm), self.target).coded

    def as_dict(self) -> dict[str, Any]:
        """Return the contents of ``refine.json``."""
        done = [row for row in self.rows if row["force"] is not None]
        if not done:
            reason = self.rows[-1]["reason"]
            raise RunsFailed(f"refine: none of {len(self.rows)} runs succeeded ({reason}); see the log for each reason")
        best = min(done, key=lambda row: abs(row["error_percent"]))
        return {
            "target": self.target,
            "diameter": self.invert["diameter"],
            "tolerance_percent": self.options.tolerance_percent,
            "budget": self.options.budget,
            "converged": abs(best["error_percent"]) <= self.options.tolerance_percent,
            "iteration": best["iteration"],
            "solution": {name: best["levels"][name] for name in self.coding.names},
            "coded": best["coded"],
            "coded_radius": best["coded_radius"],
            "simulated": best["force"],
            "error_percent": best["error_percent"],
            "parameters": best["levels"],
            "rows": self.rows,
            "surface": {"coefficients": self.surface.as_dict()["coefficients"], "r2": self.surface.r2},
            "notes": _notes(self.rows, best, self.options),
        }


def inside(force: float | None, interval: tuple[float, float] | None) -> bool | None:
    """Whether a value lies in an interval; None where there is no value or no interval."""
    if force is None or interval is None:
        return None
    return interval[0] <= force <= interval[1]


def _design_trials(rsm: Mapping[str, Any]) -> list[Trial]:
    import numpy as np

    from stemcal.doe.approach import Trial

    runs = [run for run in rsm["design"]["runs"] if run["force"] is not None]
    return [Trial(np.array([run["coded"][name] for name in rsm["names"]]), run["force"]) for run in runs]


def _notes(rows: list[dict[str, Any]], best: Mapping[str, Any], options: RefineOptions) -> list[str]:
    first, notes = rows[0], []
    if first["inside_interval"] is False:
        notes.append(
            f"At the surface's solution the simulated force, {first['force']:.4g} N, lies outside the prediction "
            "interval: the surface misses more there than its residuals show."
        )
    if abs(best["error_percent"]) > options.tolerance_percent:
        notes.append(
            f"After {len(rows)} runs the simulated force is still {abs(best['error_percent']):.2f} % from the target; "
            "the best point is kept. Raise refine.budget, or refine the mesh: the force may jump between points."
        )
    if best["iteration"] > 1:
        notes.append("The point is the one found by simulation, no longer the one the rule of `invert` names.")
    return notes
