"""Several measured means at once: the design of the surface run at each diameter, and the parameters that fit them all.

At a diameter each response (force, travel and work to the maximum force) has a surface of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.errors import RunsFailed
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.artefacts import reasons_given, run_entry
from stemcal.stages.certainty import Measured, certainty, measured_of, misfit_over
from stemcal.stages.layout import Design
from stemcal.stages.turning import box_of, coding_of, surface_through, weighed
from stemcal.study.model import Study

if TYPE_CHECKING:
    from stemcal.doe.joint import JointFit
    from stemcal.doe.misfit import Misfit
    from stemcal.doe.region import Region
    from stemcal.doe.regression import Array
    from stemcal.doe.surface import Surface

AnswerAll = Callable[[Sequence[Request]], list[Answer]]
UNITS = {"force": "N", "travel": "mm", "work": "mJ"}
_KEPT = ("coefficients", "r2", "adjusted_r2", "predicted_r2", "press", "cv_percent", "runs_failed")


def run_diameters(
    study: Study, stage: Mapping[str, Any], design: Design, solver: Solver, answer: AnswerAll
) -> list[dict[str, Any]]:
    """Run the design at every diameter of the joint fit and fit the surfaces there; empty without a joint fit.

    `stage` holds the surface of the calibration diameter; the others take the same terms.
    """
    return [_at_diameter(study, target.diameter, stage, design, solver, answer) for target in study.joint_targets]


def _at_diameter(
    study: Study,
    diameter: float,
    stage: Mapping[str, Any],
    design: Design,
    solver: Solver,
    answer: AnswerAll,
) -> dict[str, Any]:
    requests = design.requests(diameter)
    answers = answer(requests)
    runs = [
        {"run": request.row + 1, **run_entry(request, given, solver)}
        for request, given in zip(requests, answers, strict=True)
    ]
    runs = weighed(study, runs)
    with reasons_given(requests, answers):
        told = {name: _told(stage, runs, name, diameter) for name in study.invert.responses}
    further = {name: fit for name, fit in told.items() if name != "force"}
    return {"diameter": diameter, "runs": runs, **told["force"], **({"responses": further} if further else {})}


def _told(
    stage: Mapping[str, Any], runs: Sequence[Mapping[str, Any]], response: str, diameter: float
) -> dict[str, Any]:
    """Return what a surface stage keeps of the fit to one response."""
    silent = [run["run"] for run in runs if run["status"] == "ok" and response not in run]
    if silent:
        raise RunsFailed(
            f"{diameter:g} mm: the record of run {silent[0]} tells no {response}: it was made by another version or "
            "solver; take another study folder (--out), or leave the response out of invert.responses"
        )
    fit = surface_through(stage, runs, response=response).as_dict()
    return {name: fit[name] for name in _KEPT}


def further_responses(study: Study, diameter: float, run: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``further``, travel and work of a run beside what was measured of them; nothing if nothing was."""
    target = next(target for target in study.targets.forces if target.diameter == diameter)
    rows = [
        {
            "response": mean.response,
            "unit": UNITS[mean.response],
            "measured": mean.value,
            "sd": mean.sd,
            "simulated": run[mean.response],
            "error_percent": 100.0 * (mean.value - run[mean.response]) / mean.value,
        }
        for mean in measured_of(target, ["travel", "work"])
        if mean.response in run
    ]
    return {"further": rows} if rows else {}


def measured_means(study: Study) -> list[Measured]:
    """Return what the joint fit is made to: every response measured at its diameters."""
    return [mean for target in study.joint_targets for mean in measured_of(target, study.invert.responses)]


def joint_surfaces(
    study: Study, stage: Mapping[str, Any], further: Sequence[tuple[Array, Array]] = ()
) -> list[Surface]:
    """Return the surface of every measured mean, in their order; `further` are points and the responses there."""
    runs = {entry["diameter"]: entry["runs"] for entry in stage["diameters"]}
    return [
        surface_through(stage, runs[mean.diameter], [(x, float(found[i])) for x, found in further], mean.response)
        for i, mean in enumerate(measured_means(study))
    ]


def solve_jointly(study: Study, stage: Mapping[str, Any]) -> dict[str, Any]:
    """Return the contents of ``invert.json`` for a joint fit over the diameters and responses of the spec."""
    from stemcal.doe.inversion import assess_point
    from stemcal.doe.joint import fit_jointly
    from stemcal.doe.region import Region

    coding, means = coding_of(stage), measured_means(study)
    region = Region(*box_of(study, coding), stage["radius"])
    misfit = misfit_over(means, joint_surfaces(study, stage))
    fit = fit_jointly(misfit, region)
    target = study.calibration_target
    at_target = surface_through(stage, stage["design"]["runs"])
    point = assess_point(at_target, fit.coded, region.low, region.high, region.radius).as_dict(coding)
    sure = certainty(study, coding, misfit, region, "the joint fit")
    force = measured_of(target, ["force"])
    single = _alone(means, force[0], misfit, fit) or misfit_over(force, [at_target])
    forces_only = len(study.invert.responses) == 1
    alone = certainty(study, coding, single, region, f"{'' if forces_only else 'the force at '}{force[0].label} alone")
    joint = _joint_entry(means, misfit, region, fit)
    joint["best_worst_solution"] = dict(zip(coding.names, coding.to_natural(joint.pop("where")).tolist(), strict=True))
    return {
        "target": target.force,
        **point,
        "ranges": sure["intervals"],
        "coded_ranges": sure["coded_intervals"],
        "reachable": None,
        "rule": "joint_least_squares",
        "share": None,
        "radius": stage["radius"],
        "diameter": target.diameter,
        "target_sd": target.sd,
        "target_n": target.n,
        "parameters": {**study.midlevels(), **point["solution"]},
        "joint": joint,
        "certainty": sure,
        "certainty_alone": alone,
        "notes": _notes(joint, misfit, fit) + sure["sentences"] + alone["sentences"],
    }


def _alone(means: Sequence[Measured], force: Measured, misfit: Misfit, fit: JointFit) -> Misfit | None:
    """Return the misfit of the force at the calibration diameter by itself; None if the joint fit leaves it out."""
    return misfit.alone(means.index(force), fit.misfit) if force in means else None


def _joint_entry(means: Sequence[Measured], misfit: Misfit, region: Region, fit: JointFit) -> dict[str, Any]:
    """Return what a joint fit comes to; ``rows`` are of the force, ``further`` of the other responses."""
    from stemcal.doe.joint import best_worst_error, leave_one_out

    diameters = [mean.diameter for mean in means]
    left_out = leave_one_out(misfit, region, diameters if len(set(diameters)) > 1 else None)
    forces = [i for i, mean in enumerate(means) if mean.response == "force"]
    worst, where = best_worst_error(misfit.only(forces), region)
    every = _rows(means, fit, left_out)
    rows = [every[i] for i in forces]
    return {
        "rows": rows,
        "further": [row for i, row in enumerate(every) if i not in forces],
        "scatter": misfit.scatter,
        "misfit": fit.misfit if misfit.scale_known else None,
        "df": fit.df,
        "p": fit.p_value,
        "max_abs_error_percent": max(abs(row["error_percent"]) for row in rows),
        "max_abs_left_out_error_percent": max((abs(left_out[i]) for i in forces), default=None) if left_out else None,
        "best_worst_error_percent": worst,
        "where": where,
    }


def _rows(means: Sequence[Measured], fit: JointFit, left_out: Sequence[float]) -> list[dict[str, Any]]:
    without: Sequence[float | None] = left_out or [None] * len(means)
    return [
        {
            "diameter": mean.diameter,
            "response": mean.response,
            "unit": UNITS[mean.response],
            "measured": mean.value,
            "sd": mean.sd,
            "n": mean.n,
            "predicted": float(predicted),
            "error_percent": float(error),
            "left_out_error_percent": apart,
        }
        for mean, predicted, error, apart in zip(means, fit.predicted, fit.errors_percent, without, strict=True)
    ]


def _notes(joint: Mapping[str, Any], misfit: Misfit, fit: JointFit) -> list[str]:
    count = len(joint["rows"])
    notes = [
        f"Over {count} {'diameter' if count == 1 else 'diameters'} the surfaces miss the measured forces by at most "
        f"{joint['max_abs_error_percent']:.1f} %; no point of the region brings the largest error below "
        f"{joint['best_worst_error_percent']:.1f} %."
    ]
    notes += [
        f"Fitted beside the force: {row['response']} at {row['diameter']:g} mm, measured {row['measured']:.4g} "
        f"{row['unit']}, surface {row['predicted']:.4g} {row['unit']} ({row['error_percent']:+.1f} %)."
        for row in joint["further"]
    ]
    if joint["further"]:
        notes.append(
            "Means of the same specimens count as independent here. The work goes with force and travel: fitted "
            "together with both, it makes the intervals somewhat too narrow."
        )
    if joint["max_abs_left_out_error_percent"] is not None:
        left_out = "diameter" if count > 1 else "response"
        notes.append(
            f"Each {left_out} predicted from a fit to the others: the force is missed by at most "
            f"{joint['max_abs_left_out_error_percent']:.1f} %."
        )
    notes.append(_SCATTER[misfit.scatter])
    if fit.p_value is not None and fit.p_value < 0.05:
        notes.append(
            f"The misfit is {fit.misfit / fit.df:.1f} times what the known scatter explains (p = {fit.p_value:.2g}): "
            "the model is wrong somewhere, and the intervals below are too narrow."
        )
    return notes


_SCATTER = {
    "measured": "Weights: the measured scatter (sd²/n) and that of each surface in quadrature.",
    "pooled": "Weights: the measured scatter; means without sd take the coefficient of variation of the others.",
    "misfit": "No sd is given: equal relative weights, and the scatter is told by the misfit of the fit itself.",
    "surface": "No sd is given: only the scatter of the surface is counted, none of the measured force.",
}
