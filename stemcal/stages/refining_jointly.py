"""The closed loop over several diameters: simulate the joint solution at each, learn, fit again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from stemcal.errors import RunsFailed
from stemcal.stages.certainty import misfit_over
from stemcal.stages.joining import UNITS, joint_surfaces, measured_means
from stemcal.stages.refining import inside
from stemcal.stages.stepping import SimulateAt
from stemcal.stages.turning import box_of, coding_of
from stemcal.study.model import RefineOptions, Study

if TYPE_CHECKING:
    from stemcal.doe.joint_approach import JointTrial
    from stemcal.doe.misfit import Misfit
    from stemcal.doe.region import Region
    from stemcal.doe.regression import Array
    from stemcal.doe.surface import Surface

_SETTLED = 1e-3  # steps shorter than this, in coded units, tell nothing new


def close_jointly(
    study: Study, rsm: Mapping[str, Any], invert: Mapping[str, Any], simulate: SimulateAt
) -> dict[str, Any]:
    """Simulate the joint solution at every diameter, add the points to their surfaces, fit again, step.

    It ends when the largest error of the force is within the tolerance, when the budget has no run left for every
    diameter, or when the fit no longer moves: then no parameters near by do better. ``rows`` has an entry per
    iteration and diameter, ``iterations`` one per iteration.
    """
    loop = _JointLoop(study, rsm, invert, simulate, study.refine or RefineOptions())
    loop.run()
    return loop.as_dict()


@dataclass
class _JointLoop:
    """Everything learnt so far."""

    study: Study
    rsm: Mapping[str, Any]
    invert: Mapping[str, Any]
    simulate: SimulateAt
    options: RefineOptions
    rows: list[dict[str, Any]] = field(default_factory=list)
    iterations: list[dict[str, Any]] = field(default_factory=list)
    stopped: str = "budget"

    def __post_init__(self) -> None:
        from stemcal.doe.joint_approach import FIRST_REACH
        from stemcal.doe.region import Region

        self.coding = coding_of(self.rsm)
        self.region: Region = Region(*box_of(self.study, self.coding), self.rsm["radius"])
        self.means = measured_means(self.study)
        self.diameters = [target.diameter for target in self.study.joint_targets]
        self.surfaces: list[Surface] = joint_surfaces(self.study, self.rsm)
        self.misfit: Misfit = misfit_over(self.means, self.surfaces)
        self.trials: list[JointTrial] = []
        self.reach = FIRST_REACH

    def run(self) -> None:
        """Go round until there is a reason to stop."""
        import numpy as np

        point, how = self.coding.point(self.invert["coded"]), "solution"
        while True:
            self.visit(point, how)
            error = self.iterations[-1]["max_abs_error_percent"]
            if error is not None and error <= self.options.tolerance_percent:
                self.stopped = "tolerance"
                return
            if len(self.rows) + len(self.diameters) > self.options.budget:
                return
            last, (point, how) = point, self.next_point(point)
            if min(float(np.linalg.norm(point - x)) for x in [last, *(t.coded for t in self.trials)]) < _SETTLED:
                self.stopped = "settled"
                return

    def visit(self, point: Array, how: str) -> None:
        """Simulate one point at every diameter, keep what came of it, and refit the surfaces that learnt."""
        import numpy as np

        from stemcal.doe.joint_approach import JointTrial, missed

        levels = {**self.invert["parameters"], **self.coding.levels(point)}
        entries = self.simulate(len(self.iterations), levels, self.diameters)
        runs = dict(zip(self.diameters, entries, strict=True))
        values = np.array([runs[mean.diameter].get(mean.response) or np.nan for mean in self.means])
        trial = JointTrial(point, values)
        number, told = len(self.iterations) + 1, self.told(point, values)
        rows = [self.row(number, how, levels, d, [t for t in told if t["diameter"] == d], runs[d]) for d in runs]
        errors = [row["error_percent"] for row in rows]
        whole = bool(np.all(np.isfinite(values)))
        self.iterations.append(
            {
                "iteration": number,
                "how": how,
                "levels": levels,
                "coded": self.coding.by_name(point),
                "coded_radius": float(np.linalg.norm(point)),
                "reach": None if number == 1 else self.reach,
                "misfit": missed(self.misfit, trial) if whole else None,
                "max_abs_error_percent": max(abs(error) for error in errors) if whole else None,
                "error_percent": max(errors, key=abs) if whole else None,
            }
        )
        self.rows += rows
        if whole:
            self.trials.append(trial)
            self.surfaces = joint_surfaces(self.study, self.rsm, [(t.coded, t.responses) for t in self.trials])

    def told(self, point: Array, values: Array) -> list[dict[str, Any]]:
        """Return for each measured mean what its surface predicts and what was simulated."""
        import math

        entries = []
        for mean, surface, value in zip(self.means, self.surfaces, values.tolist(), strict=True):
            low, high = map(float, surface.prediction_interval(point)[0])
            interval = (low, high) if math.isfinite(low) and math.isfinite(high) else None
            simulated = value if math.isfinite(value) else None
            entries.append(
                {
                    "diameter": mean.diameter,
                    "response": mean.response,
                    "unit": UNITS[mean.response],
                    "measured": mean.value,
                    "predicted": float(surface.predict(point)[0]),
                    "prediction_interval": interval,
                    "simulated": simulated,
                    "inside_interval": inside(simulated, interval),
                    "error_percent": None if simulated is None else 100.0 * (mean.value - simulated) / mean.value,
                }
            )
        return entries

    def row(
        self,
        number: int,
        how: str,
        levels: Mapping[str, float],
        diameter: float,
        told: list[dict[str, Any]],
        entry: Mapping[str, Any],
    ) -> dict[str, Any]:
        """Return what the stage file tells of one run: the force, other responses under ``further``."""
        force = next(one for one in told if one["response"] == "force")
        kept = ("measured", "predicted", "prediction_interval", "inside_interval", "error_percent")
        further = [one for one in told if one["response"] != "force"]
        return {
            "iteration": number,
            "how": how,
            "diameter": diameter,
            "levels": levels,
            **{name: force[name] for name in kept},
            **entry,
            **({"further": further} if further else {}),
        }

    def next_point(self, last: Array) -> tuple[Array, str]:
        """Step on from the best that was simulated; after a failed run, half-way back to it (or to the centre)."""
        import numpy as np

        from stemcal.doe.joint_approach import SHRINK, missed, next_joint_point, through

        if self.iterations[-1]["misfit"] is None:
            return 0.5 * (last + (self.best_trial().coded if self.trials else np.zeros_like(last))), "back"
        best = self.best_trial()
        if best is not self.trials[-1] or (
            len(self.trials) > 1 and missed(self.misfit, best) > SHRINK * self.misfit_before()
        ):
            self.reach *= SHRINK
        moved = through(self.misfit, self.surfaces, best)
        return next_joint_point(moved, self.region, best.coded, self.reach), "surface"

    def misfit_before(self) -> float:
        """Return the least misfit of all trials but the last."""
        from stemcal.doe.joint_approach import missed

        return min(missed(self.misfit, trial) for trial in self.trials[:-1])

    def best_trial(self) -> JointTrial:
        """Return the trial of least misfit."""
        from stemcal.doe.joint_approach import missed

        return min(self.trials, key=lambda trial: missed(self.misfit, trial))

    def as_dict(self) -> dict[str, Any]:
        """Return the contents of ``refine.json``."""
        done = [entry for entry in self.iterations if entry["misfit"] is not None]
        if not done:
            failed = [row["reason"] for row in self.rows if row["force"] is None]
            reason = failed[0] if failed else "the records tell no travel or work"
            raise RunsFailed(f"refine: no iteration of {len(self.iterations)} succeeded at every diameter ({reason})")
        best = done[-1] if self.stopped == "tolerance" else min(done, key=lambda entry: entry["misfit"])
        at = {row["diameter"]: row for row in self.rows if row["iteration"] == best["iteration"]}
        return {
            "target": self.invert["target"],
            "diameter": self.invert["diameter"],
            "at_diameters": self.diameters,
            "tolerance_percent": self.options.tolerance_percent,
            "budget": self.options.budget,
            "converged": self.stopped == "tolerance",
            "stopped": self.stopped,
            "iteration": best["iteration"],
            "solution": {name: best["levels"][name] for name in self.coding.names},
            "coded": best["coded"],
            "coded_radius": best["coded_radius"],
            "simulated": at[self.invert["diameter"]]["force"] if self.invert["diameter"] in at else None,
            "error_percent": best["error_percent"],
            "max_abs_error_percent": best["max_abs_error_percent"],
            "parameters": best["levels"],
            "iterations": self.iterations,
            "rows": self.rows,
            "surfaces": [self.fitted(i) for i in range(len(self.means))],
            "notes": _notes(self, best),
        }

    def fitted(self, i: int) -> dict[str, Any]:
        """Return what became of one surface."""
        mean, surface = self.means[i], self.surfaces[i]
        coefficients = surface.as_dict()["coefficients"]
        return {
            "diameter": mean.diameter,
            "response": mean.response,
            "variance": float(self.misfit.variance[i]),
            "coefficients": coefficients,
            "r2": surface.r2,
        }


def _notes(loop: _JointLoop, best: Mapping[str, Any]) -> list[str]:
    first = [row for row in loop.rows if row["iteration"] == 1 and row["inside_interval"] is False]
    notes = []
    if first:
        listed = ", ".join(f"{row['diameter']:g}" for row in first)
        notes.append(
            "At the joint solution of the surfaces the simulated force lies outside the prediction interval at "
            f"{listed} mm: the surfaces miss more there than their residuals show."
        )
    error = f"the largest error of the simulated force is {best['max_abs_error_percent']:.2f} %"
    ends = {
        "tolerance": f"After {len(loop.rows)} runs {error}, within the tolerance.",
        "budget": f"After {len(loop.rows)} runs {error}; refine.budget has no further run for every diameter.",
        "settled": f"After {len(loop.rows)} runs the joint fit no longer moves: {error}, and no parameters near by do "
        "better. What remains is the model's, or the measured scatter's, not the surfaces'.",
    }
    return [*notes, ends[loop.stopped]]
