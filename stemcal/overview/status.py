"""Every run that a study asks for and its result, and whether each file is sound: `status` and `run --retry`."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stemcal.errors import UsageError
from stemcal.overview.plan import asked
from stemcal.runs.answer import Watch, answer_all, watch_nothing
from stemcal.runs.executors import RunExecutor
from stemcal.runs.record import Run, outcome_of, stands
from stemcal.runs.study_folder import SCHEMA_VERSION as FILE_VERSION
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.design import Asked
from stemcal.stages.fresh import CODE, changed_tables, changes_since
from stemcal.stages.result import read_result
from stemcal.stages.stage import STAGES, stage_called, stages_known, stages_of
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.storage.rows import Rows
from stemcal.storage.typed import absent
from stemcal.study.model.study import Study

SCHEMA_VERSION = 2


@dataclass(frozen=True)
class LedgerRow:
    """One row of a stage: what was asked and, if a record answers it, what came of it.

    `status` is ok, censored, failed, left or damaged; `again`: whether the next command repeats the run.
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
    started: str | None = None
    wall_seconds: float | None = None
    tries: int | None = None
    host: str | None = None
    stemcal: str | None = None

    @property
    def request(self) -> Request:
        """What was asked."""
        pictured = self.stage in {stage.name for stage in STAGES.built_in if stage.pictured}
        return Request(self.stage, self.run - 1, self.levels, self.condition, pictured, self.replicate or 0)


@dataclass(frozen=True)
class StageStatus:
    """How far a stage is; `rows` and `left` are None as long as a stage before it has to decide."""

    stage: str
    rows: int | None
    done: int
    censored: int
    failed: int
    reasons: dict[str, int]
    left: int | None
    damaged: int
    file: str
    changed: tuple[str, ...]


@dataclass(frozen=True)
class Status:
    """The progress and the verdict of a study; `working` names the process that is using its folder, or is None.

    `sheet` is the sheet in which results are awaited, if any.
    """

    schema_version: int
    stage: str
    study: str
    folder: str
    working: str | None
    stages: tuple[StageStatus, ...]
    verdict: Verdict
    sheet: str | None = absent()


def ledger(study: Study, folder: StudyFolder, solver: Solver | None = None) -> Rows[LedgerRow]:
    """Return the runs of all stages whose runs are known by now, in order."""
    solver = solver or make_solver(study)
    return Rows(_entries(asked(study, solver, folder), study, folder, solver))


def _entries(wanted: Sequence[Asked], study: Study, folder: StudyFolder, solver: Solver) -> list[LedgerRow]:
    requests = [request for part in wanted if part.settled for request in part.requests]
    keys = [Run.of(solver, request).key for request in requests]
    entries = [_entry(request, key, study, folder) for request, key in zip(requests, keys, strict=True)]
    stages = {part.stage for part in wanted}
    return entries + sorted(_others(set(keys), stages, study, folder, solver), key=lambda e: (e.stage, e.run))


def _entry(request: Request, key: str, study: Study, folder: StudyFolder) -> LedgerRow:
    record, problem = folder.examine(key)
    asked_for = request.stage, request.row + 1, key
    levels, replicate = dict(request.levels), request.replicate or None
    if record is None:
        status = "damaged" if problem else "left"
        return LedgerRow(*asked_for, status, None, "", "", True, request.condition, levels, replicate)
    outcome = outcome_of(record)
    status = "failed" if not outcome.ok else "censored" if outcome.censored else "ok"
    said: Mapping[str, Any] = record.get("provenance", {})
    return LedgerRow(
        *asked_for,
        status,
        outcome.response,
        outcome.reason,
        outcome.message,
        not stands(record, study.solver.run_limit),
        request.condition,
        levels,
        replicate,
        *(said.get(name) for name in ("started", "wall_seconds", "tries", "host", "stemcal")),
    )


def _others(
    known: Collection[str], stages: Collection[str], study: Study, folder: StudyFolder, solver: Solver
) -> Iterator[LedgerRow]:
    """Yield the records of stages that decide from run to run what to ask next, those of this spec alone."""
    own = {stage.name: stage.seen(study) for stage in stages_of(study) if stage.name not in stages}
    solvers = {name: solver if seen is study else make_solver(seen) for name, seen in own.items()}
    for key in folder.keys():  # noqa: SIM118
        record = folder.peek(key) if key not in known else None
        if record is None or record["request"]["stage"] not in solvers:
            continue
        request = Request(**record["request"])
        if Run.of(solvers[request.stage], request).key == key:
            yield _entry(request, key, study, folder)


# ---- status


def stage_states(study: Study, folder: StudyFolder) -> Status:
    """Return for every stage how many of its rows are done, failed and why, and left."""
    solver = make_solver(study)
    wanted = asked(study, solver, folder)
    entries = _entries(wanted, study, folder, solver)
    decided = {part.stage: part.settled for part in wanted}
    left = {stage.name for stage in stages_known(study) if folder.has_stage(stage.name)}
    seen = {*decided, *(entry.stage for entry in entries), *left}
    named = [stage.name for stage in stages_known(study) if stage.name in seen]
    stages = [
        _stage(study, solver, folder, name, [e for e in entries if e.stage == name], decided.get(name, True))
        for name in named
    ]
    verdict = verdict_of(study, folder)
    return Status(SCHEMA_VERSION, "status", study.name, str(folder.path), folder.holder(), tuple(stages), verdict)


def _stage(
    study: Study, solver: Solver, folder: StudyFolder, name: str, entries: Sequence[LedgerRow], settled: bool
) -> StageStatus:
    found = Counter(entry.status for entry in entries)
    reasons = Counter(entry.reason for entry in entries if entry.status == "failed")
    file, changed = _file(study, solver, folder, name)
    return StageStatus(
        stage=name,
        rows=len(entries) if settled else None,
        done=found["ok"] + found["censored"],
        censored=found["censored"],
        failed=found["failed"],
        reasons=dict(reasons.most_common()),
        left=found["left"] + found["damaged"] if settled else None,
        damaged=found["damaged"],
        file=file,
        changed=tuple(changed),
    )


def _file(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> tuple[str, list[str]]:
    """Return whether a stage has left its file, and what has changed since: before it too, on which it rests."""
    if not folder.has_stage(stage):
        return "none", []
    try:
        changed = changes_since(study, solver, folder, stage)
        if CODE not in changed:  # of other code it may have another shape
            read_result(folder, stage_called(stage).result())
    except UsageError:
        return "damaged", []
    before = stage_called(stage).needs(study)
    if not changed and before is not None and _file(study, solver, folder, before)[0] != "fresh":
        changed = [f"{before}.json"]
    return "stale" if changed else "fresh", changed


# ---- retry


def retry(study: Study, folder: StudyFolder, executor: RunExecutor, watch: Watch = watch_nothing) -> list[LedgerRow]:
    """Compute failed runs again; return what came of them.

    A record is replaced when its new answer is there, not before.
    """
    with folder:
        failed = {e.key: e for e in reversed(ledger(study, folder)) if e.status == "failed"}
        chosen = list(reversed(failed.values()))
        for stage in dict.fromkeys(entry.stage for entry in chosen):
            requests = [entry.request for entry in chosen if entry.stage == stage]
            own = make_solver(stage_called(stage).seen(study)).placed(folder.work)
            answer_all(requests, own, folder, executor, watch, study.solver.run_limit, 0.0, {one.key for one in chosen})
        return [_entry(entry.request, entry.key, study, folder) for entry in chosen]


# ---- verify


def inspect(study: Study, folder: StudyFolder) -> tuple[int, dict[str, str]]:
    """Return the number of records, and what is wrong with damaged files; change nothing.

    Every record is checked against its seal and its name, every stage file against its form and its tables.
    """
    solver, keys = make_solver(study), folder.keys()
    damaged = {f"runs/{key}.json": folder.examine(key)[1] for key in keys}
    for stage in (stage for stage in stages_known(study) if folder.has_stage(stage.name)):
        name = f"{stage.name}.json"
        try:
            content = folder.examine_stage(stage.name)
            if (version := content.get("schema_version")) != FILE_VERSION:
                damaged[name] = f"has schema version {version!r:.20}, but version {FILE_VERSION} is required"
                continue
            if CODE not in changes_since(study, solver, folder, stage.name):  # of other code it may have another shape
                tables = changed_tables(stage.result().from_json(content), folder)
                changed_file = "is missing or has been changed; `stemcal run SPEC` writes the file again"
                damaged |= dict.fromkeys(tables, changed_file)
        except UsageError as error:
            damaged[name] = str(error).removeprefix(str(folder.path / name)).removeprefix(name).lstrip(": ")
    return len(keys), {file: problem for file, problem in damaged.items() if problem}
