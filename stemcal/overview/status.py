"""The status of a study: its runs by stage, its files and its verdict; also the repetition of failed runs."""

from collections import Counter
from dataclasses import dataclass

from stemcal.errors import UsageError
from stemcal.runs.answer import Watch, answer_all, watch_nothing
from stemcal.runs.executors import RunExecutor
from stemcal.runs.study_folder import SCHEMA_VERSION as FILE_VERSION
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Solver
from stemcal.stages.fresh import CODE, changed_tables, changes_since
from stemcal.stages.ledger import LedgerRow, entries_of, entry_of, ledger, required_runs
from stemcal.stages.result import read_result
from stemcal.stages.stage import stage_called, stages_known
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.storage.typed import absent
from stemcal.study.model.study import Study

SCHEMA_VERSION = 2


@dataclass(frozen=True)
class StageStatus:
    """Progress of a stage.

    rows, left  number of runs, and of runs not done; None if they depend on an earlier stage
    censored    number of runs whose response is only a lower bound
    reasons     number of failed runs by reason
    damaged     number of runs with a damaged record
    file        state of the result file: none, fresh, stale or damaged
    changed     inputs that have changed since the file was written
    """

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
    """Progress and verdict of a study, the process that uses its folder (`working`), and the path of its run sheet."""

    schema_version: int
    stage: str
    study: str
    folder: str
    working: str | None
    stages: tuple[StageStatus, ...]
    verdict: Verdict
    sheet: str | None = absent()


def stage_states(study: Study, folder: StudyFolder) -> Status:
    """Return the status of a study, with the progress of every stage."""
    solver = make_solver(study)
    wanted = required_runs(study, solver, folder)
    entries = entries_of(wanted, study, folder, solver)
    decided = {part.stage: part.settled for part in wanted}
    left = {stage.name for stage in stages_known(study) if folder.has_stage(stage.name)}
    seen = {*decided, *(entry.stage for entry in entries), *left}
    stages = []
    for name in (stage.name for stage in stages_known(study) if stage.name in seen):
        rows = [entry for entry in entries if entry.stage == name]
        counts, settled = Counter(row.status for row in rows), decided.get(name, True)
        file, changed = _file(study, solver, folder, name)
        status = StageStatus(
            stage=name,
            rows=len(rows) if settled else None,
            done=counts["ok"] + counts["censored"],
            censored=counts["censored"],
            failed=counts["failed"],
            reasons=dict(Counter(row.reason for row in rows if row.status == "failed").most_common()),
            left=counts["left"] + counts["damaged"] if settled else None,
            damaged=counts["damaged"],
            file=file,
            changed=tuple(changed),
        )
        stages.append(status)
    verdict = verdict_of(study, folder)
    return Status(SCHEMA_VERSION, "status", study.name, str(folder.path), folder.holder(), tuple(stages), verdict)


def _file(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> tuple[str, list[str]]:
    if not folder.has_stage(stage):
        return "none", []
    try:
        changed = changes_since(study, solver, folder, stage)
        if CODE not in changed:  # other code may have written another format
            read_result(folder, stage_called(stage).result())
    except UsageError:
        return "damaged", []
    before = stage_called(stage).needs(study)
    if not changed and before is not None and _file(study, solver, folder, before)[0] != "fresh":
        changed = [f"{before}.json"]
    return "stale" if changed else "fresh", changed


def retry(study: Study, folder: StudyFolder, executor: RunExecutor, watch: Watch = watch_nothing) -> list[LedgerRow]:
    """Repeat the failed runs and return them; a record is replaced when the new result is complete."""
    with folder:
        failed = {e.key: e for e in reversed(ledger(study, folder)) if e.status == "failed"}
        chosen = list(reversed(failed.values()))
        for stage, material in dict.fromkeys((entry.stage, entry.material) for entry in chosen):
            requests = [entry.request for entry in chosen if (entry.stage, entry.material) == (stage, material)]
            seen = stage_called(stage).seen(study) if material is None else study.in_material(material)
            solver = make_solver(seen).placed(folder.work)
            keys = {entry.key for entry in chosen}
            answer_all(requests, solver, folder, executor, watch, study.solver.run_limit, 0.0, keys)
        return [entry_of(entry.request, entry.key, study, folder, entry.material) for entry in chosen]


def inspect(study: Study, folder: StudyFolder) -> tuple[int, dict[str, str]]:
    """Return the number of records, and the faults of damaged records, result files and tables by file name."""
    solver, keys = make_solver(study), folder.keys()
    damaged = {f"runs/{key}.json": folder.examine(key)[1] for key in keys}
    for stage in (stage for stage in stages_known(study) if folder.has_stage(stage.name)):
        name = f"{stage.name}.json"
        try:
            content = folder.examine_stage(stage.name)
            if (version := content.get("schema_version")) != FILE_VERSION:
                damaged[name] = f"has schema version {version!r:.20}, but version {FILE_VERSION} is required"
                continue
            if CODE not in changes_since(study, solver, folder, stage.name):  # other code may write another format
                tables = changed_tables(stage.result().from_json(content), folder)
                changed_file = "is missing or has been changed; `stemcal run SPEC` writes the file again"
                damaged |= dict.fromkeys(tables, changed_file)
        except UsageError as error:
            damaged[name] = str(error).removeprefix(str(folder.path / name)).removeprefix(name).lstrip(": ")
    return len(keys), {file: problem for file, problem in damaged.items() if problem}
