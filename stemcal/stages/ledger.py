"""The list of runs that the stages of a study require, each with its state and result."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from stemcal.runs.record import Run, is_final, outcome_of
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.design import StageRuns
from stemcal.stages.stage import STAGES, stages_of
from stemcal.stages.work import second_time
from stemcal.storage.rows import Rows
from stemcal.storage.typed import absent
from stemcal.study.model.study import Study


@dataclass(frozen=True)
class LedgerRow:
    """A required run: `status` is ok, censored, failed, left (not run) or damaged; `again` if it must be run again.

    `material` is the number (from 1) of the material in which it is run, if it is not the material of the study.
    """

    stage: str
    run: int
    key: str
    status: str
    response: float | None
    reason: str
    message: str
    again: bool
    condition: float
    levels: dict[str, float]
    replicate: int | None = absent()
    material: int | None = absent()
    started: str | None = None
    wall_seconds: float | None = None
    tries: int | None = None
    host: str | None = None
    stemcal: str | None = None

    @property
    def request(self) -> Request:
        pictured = self.material is None and self.stage in {stage.name for stage in STAGES.built_in if stage.pictured}
        return Request(self.stage, self.run - 1, self.levels, self.condition, pictured, self.replicate or 0)


def required_runs(study: Study, solver: Solver, folder: StudyFolder | None) -> list[StageRuns]:
    """Return the runs that each stage requires, as far as they are known now."""
    parts = [part for stage in stages_of(study) if (part := stage.foresee(study, solver, folder)) is not None]
    return [replace(part, requests=[*part.requests, *second_time(study, part.requests)[1:]]) for part in parts]


def missing(part: StageRuns, study: Study, solver: Solver, folder: StudyFolder | None) -> list[Request]:
    """Return the distinct runs of a stage that have no final record."""
    distinct = {key: request for key, request, _ in reversed(keyed(part, study, solver))}
    recorded = {key: folder.peek(key) for key in distinct} if folder is not None else {}
    return [
        request
        for key, request in reversed(distinct.items())
        if (record := recorded.get(key)) is None or not is_final(record, study.solver.run_limit)
        if not solver.has_result(request)
    ]


def keyed(part: StageRuns, study: Study, solver: Solver) -> list[tuple[str, Request, int | None]]:
    """Return the runs of a stage with their keys and the numbers of their materials (None for the study's own)."""
    runs = list[tuple[str, Request, int | None]]()
    runs += [(Run.of(solver, request).key, request, None) for request in part.requests]
    for number, requests in enumerate(part.in_materials, 1):
        other = make_solver(study.in_material(number))
        runs += [(Run.of(other, request).key, request, number) for request in requests]
    return runs


def ledger(study: Study, folder: StudyFolder) -> Rows[LedgerRow]:
    """Return the runs of all stages, as far as they are known now, in order."""
    solver = make_solver(study)
    return Rows(entries_of(required_runs(study, solver, folder), study, folder, solver))


def entries_of(wanted: Sequence[StageRuns], study: Study, folder: StudyFolder, solver: Solver) -> list[LedgerRow]:
    """Return the rows of the `wanted` runs, then of recorded runs of the stages that choose their runs one by one."""
    known = [entry for part in wanted if part.settled for entry in keyed(part, study, solver)]
    entries = [entry_of(request, key, study, folder, material) for key, request, material in known]
    stages, decided = {part.stage for part in wanted}, []
    own = {stage.name: stage.seen(study) for stage in stages_of(study) if stage.name not in stages}
    solvers = {name: solver if seen is study else make_solver(seen) for name, seen in own.items()}
    for key in sorted({*folder.keys()} - {key for key, *_ in known}):
        record = folder.peek(key)
        if record is not None and record["request"]["stage"] in solvers:
            request = Request(**record["request"])
            if Run.of(solvers[request.stage], request).key == key:
                decided.append(entry_of(request, key, study, folder))
    return entries + sorted(decided, key=lambda entry: (entry.stage, entry.run))


def entry_of(request: Request, key: str, study: Study, folder: StudyFolder, material: int | None = None) -> LedgerRow:
    """Return the row of a run, with its result if the run has a record."""
    record, problem = folder.examine(key)
    asked_for = request.stage, request.row + 1, key
    point = request.condition, dict(request.levels)
    which = request.replicate or None, material
    if record is None:
        return LedgerRow(*asked_for, "damaged" if problem else "left", None, "", "", True, *point, *which)
    outcome, again = outcome_of(record), not is_final(record, study.solver.run_limit)
    status = "failed" if not outcome.ok else "censored" if outcome.censored else "ok"
    names = ("started", "wall_seconds", "tries", "host", "stemcal")
    provenance = (record.get("provenance", {}).get(name) for name in names)
    return LedgerRow(
        *asked_for, status, outcome.response, outcome.reason, outcome.message, again, *point, *which, *provenance
    )
