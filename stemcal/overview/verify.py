"""Is the study folder sound? Every record against its seal and its name, every stage against its spec."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.folder.study_folder import SCHEMA_VERSION, StudyFolder
from stemcal.overview.plan import asked
from stemcal.runs.outcome import record_key
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Asked
from stemcal.stages.fresh import CODE, changed_tables, changes_since
from stemcal.stages.stage import Stage, stages_known
from stemcal.study.model import Study

_CHANGED = "is missing or was changed; `stemcal run SPEC` writes it again"


@dataclass(frozen=True)
class Damage:
    """A file and what is wrong with it."""

    file: str
    problem: str


@dataclass(frozen=True)
class StageState:
    """A stage's file: what is wrong with it, what has changed since, its changed CSV tables."""

    stage: str
    problem: str
    changed: tuple[str, ...]
    changed_tables: tuple[str, ...] = ()


@dataclass(frozen=True)
class Inspection:
    """Whether a study folder is sound.

    `orphans` are files that belong to nothing, `stale_records` runs that the spec as it is now asks for no more. `ok`
    is whether nothing is damaged.
    """

    schema_version: int
    stage: str
    study: str
    folder: str
    ok: bool
    records: int
    damaged: tuple[Damage, ...]
    set_aside: int
    orphans: tuple[str, ...]
    stale_records: tuple[str, ...]
    stages: tuple[StageState, ...]


def inspect(study: Study, folder: StudyFolder, solver: Solver | None = None) -> Inspection:
    """Check everything in a study folder; change nothing."""
    solver = solver or make_solver(study)
    keys = folder.keys()
    problems = {key: folder.examine(key)[1] for key in keys}
    stages = [_stage(study, solver, folder, stage) for stage in stages_known(study) if folder.has_stage(stage.name)]
    damaged = [Damage(f"runs/{key}.json", problem) for key, problem in problems.items() if problem]
    damaged += [Damage(f"{state.stage}.json", state.problem) for state in stages if state.problem]
    damaged += [Damage(name, _CHANGED) for state in stages for name in state.changed_tables]
    intact = [key for key in keys if not problems[key]]
    return Inspection(
        1,
        "verify",
        study.name,
        str(folder.path),
        not damaged,
        len(keys),
        tuple(damaged),
        len(list(folder.runs.glob("damaged/*"))),
        tuple(_orphans(folder, set(keys))),
        tuple(_stale(intact, asked(study, solver, folder), folder, solver)),
        tuple(stages),
    )


def _stage(study: Study, solver: Solver, folder: StudyFolder, stage: Stage[Any]) -> StageState:
    try:
        content = folder.examine_stage(stage.name)
        if (version := content.get("schema_version")) != SCHEMA_VERSION:
            return StageState(stage.name, f"has schema version {version!r:.20}, not {SCHEMA_VERSION}", ())
        changed = changes_since(study, solver, folder, stage.name)
        tables: tuple[str, ...] = ()
        if CODE not in changed:  # of other code it may have another shape
            tables = tuple(changed_tables(stage.result().from_json(content), folder))
    except UsageError as error:
        return StageState(stage.name, _without_place(str(error), folder, stage), ())
    return StageState(stage.name, "", tuple(changed), tables)


def _without_place(message: str, folder: StudyFolder, stage: Stage[Any]) -> str:
    """Return what is wrong with a stage's file, without its name."""
    name = f"{stage.name}.json"
    return message.removeprefix(str(folder.path / name)).removeprefix(name).lstrip(": ")


def _orphans(folder: StudyFolder, keys: set[str]) -> list[str]:
    """Return the files among the records that are none, and what killed writers have left."""
    records = [path for path in folder.runs.glob("*") if path.is_file() and path.stem not in keys]
    if folder.holder() is not None:  # its writer is at work
        records = [path for path in records if path.suffix != ".tmp"]
        return sorted(_below(path, folder) for path in records)
    return sorted(_below(path, folder) for path in {*records, *folder.path.glob(".writing-*.tmp")})


def _below(path: Path, folder: StudyFolder) -> str:
    return path.relative_to(folder.path).as_posix()


def _stale(keys: list[str], wanted: list[Asked], folder: StudyFolder, solver: Solver) -> list[str]:
    """Return the records of settled stages that no stage asks for."""
    asked_for = {record_key(solver, request) for part in wanted for request in part.requests}
    settled = {part.stage for part in wanted if part.settled}
    records = {key: folder.peek(key) for key in keys if key not in asked_for}
    return [key for key, record in records.items() if record and record["request"]["stage"] in settled]
