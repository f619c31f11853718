"""Sentences that a stage adds to its notes because only the study knows them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stemcal.solvers.protocol import Solver
from stemcal.study.model import Study


def sign_remarks(study: Study, stage: Mapping[str, Any]) -> list[str]:
    """Point out significant effects whose sign is not the one the spec expects."""
    remarks = []
    for effect in stage["effects"]:
        expected = study.factor(effect["factor"]).expected_sign
        sign = "+" if effect["effect"] > 0.0 else "-"
        if expected is not None and effect["factor"] in stage["significant"] and sign != expected:
            remarks.append(
                f"{effect['factor']} has the effect {effect['effect']:+.4g} N where the spec expects the "
                f"sign {expected}: look for an alias or a wrong unit before trusting it."
            )
    return remarks


def error_remark(stage: Mapping[str, Any]) -> str | None:
    """Say what repeated runs, or mesh phases within the runs, tell; None if there are neither.

    A solver that computes gives equal answers to equal inputs; repeated runs that differ were not equal.
    """
    if phases := max((run.get("phases", 1) for run in stage["design"]["runs"]), default=1) - 1:
        return f"Every force is the mean over {phases + 1} places of the mesh; their scatter is the pure error."
    groups: dict[tuple[float, ...], list[float]] = {}
    for run in stage["design"]["runs"]:
        if run["force"] is not None:
            groups.setdefault(tuple(run["coded"].values()), []).append(run["force"])
    repeated = [forces for forces in groups.values() if len(forces) > 1]
    if not repeated:
        return None
    widest = max(repeated, key=lambda forces: max(forces) - min(forces))
    if max(widest) - min(widest) <= 1e-9 * max(map(abs, widest)):
        return "Repeated runs agree exactly: the solver is deterministic, and there is no pure error."
    return (
        f"{len(widest)} runs at the same levels gave {min(widest):g} to {max(widest):g} N. A deterministic "
        "solver gives one force for one set of levels, so these runs differed in something not recorded."
    )


def table_remarks(study: Study, solver: Solver) -> list[str]:
    """Warn that forces from a table belong to the levels the table was made with."""
    if solver.given_design("validate") is None:
        return []
    published = study.published.solution if study.published is not None else {}
    levels = ", ".join(f"{name} {value:g}" for name, value in published.items())
    where = f"the published solution ({levels})" if levels else "the levels the table was made with"
    return [f"The simulated forces are read from a table: they belong to {where}, not to this calibration."]
