"""Every run that a study asks for, and what has become of it: for `status`, `runs` and `retry`. Reads only."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

from stemcal.errors import UsageError
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.answering import Watch, answer_all, answer_of, ignore, record_key
from stemcal.stages.lineage import changes_since
from stemcal.stages.planning import Asked, asked
from stemcal.stages.policy import is_censored, judged, stands
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

SCHEMA_VERSION = 1
STATUSES = ("ok", "censored", "failed", "left", "damaged")
_SHORTEST_KEY = 4
_CIRCUMSTANCES = ("started", "wall_seconds", "tries", "host", "stemcal")


@dataclass(frozen=True)
class Entry:
    """One row of a stage: what was asked and, if a record answers it, what came of it.

    `status` is one of `STATUSES`; `again` tells that the next command begins the run again.
    """

    request: Request
    key: str
    status: str
    answer: Answer | None = None
    again: bool = True
    circumstances: Mapping[str, Any] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the entry as JSON values."""
        answer = self.answer or Answer("")
        return {
            "stage": self.request.stage,
            "run": self.request.row + 1,
            "key": self.key,
            "status": self.status,
            "force": answer.force,
            "reason": answer.reason,
            "message": answer.message,
            "again": self.again,
            "diameter": self.request.diameter,
            "levels": dict(self.request.levels),
            **{name: self.circumstances.get(name) for name in _CIRCUMSTANCES},
        }


def ledger(study: Study, folder: StudyFolder, solver: Solver | None = None) -> list[Entry]:
    """Return the runs of all stages whose runs are known by now, in order."""
    solver = solver or make_solver(study)
    return _entries(asked(study, solver, folder), study, folder, solver)


def _entries(wanted: Sequence[Asked], study: Study, folder: StudyFolder, solver: Solver) -> list[Entry]:
    requests = [request for part in wanted if part.settled for request in part.requests]
    keys = [record_key(solver, request) for request in requests]
    entries = [_entry(request, key, study, folder) for request, key in zip(requests, keys, strict=True)]
    stages = {part.stage for part in wanted}
    return entries + sorted(_others(set(keys), stages, study, folder), key=lambda e: (e.request.stage, e.request.row))


def _entry(request: Request, key: str, study: Study, folder: StudyFolder) -> Entry:
    record = folder.peek(key)
    if record is None:
        return Entry(request, key, "damaged" if folder.record_path(key).exists() else "left")
    answer = judged(answer_of(record), study.runs)
    status = "failed" if not answer.ok else "censored" if is_censored(answer) else "ok"
    return Entry(request, key, status, answer, not stands(record, study.runs), record.get("provenance", {}))


def _others(known: Collection[str], stages: Collection[str], study: Study, folder: StudyFolder) -> Iterator[Entry]:
    """Yield the records of stages that decide from run to run what to ask next."""
    for key in folder.keys():  # noqa: SIM118
        record = folder.peek(key) if key not in known else None
        if record is not None and record["request"]["stage"] not in stages:
            yield _entry(Request(**record["request"]), key, study, folder)


# ---- status


def status(study: Study, folder: StudyFolder, solver: Solver | None = None) -> dict[str, Any]:
    """Return for every stage how many of its rows are done, failed and why, running, and left.

    Returns
    -------
    dict
        ``working`` is what the process at work tells of itself, None if none is; ``running`` counts at most
        as many rows as it has workers. A stage that another has to decide first has ``rows`` None.
    """
    solver = solver or make_solver(study)
    wanted = asked(study, solver, folder)
    entries, working = _entries(wanted, study, folder, solver), folder.holder()
    decided = {part.stage: part.settled for part in wanted}
    named = [*decided, *sorted({entry.request.stage for entry in entries} - set(decided))]
    return {
        "schema_version": SCHEMA_VERSION,
        "stage": "status",
        "study": study.name,
        "folder": str(folder.path),
        "working": working,
        "stages": [
            {
                "stage": stage,
                **_counts([e for e in entries if e.request.stage == stage], decided.get(stage, True)),
                "running": _running([e for e in entries if e.request.stage == stage], stage, working),
                **_file(study, solver, folder, stage),
            }
            for stage in named
        ],
    }


def _counts(entries: Sequence[Entry], settled: bool) -> dict[str, Any]:
    found = Counter(entry.status for entry in entries)
    reasons = Counter(entry.answer.reason for entry in entries if entry.status == "failed" and entry.answer)
    return {
        "rows": len(entries) if settled else None,
        "done": found["ok"] + found["censored"],
        "censored": found["censored"],
        "failed": found["failed"],
        "reasons": dict(reasons.most_common()),
        "left": found["left"] + found["damaged"] if settled else None,
        "damaged": found["damaged"],
    }


def _running(entries: Sequence[Entry], stage: str, working: Mapping[str, Any] | None) -> int:
    if working is None or working.get("stage") != stage:
        return 0
    open_runs = {entry.key for entry in entries if entry.again}
    return min(len(open_runs), int(working.get("workers", 1)))


def _file(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> dict[str, Any]:
    """Tell whether a stage has left its file, and what has changed since."""
    if not folder.has_stage(stage):
        return {"file": "none", "changed": []}
    try:
        changed = changes_since(study, solver, folder, stage)
    except UsageError:
        return {"file": "damaged", "changed": []}
    return {"file": "stale" if changed else "fresh", "changed": changed}


# ---- retry


def retry(
    study: Study,
    folder: StudyFolder,
    executor: Executor,
    keys: Sequence[str] = (),
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> list[Entry]:
    """Compute failed runs again, all of them or those whose keys begin as given; return what came of them.

    A record is replaced when its new answer is there, not before.
    """
    solver = solver or make_solver(study)
    policy = study.runs.model_copy(update={"quorum": 0.0, "keep_going": True})
    with folder:
        chosen = _chosen(ledger(study, folder, solver), keys)
        for stage in dict.fromkeys(entry.request.stage for entry in chosen):
            requests = [entry.request for entry in chosen if entry.request.stage == stage]
            answer_all(requests, solver, folder, executor, watch, policy, again={entry.key for entry in chosen})
        return [_entry(entry.request, entry.key, study, folder) for entry in chosen]


def _chosen(entries: Sequence[Entry], keys: Sequence[str]) -> list[Entry]:
    failed = {entry.key: entry for entry in reversed(entries) if entry.status == "failed"}
    if not keys:
        return list(reversed(failed.values()))
    return [failed[_whole(key, entries, failed)] for key in dict.fromkeys(keys)]


def _whole(short: str, entries: Sequence[Entry], failed: Collection[str]) -> str:
    """Return the one key of a failed run that begins as given."""
    key = complete_key(short, [entry.key for entry in entries])
    if key not in failed:
        raise UsageError(f"{short}: this run has not failed; `stemcal runs SPEC --status failed` lists those that have")
    return key


def complete_key(short: str, keys: Collection[str]) -> str:
    """Return the one key that begins with `short`; raise `UsageError` if there is none, or more than one."""
    found = sorted({key for key in keys if key.startswith(short)})
    if len(short) < _SHORTEST_KEY or len(found) > 1:
        raise UsageError(
            f"{short[:40]}: more than one run may have this key; give {_SHORTEST_KEY} letters or more of it"
        )
    if not found:
        raise UsageError(f"{short[:40]}: no run of this study has this key; `stemcal runs SPEC` lists them")
    return found[0]
