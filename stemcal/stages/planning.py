"""What a study would run, before it runs: rows, distinct runs, runs already recorded, seconds."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from stemcal.errors import UsageError
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.answering import record_key
from stemcal.stages.foresight import foretell, quality
from stemcal.stages.layout import Design, screening_design, surface_design, surface_factors
from stemcal.stages.lineage import read_fresh, stage_before
from stemcal.stages.policy import stands
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

USUAL_FACTORS = 3


def plan(study: Study, folder: StudyFolder | None = None, solver: Solver | None = None) -> dict[str, Any]:
    """Return the runs of every stage without running any.

    Returns
    -------
    dict
        ``stages`` is a list of ``{stage, rows, distinct_runs, recorded, to_run, seconds, quality}``;
        ``seconds`` is the time on one core, None where the solver gives no estimate, ``quality`` the power
        and leverage of the design, None where there is none.
    """
    solver = solver or make_solver(study)
    wanted = asked(study, solver, folder)
    stages = [_count(part, study, solver, folder) for part in wanted]
    seconds = [stage["seconds"] for stage in stages]
    return {
        "schema_version": 1,
        "stage": "plan",
        "study": study.name,
        "stages": stages,
        "to_run": sum(stage["to_run"] for stage in stages),
        "seconds": None if None in seconds else sum(seconds),
        "notes": [part.remark for part in wanted if part.remark]
        + _decided_later(study)
        + [note for part in wanted if part.design is not None for note in foretell(part.design)],
    }


@dataclass(frozen=True)
class Asked:
    """What a stage asks of the solver; not `settled` as long as a stage before it has to decide."""

    stage: str
    requests: Sequence[Request]
    settled: bool
    remark: str = ""
    design: Design | None = None


def _decided_later(study: Study) -> list[str]:
    """Say how many runs may come on top, one by one."""
    later = {"climb": study.climb and study.climb.steps + 1, "refine": study.refine and study.refine.budget}
    return [f"{name} decides its runs one by one: {most} at most come on top." for name, most in later.items() if most]


def asked(study: Study, solver: Solver, folder: StudyFolder | None) -> list[Asked]:
    """Return what each stage asks of the solver, as far as it is known now."""
    screening = screening_design(study, solver)
    return [
        Asked("screen", screening.requests(study.targets.calibrate_at), settled=True, design=screening),
        _surface(study, solver, folder),
        _validate(study, solver, folder),
    ]


def _count(part: Asked, study: Study, solver: Solver, folder: StudyFolder | None) -> dict[str, Any]:
    distinct: dict[str, Request] = {}
    for request in part.requests:
        distinct.setdefault(record_key(solver, request), request)
    missing = [request for key, request in distinct.items() if not _recorded(key, study, folder)]
    return {
        "stage": part.stage,
        "rows": len(part.requests),
        "distinct_runs": len(distinct),
        "recorded": len(distinct) - len(missing),
        "to_run": len(missing),
        "seconds": _seconds(missing, solver),
        "quality": None if part.design is None else quality(part.design),
    }


def _recorded(key: str, study: Study, folder: StudyFolder | None) -> bool:
    record = folder.peek(key) if folder is not None else None
    return record is not None and stands(record, study.runs)


def _seconds(requests: Sequence[Request], solver: Solver) -> float | None:
    estimate = getattr(solver, "cost_estimate", None)
    if estimate is None:
        return None
    return float(sum(estimate(request) for request in requests))


def _surface(study: Study, solver: Solver, folder: StudyFolder | None) -> Asked:
    known = _surface_names(study, solver, folder)
    names = known or [factor.name for factor in study.factors[:USUAL_FACTORS]]
    design = surface_design(study, solver, names)
    diameters = [study.targets.calibrate_at, *(target.diameter for target in study.joint_targets)]
    requests = [request for diameter in dict.fromkeys(diameters) for request in design.requests(diameter)]
    remark = f"The screening decides which factors the surface has; {len(names)} are assumed for the plan."
    return Asked("rsm", requests, known is not None, "" if known else remark, design)


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


def _validate(study: Study, solver: Solver, folder: StudyFolder | None) -> Asked:
    """Return a run per diameter, at the solution if there is one, else at mid-levels."""
    levels = None
    if folder is not None:
        with suppress(UsageError):
            levels = read_fresh(study, solver, folder, stage_before(study, "validate") or "invert")["parameters"]
    middle = study.midlevels() if levels is None else levels
    requests = [Request("validate", row, middle, target.diameter) for row, target in enumerate(study.targets.forces)]
    return Asked("validate", requests, settled=levels is not None)
