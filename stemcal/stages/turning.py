"""From the surface of ``rsm.json`` back to parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.stages.certainty import Measured, certainty, misfit_over
from stemcal.study.model import Study

if TYPE_CHECKING:
    from stemcal.doe.coding import Coding
    from stemcal.doe.regression import Array
    from stemcal.doe.surface import Surface
    from stemcal.doe.within import Within


def solve(study: Study, stage: Mapping[str, Any]) -> dict[str, Any]:
    """Return the calibrated point, what is known about it, and every factor's level there."""
    from stemcal.doe.inversion import solve_target
    from stemcal.doe.region import Region

    coding, surface = coding_of(stage), surface_of(stage)
    low, high = box_of(study, coding)
    target = study.calibration_target
    result = solve_target(surface, target.force, low, high, stage["radius"], study.invert.rule)
    found = result.as_dict(coding)
    region = Region(low, high, stage["radius"])
    misfit = misfit_over([Measured(target.diameter, "force", target.force, target.sd, target.n)], [surface])
    sure = certainty(study, coding, misfit, region, f"{target.diameter:g} mm alone")
    return {
        **found,
        "certainty": sure,
        "notes": found["notes"] + sure["sentences"],
        "diameter": target.diameter,
        "target_sd": target.sd,
        "target_n": target.n,
        "parameters": {**study.midlevels(), **found["solution"]},
    }


def assess_published(study: Study, stage: Mapping[str, Any]) -> tuple[dict[str, Any] | None, list[str]]:
    """Return what the surface says of the published solution, and remarks; (None, []) if there is none."""
    if study.published is None or not study.published.solution:
        return None, []
    from stemcal.doe.inversion import assess_point

    coding, surface = coding_of(stage), surface_of(stage)
    given = study.published.solution
    missing = [name for name in coding.names if name not in given]
    natural = [given.get(name, centre) for name, centre in zip(coding.names, coding.centre, strict=True)]
    point = assess_point(surface, coding.to_coded(natural), *box_of(study, coding), stage["radius"])
    target = study.calibration_target.force
    remarks = [
        f"At the published solution the surface predicts {point.predicted:.2f} N, "
        f"{point.predicted - target:+.2f} N from the target; it is one point of the solution set."
    ]
    if missing:
        remarks.append(f"The published solution has no {', '.join(missing)}; the centre is taken.")
    if not point.inside:
        remarks.append("The published solution lies outside the design region: the surface extrapolates there.")
    return {**point.as_dict(coding), "difference": point.predicted - target}, remarks


def surface_of(stage: Mapping[str, Any], further: Sequence[tuple[Array, float]] = ()) -> Surface:
    """Fit the surface of a stage file again, from the runs it lists and `further` ones (coded point, force)."""
    return surface_through(stage, stage["design"]["runs"], further)


def surface_through(
    stage: Mapping[str, Any],
    answered: Sequence[Mapping[str, Any]],
    further: Sequence[tuple[Array, float]] = (),
    response: str = "force",
) -> Surface:
    """Fit a surface to the design of a stage file with a response of these runs, in the design's order."""
    from stemcal.doe.surface import fit_surface

    names, runs = stage["names"], stage["design"]["runs"]
    coded = [[run["coded"][name] for name in names] for run in runs]
    coded += [point.tolist() for point, _ in further]
    known = circumstances(runs, answered, response, len(further))
    values = [float("nan") if run.get(response) is None else run[response] for run in answered]
    terms = [row["term"] for row in stage["coefficients"]]
    drop = stage.get("inestimable") == "drop"
    return fit_surface(coded, values + [value for _, value in further], names, terms, drop=drop, **known)


def circumstances(
    design: Sequence[Mapping[str, Any]], answered: Sequence[Mapping[str, Any]], response: str, further: int = 0
) -> dict[str, Any]:
    """Return the blocks, weights and scatter of runs as `fit_surface` takes them.

    Points added later count to the last block, with the mean weight; their scatter is not counted.
    """
    known: dict[str, Any] = {}
    if any("block" in run for run in design):
        labels = [run.get("block", "") for run in design]
        known["blocks"] = labels + [labels[-1]] * further
    if response == "force" and any("weight" in run for run in answered):
        known["weights"] = [run.get("weight", 1.0) for run in answered] + [1.0] * further
    if response == "force" and any("sd" in run for run in answered):
        known["within"] = _within([*answered, *({} for _ in range(further))])
    return known


def _within(runs: Sequence[Mapping[str, Any]]) -> Within:
    import numpy as np

    from stemcal.doe.within import Within

    most = max(run.get("phases", 0) for run in runs)
    empty = [np.nan] * most
    forces = [run.get("phase_forces", empty) for run in runs]
    same = all(len(values) == most for values in forces)
    return Within(
        np.array([run.get("sd", np.nan) for run in runs]),
        np.array([run.get("phases", 0) for run in runs]),
        np.array(forces, dtype=float) if same else None,
    )


def weighed(study: Study, runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Add to the runs the weight that their scatter over mesh phases gives them, if the spec asks for it."""
    if study.rsm.weights != "phases":
        return runs
    import numpy as np

    from stemcal.doe.within import moderated_weights

    weights = moderated_weights([run.get("sd", np.nan) for run in runs], [run.get("phases", 0) for run in runs])
    return [{**run, "weight": float(weight)} for run, weight in zip(runs, weights, strict=True)]


def coding_of(stage: Mapping[str, Any]) -> Coding:
    """Return the coding of a stage file."""
    from stemcal.doe.coding import Coding

    entries = stage["factors"]
    return Coding(
        tuple(entry["factor"] for entry in entries),
        tuple(entry["center"] for entry in entries),
        tuple(entry["half_step"] for entry in entries),
    )


def box_of(study: Study, coding: Coding) -> tuple[Array, Array]:
    """Return the factors' low and high ends, coded."""
    factors = [study.factor(name) for name in coding.names]
    return coding.to_coded([f.low for f in factors]), coding.to_coded([f.high for f in factors])
