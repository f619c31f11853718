"""Every run that a study asks for and its result, and whether each file is sound: `status` and `run --retry`."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from stemcal.errors import UsageError
from stemcal.runs.answer import Watch, answer_all, watch_nothing
from stemcal.runs.executors import RunExecutor
from stemcal.runs.study_folder import SCHEMA_VERSION as FILE_VERSION
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Solver
from stemcal.stages.fresh import CODE, changed_tables, changes_since
from stemcal.stages.ledger import LedgerRow, asked, entries_of, entry_of, ledger
from stemcal.stages.result import read_result
from stemcal.stages.stage import stage_called, stages_known
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.storage.typed import absent
from stemcal.study.model.study import Study

SCHEMA_VERSION = 2


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
    """Progress and verdict of a study, the process `working` in its folder, and the `sheet` that awaits results."""

    schema_version: int
    stage: str
    study: str
    folder: str
    working: str | None
    stages: tuple[StageStatus, ...]
    verdict: Verdict
    sheet: str | None = absent()


def stage_states(study: Study, folder: StudyFolder) -> Status:
    """Return for every stage how many of its rows are done, failed and why, and left."""
    solver = make_solver(study)
    wanted = asked(study, solver, folder)
    entries = entries_of(wanted, study, folder, solver)
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
    counts = Counter(entry.status for entry in entries)
    reasons = Counter(entry.reason for entry in entries if entry.status == "failed")
    file, changed = _file(study, solver, folder, name)
    return StageStatus(
        stage=name,
        rows=len(entries) if settled else None,
        done=counts["ok"] + counts["censored"],
        censored=counts["censored"],
        failed=counts["failed"],
        reasons=dict(reasons.most_common()),
        left=counts["left"] + counts["damaged"] if settled else None,
        damaged=counts["damaged"],
        file=file,
        changed=tuple(changed),
    )


def _file(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> tuple[str, list[str]]:
    """Return the state of a stage file, and the changed inputs, those of earlier stages among them."""
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


def retry(study: Study, folder: StudyFolder, executor: RunExecutor, watch: Watch = watch_nothing) -> list[LedgerRow]:
    """Compute failed runs again and return the outcomes; a record is replaced only once its new answer is there."""
    with folder:
        failed = {e.key: e for e in reversed(ledger(study, folder)) if e.status == "failed"}
        chosen = list(reversed(failed.values()))
        for stage in dict.fromkeys(entry.stage for entry in chosen):
            requests = [entry.request for entry in chosen if entry.stage == stage]
            own = make_solver(stage_called(stage).seen(study)).placed(folder.work)
            answer_all(requests, own, folder, executor, watch, study.solver.run_limit, 0.0, {one.key for one in chosen})
        return [entry_of(entry.request, entry.key, study, folder) for entry in chosen]


def inspect(study: Study, folder: StudyFolder) -> tuple[int, dict[str, str]]:
    """Return the number of records and the faults of damaged files by seal, name, form and tables; change nothing."""
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
