"""Answer requests: read the existing records, compute the missing runs, and save each answer as soon as it is known.

A run that failed for physical reasons is not repeated. A run that failed by accident (its process died, or the solver
raised an exception) is started a second time, and again by the next command.
"""

import logging
import math
import queue
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace

from stemcal.errors import RunsFailed, SimulationFailed, Waiting
from stemcal.processes.limits import RunTimedOut, next_of
from stemcal.registry import described
from stemcal.runs.executors import ClusterLost, InlineExecutor, RunExecutor, WorkerDied
from stemcal.runs.record import ACCIDENTS, TIMEOUT, Computed, Outcome, Run, is_final, outcome_of
from stemcal.runs.study_folder import StudyFolder, now, provenance
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.vocabulary import CUTTING, Vocabulary

logger = logging.getLogger(__name__)

_TRIES = 2  # number of times that a run is started if it ends by accident
_MOST_WARNINGS = 10
_MOST_REASONS = 10
QUORUM = 0.5  # the fraction of the runs of a stage that must succeed


@dataclass(frozen=True)
class Progress:
    """Progress of a stage.

    done, total     numbers of distinct runs; `cached` of those done were recorded before this command
    last_response   response of the last run, and its `last_condition`; None if there is none
    preparing       whether the solver is still being prepared, for which all runs wait
    points          number of requested runs, including equal ones
    """

    stage: str
    done: int
    total: int
    cached: int
    failed: int
    last_response: float | None
    last_condition: float | None = None
    preparing: bool = False
    points: int = 0


Watch = Callable[[Progress], None]


def watch_nothing(_progress: Progress) -> None:
    """Ignore the progress."""


def answer_all(
    requests: Sequence[Request],
    solver: Solver,
    folder: StudyFolder,
    executor: RunExecutor,
    watch: Watch = watch_nothing,
    time_limit: float | None = None,
    quorum: float = QUORUM,
    again: Collection[str] = (),
    naming: Vocabulary = CUTTING,
) -> list[Outcome]:
    """Return the outcome of every request, with the responses in `naming`; the caller must have locked the folder.

    Requests with equal identities are computed once. Runs with a record are not computed, unless their key is in
    `again`. After an interruption, the records of all completed runs are saved. Raises `RunsFailed` if a smaller
    fraction of the requests than `quorum` succeeds, and `Waiting` if people must enter results first.
    """
    runs = [Run.of(solver, request) for request in requests]
    known: dict[str, Outcome] = {}  # outcomes by key; at first only the outcomes of final records
    missing: dict[str, Run] = {}
    for run in runs:
        if run.key in known or run.key in missing:
            continue
        record = None if run.key in again else folder.load(run.key)
        if record is not None and is_final(record, time_limit):
            known[run.key] = outcome_of(record, naming)
        else:
            missing[run.key] = run
    stage = requests[0].stage if requests else ""
    folder.log("stage_begins", stage=stage, rows=len(runs), recorded=len(known), to_run=len(missing))
    tally = _Tally(stage, len(runs), len(known) + len(missing), known.values(), watch)
    if missing:
        if takes_a_while := solver.preparing():
            tally.report(preparing=True)
        solver.prepare()
        if takes_a_while:
            tally.report()
    batch = Batch(missing.values(), InlineExecutor() if solver.immediate else executor)
    try:
        for run, computed in batch.arriving():
            known[run.key] = keep(run, computed, folder, naming)
            tally.add(known[run.key], run.request)
    finally:
        for run, computed in batch.rest():
            keep(run, computed, folder)
    if batch.awaited:
        raise Waiting(stage, batch.awaited)
    outcomes = [known[run.key] for run in runs]
    needed, failed = math.ceil(quorum * len(outcomes) - 1e-9), sum(not outcome.ok for outcome in outcomes)
    if len(outcomes) - failed < needed:
        counts = f"{failed} of {len(outcomes)} runs failed, but at least {needed} must succeed"
        head = f"{stage}: {counts}; fix the problem, then run `stemcal run SPEC --retry`"
        raise RunsFailed("\n".join([head, *_reason_lines(requests, outcomes)]))
    return outcomes


class Batch:
    """Runs that an executor computes; `awaited` collects the requests that people must answer."""

    def __init__(self, runs: Iterable[Run], executor: RunExecutor) -> None:
        self.executor, self.awaited = executor, list[Request]()
        self._waiting = deque(runs)
        self._pending: dict[Future[Computed], Run] = {}
        self._begun: Counter[str] = Counter()
        self._done: queue.SimpleQueue[Future[Computed]] = queue.SimpleQueue()

    def arriving(self) -> Iterator[tuple[Run, Computed]]:
        """Yield every run with its answer, in the order in which they finish."""
        while self._waiting or self._pending:
            while self._waiting and len(self._pending) < self.executor.ahead:
                self._submit(self._waiting.popleft())
            future = next_of(self._done)
            run = self._pending.pop(future)
            try:
                answer, circumstances = _answer_of(future)
            except Waiting:
                self.awaited.append(run.request)
                continue
            begun = self._begun[run.key]
            if answer.reason in ACCIDENTS and begun < _TRIES:
                logger.info("%s run %d is being restarted", run.request.stage, run.request.row + 1)
                self._submit(run)
                continue
            if begun > 1:
                circumstances = {**circumstances, "tries": begun}
                if not answer.ok:
                    answer = replace(answer, message=f"{answer.message} (started {begun} times)")
            yield run, (answer, circumstances)

    def rest(self) -> Iterator[tuple[Run, Computed]]:
        """After an interruption, cancel the runs that have not begun, and yield the runs that have finished."""
        for future, run in self._pending.items():
            if not future.cancel() and future.done() and future.exception() is None:
                yield run, future.result()

    def _submit(self, run: Run) -> None:
        future = self.executor.submit(run)
        self._pending[future] = run
        self._begun[run.key] += 1
        future.add_done_callback(self._done.put)


def _answer_of(future: Future[Computed]) -> Computed:
    try:
        return future.result()
    except (ClusterLost, Waiting):
        raise
    except SimulationFailed as error:
        answer = Answer("failed", reason=error.reason, message=str(error))
    except RunTimedOut as error:
        answer = Answer("failed", reason=TIMEOUT, message=str(error), details={"time_limit": error.limit})
    except WorkerDied as error:
        answer = Answer("failed", reason="worker_died", message=str(error))
    except Exception as error:
        logger.debug("a run raised", exc_info=error)
        answer = Answer("failed", reason="exception", message=described(error))
    return answer, {**provenance(), "finished": now()}


class _Tally:
    """Counts the finished runs and notifies the watcher."""

    def __init__(self, stage: str, points: int, total: int, known: Collection[Outcome], watch: Watch) -> None:
        self.stage, self.points, self.total, self.watch = stage, points, total, watch
        self.warned: set[tuple[int, str]] = set()
        self.done = self.cached = len(known)
        self.failed = sum(not outcome.ok for outcome in known)
        self.report()

    def add(self, outcome: Outcome, request: Request) -> None:
        """Count a run. Log a warning of each of the first failures, only one if replicates fail for the same reason."""
        self.done += 1
        self.failed += not outcome.ok
        if not outcome.ok and (fault := (request.row, outcome.message)) not in self.warned:
            self.warned.add(fault)
            if len(self.warned) <= _MOST_WARNINGS:
                logger.warning("%s run %d: %s: %s", request.stage, request.row + 1, outcome.reason, outcome.message)
            elif len(self.warned) == _MOST_WARNINGS + 1:
                logger.warning("further runs failed; `stemcal status SPEC --failed` lists all failed runs")
        self.report(outcome.response, request.condition)

    def report(self, response: float | None = None, condition: float | None = None, preparing: bool = False) -> None:
        counts = (self.done, self.total, self.cached, self.failed)
        condition = None if response is None else condition
        self.watch(Progress(self.stage, *counts, response, condition, preparing, self.points))


def keep(run: Run, computed: Computed, folder: StudyFolder, naming: Vocabulary = CUTTING) -> Outcome:
    """Save the record of a run, and return its outcome."""
    answer, circumstances = computed[0].readable(), computed[1]
    request = {"key": run.key, "identity": run.identity, "request": run.request.as_record()}
    record = {**request, **asdict(answer), "provenance": circumstances}
    folder.save(record)
    if not answer.ok:
        folder.log("run_failed", key=run.key, stage=run.request.stage, row=run.request.row, reason=answer.reason)
    return outcome_of(record, naming)


def _reason_lines(requests: Iterable[Request], outcomes: Iterable[Outcome]) -> list[str]:
    lines = [
        f"  run {request.row + 1}: {outcome.reason}: {outcome.message}".rstrip(": ")
        for request, outcome in zip(requests, outcomes, strict=True)
        if not outcome.ok
    ]
    more = len(lines) - _MOST_REASONS
    return [*lines[:_MOST_REASONS], f"  and {more} more"] if more > 0 else lines


@contextmanager
def failures_in_message(requests: Sequence[Request], outcomes: Sequence[Outcome]) -> Iterator[None]:
    """Add the failed runs and their reasons to the message of a `RunsFailed` that is raised within the block."""
    try:
        yield
    except RunsFailed as error:
        raise RunsFailed("\n".join([str(error), *_reason_lines(requests, outcomes)])) from None
