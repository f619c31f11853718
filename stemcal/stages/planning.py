"""What a study would run, before it runs: rows, distinct runs, runs already recorded, seconds."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from stemcal.errors import UsageError
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.answering import ACCIDENTS, record_key
from stemcal.stages.layout import screening_design, surface_design, surface_factors
from stemcal.stages.lineage import read_fresh, stage_before
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

USUAL_FACTORS = 3


def plan(study: Study, folder: StudyFolder | None = None, solver: Solver | None = None) -> dict[str, Any]:
    """Return the runs of every stage without running any.

    Returns
    -------
    dict
        ``stages`` is a list of ``{stage, rows, distinct_runs, recorded, to_run, seconds}``; ``seconds`` is
        the time on one core, None where the solver gives no estimate.
    """
    solver = solver or make_solver(study)
    notes: list[str] = []
    stages = [
        _count(stage, requests(study, solver, folder, notes), solver, folder) for stage, requests in _REQUESTS.items()
    ]
    seconds = [stage["seconds"] for stage in stages]
    return {
        "schema_version": 1,
        "stage": "plan",
        "study": study.name,
        "stages": stages,
        "to_run": sum(stage["to_run"] for stage in stages),
        "seconds": None if None in seconds else sum(seconds),
        "notes": notes,
    }


def _count(stage: str, requests: Sequence[Request], solver: Solver, folder: StudyFolder | None) -> dict[str, Any]:
    distinct: dict[str, Request] = {}
    for request in requests:
        distinct.setdefault(record_key(solver, request), request)
    missing = [request for key, request in distinct.items() if not _recorded(key, folder)]
    return {
        "stage": stage,
        "rows": len(requests),
        "distinct_runs": len(distinct),
        "recorded": len(distinct) - len(missing),
        "to_run": len(missing),
        "seconds": _seconds(missing, solver),
    }


def _recorded(key: str, folder: StudyFolder | None) -> bool:
    record = folder.peek(key) if folder is not None else None
    return record is not None and record["reason"] not in ACCIDENTS


def _seconds(requests: Sequence[Request], solver: Solver) -> float | None:
    estimate = getattr(solver, "cost_estimate", None)
    if estimate is None:
        return None
    return float(sum(estimate(request) for request in requests))


def _screen(study: Study, solver: Solver, _folder: StudyFolder | None, _notes: list[str]) -> list[Request]:
    return screening_design(study, solver).requests(study.targets.calibrate_at)


def _surface(study: Study, solver: Solver, folder: StudyFolder | None, notes: list[str]) -> list[Request]:
    names = _surface_names(study, solver, folder)
    if names is None:
        names = [factor.name for factor in study.factors[:USUAL_FACTORS]]
        notes.append(f"The screening decides which factors the surface has; {len(names)} are assumed for the plan.")
    return surface_design(study, solver, names).requests(study.targets.calibrate_at)


def _surface_names(study: Study, solver: Solver, folder: StudyFolder | None) -> list[str] | None:
    """Return the factors of the surface as far as they are known now."""
    before = stage_before(study, "rsm")
    given = solver.given_design("rsm")
    if before is None:
        return surface_factors(study, solver, None)[0]
    if given is not None:
        return [name for name in given[0] if name in study.names]
    if folder is None:
        return None
    try:
        screening = read_fresh(study, solver, folder, before)
    except UsageError:
        return None
    return surface_factors(study, solver, screening)[0]


def _validate(study: Study, solver: Solver, folder: StudyFolder | None, _notes: list[str]) -> list[Request]:
    """Return a run per diameter, at the solution if there is one, else at mid-levels."""
    levels = study.midlevels()
    if folder is not None:
        with suppress(UsageError):
            levels = read_fresh(study, solver, folder, "invert")["parameters"]
    return [Request("validate", row, levels, t.diameter) for row, t in enumerate(study.targets.forces)]


_REQUESTS = {"screen": _screen, "rsm": _surface, "validate": _validate}
