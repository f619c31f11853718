"""From requests to answers: look in the records, compute what is missing, keep each answer as it comes.

An answer counts once its record lies in the study folder. A run that failed for physical reasons stays
failed; one that failed by accident (its process died, the solver raised) is tried again by the next command.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import closing
from dataclasses import asdict, dataclass
from typing import Any

from stemcal.errors import SimulationFailed
from stemcal.executors.inline import InlineExecutor
from stemcal.executors.local import WorkerDied
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.study.durable import digest
from stemcal.study.store import StudyFolder, now, provenance

logger = logging.getLogger(__name__)

KEY_LENGTH = 32
ACCIDENTS = frozenset({"worker_died", "exception"})
_HEARTBEAT_S = 0.5  # how long Ctrl-C may have to wait on Windows


@dataclass(frozen=True)
class Progress:
    """Where a stage stands, in rows of its design."""

    stage: str
    done: int
    total: int
    cached: int
    failed: int
    last_force: float | None


Watch = Callable[[Progress], None]


def ignore(_progress: Progress) -> None:
    """Watch and say nothing."""


def record_key(solver: Solver, request: Request) -> str:
    """Return the name of the record that answers a request: a hash of what determines the answer."""
    return digest(solver.identity(request))[:KEY_LENGTH]


def answer_all(
    requests: Sequence[Request],
    solver: Solver,
    folder: StudyFolder,
    executor: Executor,
    watch: Watch = ignore,
) -> list[Answer]:
    """Answer every request; the folder must be locked.

    Requests with equal identities are computed once, those with a record not at all. Interrupted, it leaves
    the records of all that was done.
    """
    keys = [record_key(solver, request) for request in requests]
    known = _recorded(keys, folder)
    stage = requests[0].stage if requests else ""
    tally = _Tally(stage, keys, sum(key in known for key in keys), watch)
    tally.report(known)
    missing: dict[str, Request] = {}
    for key, request in zip(keys, requests, strict=True):
        if key not in known:
            missing.setdefault(key, request)
    folder.log("stage_begins", stage=stage, rows=len(keys), recorded=len(known), to_run=len(missing))
    with closing(_computed(missing, solver, folder, executor)) as outcomes:
        for key, answer in outcomes:
            known[key] = answer
            tally.report(known, answer)
    return [known[key] for key in keys]


def forces(answers: Sequence[Answer]) -> list[float]:
    """Return the forces, NaN where a run failed, so that it cannot pass for a number."""
    return [answer.force if answer.ok and answer.force is not None else math.nan for answer in answers]


def _recorded(keys: Sequence[str], folder: StudyFolder) -> dict[str, Answer]:
    """Return what earlier commands have left, accidents excepted."""
    records = {key: folder.load(key) for key in dict.fromkeys(keys)}
    return {
        key: _answer(record)
        for key, record in records.items()
        if record is not None and record["reason"] not in ACCIDENTS
    }


def _answer(record: Mapping[str, Any]) -> Answer:
    return Answer(**{name: record[name] for name in ("status", "force", "reason", "message", "details")})


@dataclass(frozen=True)
class _Tally:
    stage: str
    keys: Sequence[str]
    cached: int
    watch: Watch

    def report(self, known: Mapping[str, Answer], last: Answer | None = None) -> None:
        answers = [known[key] for key in self.keys if key in known]
        failed = sum(not answer.ok for answer in answers)
        force = last.force if last is not None else None
        self.watch(Progress(self.stage, len(answers), len(self.keys), self.cached, failed, force))


# ---- computing


@dataclass(frozen=True)
class Computed:
    """An answer with the circumstances it was computed under."""

    answer: Answer
    circumstances: dict[str, Any]


def compute(solver: Solver, request: Request) -> Computed:
    """Answer one request. Runs in a worker."""
    started, clock = now(), time.perf_counter()
    answer = sound(solver.solve(request))
    wall = time.perf_counter() - clock
    return Computed(answer, {**provenance(), "started": started, "finished": now(), "wall_seconds": wall})


def sound(answer: Answer) -> Answer:
    """Return the answer, or a failed one in its place if its force is no number.

    >>> sound(Answer("ok", force=float("nan"))).reason
    'nan'
    """
    if answer.status != "ok":
        return Answer("failed", None, answer.reason or "failed", answer.message, answer.details)
    if answer.force is None or not math.isfinite(answer.force):
        return Answer("failed", None, "nan", f"the solver gave the force {answer.force}", answer.details)
    return answer


def _computed(
    missing: Mapping[str, Request], solver: Solver, folder: StudyFolder, executor: Executor
) -> Generator[tuple[str, Answer], None, None]:
    """Compute the missing answers; each is recorded before it is yielded."""
    if not missing:
        return
    solver.prepare()
    if getattr(solver, "inline", False):
        executor = InlineExecutor()
    pending: dict[Future[Computed], str] = {}
    try:
        for key, request in missing.items():
            future = executor.submit(compute, solver, request)
            pending[future] = key
        while pending:
            done, _ = wait(pending, timeout=_HEARTBEAT_S, return_when=FIRST_COMPLETED)
            for future in done:
                key = pending[future]
                answer = _record(key, missing[key], future, solver, folder)
                del pending[future]
                yield key, answer
    finally:
        _save_the_rest(pending, missing, solver, folder)


def _save_the_rest(
    pending: Mapping[Future[Computed], str],
    missing: Mapping[str, Request],
    solver: Solver,
    folder: StudyFolder,
) -> None:
    """After an interruption keep what is done, take back what has not begun."""
    for future, key in pending.items():
        if not future.cancel() and future.done() and future.exception() is None:
            _record(key, missing[key], future, solver, folder)


def _record(key: str, request: Request, future: Future[Computed], solver: Solver, folder: StudyFolder) -> Answer:
    """Save one outcome durably and return its answer."""
    computed = _outcome(future, request)
    answer = computed.answer
    folder.save(
        {
            "key": key,
            "identity": solver.identity(request),
            "request": {**asdict(request), "levels": dict(request.levels)},
            **asdict(answer),
            "provenance": computed.circumstances,
        }
    )
    if not answer.ok:
        folder.log("run_failed", key=key, stage=request.stage, row=request.row, reason=answer.reason)
        logger.warning("%s run %d: %s: %s", request.stage, request.row + 1, answer.reason, answer.message)
    return answer


def _outcome(future: Future[Computed], request: Request) -> Computed:
    """Return what a finished future holds; an exception is a failed run, not the end of the study."""
    try:
        return future.result()
    except SimulationFailed as error:
        answer = Answer("failed", reason=error.reason, message=str(error))
    except WorkerDied as error:
        answer = Answer("failed", reason="worker_died", message=str(error))
    except Exception as error:
        logger.debug("%s run %d", request.stage, request.row + 1, exc_info=error)
        answer = Answer("failed", reason="exception", message=f"{type(error).__name__}: {error}")
    return Computed(answer, {**provenance(), "finished": now()})
