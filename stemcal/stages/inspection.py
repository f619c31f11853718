"""Is the study folder sound? Every record against its seal and its name, every stage against its spec."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Solver
from stemcal.stages.answering import KEY_LENGTH, record_key
from stemcal.stages.lineage import changes_since
from stemcal.stages.planning import Asked, asked
from stemcal.study.durable import digest
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

STAGES = ("screen", "rsm", "invert", "refine", "validate")


def inspect(study: Study, folder: StudyFolder, solver: Solver | None = None) -> dict[str, Any]:
    """Check everything in a study folder; change nothing.

    Returns
    -------
    dict
        ``damaged`` names files with what is wrong with them, ``orphans`` files that belong to nothing,
        ``stale_records`` runs that the spec as it is now asks for no more. ``ok`` is whether nothing is
        damaged.
    """
    solver = solver or make_solver(study)
    keys = folder.keys()
    problems = {key: _problem(folder, key) for key in keys}
    stages = [_stage(study, solver, folder, stage) for stage in STAGES if folder.has_stage(stage)]
    damaged = [{"file": f"runs/{key}.json", "problem": problem} for key, problem in problems.items() if problem]
    damaged += [{"file": f"{s['stage']}.json", "problem": s["problem"]} for s in stages if s["problem"]]
    return {
        "schema_version": 1,
        "stage": "verify",
        "study": study.name,
        "folder": str(folder.path),
        "ok": not damaged,
        "records": len(keys),
        "damaged": damaged,
        "set_aside": len(list(folder.runs.glob("damaged/*"))),
        "orphans": _orphans(folder, set(keys)),
        "stale_records": _stale([k for k in keys if not problems[k]], asked(study, solver, folder), folder, solver),
        "stages": stages,
    }


def _problem(folder: StudyFolder, key: str) -> str:
    """Return what is wrong with a record, "" if nothing is."""
    try:
        record = folder.peek(key)
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    if record is None:
        return "does not agree with its SHA-256"
    if digest(record.get("identity"))[:KEY_LENGTH] != key:
        return "its name does not follow from what it says it answers"
    return ""


def _stage(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> dict[str, Any]:
    try:
        folder.read_stage(stage)
    except UsageError:
        return {"stage": stage, "problem": "cannot be read", "changed": []}
    return {"stage": stage, "problem": "", "changed": changes_since(study, solver, folder, stage)}


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
