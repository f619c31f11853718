"""Several diameters at once: the design of the surface run at each, and the parameters that fit them together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.artefacts import reasons_given, run_entry
from stemcal.stages.certainty import certainty, misfit_over
from stemcal.stages.layout import Design
from stemcal.stages.turning import box_of, coding_of, surface_through
from stemcal.study.model import Study, Target

if TYPE_CHECKING:
    from stemcal.doe.coding import Coding
    from stemcal.doe.joint import JointFit
    from stemcal.doe.misfit import Misfit
    from stemcal.doe.region import Region
    from stemcal.doe.surface import Surface

AnswerAll = Callable[[Sequence[Request]], list[Answer]]


def run_diameters(
    study: Study, stage: Mapping[str, Any], design: Design, solver: Solver, answer: AnswerAll
) -> list[dict[str, Any]]:
    """Run the design at every diameter of the joint fit and fit a surface to each; empty without a joint fit.

    `stage` holds the surface of the calibration diameter; the others take the same terms.
    """
    return [_at_diameter(target, stage, design, solver, answer) for target in study.joint_targets]


def _at_diameter(
    target: Target, stage: Mapping[str, Any], design: Design, solver: Solver, answer: AnswerAll
) -> dict[str, Any]:
    requests = design.requests(target.diameter)
    answers = answer(requests)
    runs = [
        {"run": request.row + 1, **run_entry(request, given, solver)}
        for request, given in zip(requests, answers, strict=True)
    ]
    with reasons_given(requests, answers):
        told = surface_through(stage, runs).as_dict()
    kept = ("coefficients", "r2", "adjusted_r2", "predicted_r2", "press", "cv_percent", "runs_failed")
    return {"diameter": target.diameter, "runs": runs, **{name: told[name] for name in kept}}


def solve_jointly(study: Study, stage: Mapping[str, Any]) -> dict[str, Any]:
    """Return the contents of ``invert.json`` for a joint fit over the diameters of the spec."""
    from stemcal.doe.inversion import assess_point
    from stemcal.doe.joint import fit_jointly
    from stemcal.doe.region import Region

    coding, surfaces = coding_of(stage), _surfaces(study, stage)
    region = Region(*box_of(study, coding), stage["radius"])
    misfit = misfit_over(study.joint_targets, surfaces)
    fit = fit_jointly(misfit, region)
    target = study.calibration_target
    at_target = surface_through(stage, stage["design"]["runs"])
    point = assess_point(at_target, fit.coded, region.low, region.high, region.radius).as_dict(coding)
    sure = certainty(study, coding, misfit, region, "the joint fit")
    single = _alone(study, misfit, fit) or misfit_over([target], [at_target])
    alone = certainty(study, coding, single, region, f"{target.diameter:g} mm alone")
    joint = _joint_entry(study, coding, misfit, region, fit)
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


def _alone(study: Study, misfit: Misfit, fit: JointFit) -> Misfit | None:
    """Return the misfit of the calibration diameter by itself; None if the joint fit leaves it out."""
    diameters = [target.diameter for target in study.joint_targets]
    at = study.calibration_target.diameter
    return misfit.alone(diameters.index(at), fit.misfit) if at in diameters else None


def _surfaces(study: Study, stage: Mapping[str, Any]) -> list[Surface]:
    runs = {entry["diameter"]: entry["runs"] for entry in stage["diameters"]}
    return [surface_through(stage, runs[target.diameter]) for target in study.joint_targets]


def _joint_entry(study: Study, coding: Coding, misfit: Misfit, region: Region, fit: JointFit) -> dict[str, Any]:
    from stemcal.doe.joint import best_worst_error, leave_one_out

    worst, where = best_worst_error(misfit, region)
    left_out = leave_one_out(misfit, region)
    without: Sequence[float | None] = left_out or [None]
    errors = zip(study.joint_targets, fit.predicted, fit.errors_percent, without, strict=True)
    rows = [
        {
            "diameter": target.diameter,
            "measured": target.force,
            "sd": target.sd,
            "n": target.n,
            "predicted": float(predicted),
            "error_percent": float(error),
            "left_out_error_percent": apart,
        }
        for target, predicted, error, apart in errors
    ]
    return {
        "rows": rows,
        "scatter": misfit.scatter,
        "misfit": fit.misfit if misfit.scale_known else None,
        "df": fit.df,
        "p": fit.p_value,
        "max_abs_error_percent": fit.max_abs_error_percent,
        "max_abs_left_out_error_percent": max((abs(error) for error in left_out), default=None),
        "best_worst_error_percent": worst,
        "best_worst_solution": dict(zip(coding.names, map(float, coding.to_natural(where)), strict=True)),
    }


def _notes(joint: Mapping[str, Any], misfit: Misfit, fit: JointFit) -> list[str]:
    notes = [
        f"Over {len(joint['rows'])} diameters the surfaces miss the measured forces by at most "
        f"{joint['max_abs_error_percent']:.1f} %; no point of the region brings the largest error below "
        f"{joint['best_worst_error_percent']:.1f} %."
    ]
    if joint["max_abs_left_out_error_percent"] is not None:
        notes.append(
            "Each diameter predicted from a fit to the others is missed by at most "
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
    "pooled": "Weights: the measured scatter; diameters without sd take the coefficient of variation of the others.",
    "misfit": "No sd is given: equal relative weights, and the scatter is told by the misfit of the fit itself.",
    "surface": "No sd is given: only the scatter of the surface is counted, none of the measured force.",
}
