"""The climb between screening and surface: active factors stepped together towards the target."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stemcal.errors import RunsFailed
from stemcal.solvers.protocol import Solver
from stemcal.stages.layout import surface_factors, surface_options
from stemcal.stages.stepping import Simulate
from stemcal.study.model import ClimbOptions, CodingEntry, Study


def climb_to_target(study: Study, solver: Solver, screening: Mapping[str, Any], simulate: Simulate) -> dict[str, Any]:
    """Return the contents of ``climb.json``: every step, the best one, and the design centred on it."""
    from stemcal.doe.ascent import ascent_path, nearest_step, passed

    names, chosen = surface_factors(study, solver, screening)
    effects = {effect["factor"]: effect["effect"] for effect in screening["effects"]}
    options, target = study.climb or ClimbOptions(), study.calibration_target.force
    rows = [_row(study, 0, dict.fromkeys(names, 0.0), target, simulate)]
    if rows[0]["force"] is None:
        raise RunsFailed(f"climb: the run at mid-levels failed ({rows[0]['reason']}): {rows[0]['message']}")
    rise = rows[0]["force"] < target
    for step, point in enumerate(ascent_path([effects[name] for name in names], options.steps, rise)[1:], 1):
        rows.append(_row(study, step, dict(zip(names, map(float, point), strict=True)), target, simulate))
        if passed([row["force"] for row in rows], target):
            break
    forces = [row["force"] for row in rows]
    best = rows[nearest_step(forces, target)]
    return {
        "target": target,
        "diameter": study.targets.calibrate_at,
        "names": names,
        "rows": rows,
        "best_step": best["step"],
        "passed": passed(forces, target),
        "solution": {name: best["levels"][name] for name in names},
        "error_percent": best["error_percent"],
        "coding": {name: _around(study, name, best["levels"][name], len(names), options) for name in names},
        "effects": screening["effects"],
        "significant": screening["significant"],
        "notes": chosen + _notes(rows, best, passed(forces, target)),
    }


def recentred(study: Study, stage: Mapping[str, Any] | None) -> Study:
    """Return the study with the coding that a climb found; what the spec itself codes stays."""
    if stage is None or stage["stage"] != "climb":
        return study
    found = {name: CodingEntry(**entry) for name, entry in stage["coding"].items()}
    return study.model_copy(update={"rsm": study.rsm.model_copy(update={"coding": {**found, **study.rsm.coding}})})


def _row(study: Study, step: int, coded: dict[str, float], target: float, simulate: Simulate) -> dict[str, Any]:
    levels = study.midlevels()
    for name, value in coded.items():
        factor = study.factor(name)
        levels[name] = float(f"{factor.centre + factor.half_range * value:.12g}")
    entry = simulate(step, levels)
    error = None if entry["force"] is None else 100.0 * (target - entry["force"]) / target
    return {"step": step, "levels": levels, "coded": coded, "error_percent": error, **entry}


def _around(study: Study, name: str, level: float, k: int, options: ClimbOptions) -> dict[str, float]:
    """Return the coding of a design that reaches over a share of the range about a level, inside the range."""
    from stemcal.doe.designs import surface_reach

    factor, reach = study.factor(name), surface_reach(k, surface_options(study))
    span = options.shrink * factor.half_range
    center = min(max(level, factor.low + span), factor.high - span)
    return {"center": float(f"{center:.12g}"), "half_step": float(f"{span / reach:.12g}")}


def _notes(rows: list[dict[str, Any]], best: Mapping[str, Any], through: bool) -> list[str]:
    notes = [
        f"Of {len(rows)} steps along the slope of the screening, step {best['step']} is nearest to the target "
        f"({best['error_percent']:+.1f} %): the surface is centred there."
    ]
    if not through:
        notes.append(
            "The walk ended at the edge of the ranges before the force passed the target: the target may lie outside; "
            "widen the ranges, or see whether the force can reach it at all."
        )
    return notes
