"""Runs given to an executor: what each gives, what its failure is called, which are begun again."""

import logging
import math
import queue
import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

from stemcal.errors import SimulationFailed
from stemcal.executors import ClusterLost, RunExecutor, RunTimedOut, WorkerDied
from stemcal.folder import provenance
from stemcal.folder.log import now
from stemcal.interrupts import next_of
from stemcal.naming import CUTTING, Naming
from stemcal.runs.record import ACCIDENTS, TIMEOUT
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.study.types.field_types import MOST

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Computed:
    """An answer with the circumstances it was computed under."""

    answer: Answer
    circumstances: dict[str, Any]


@dataclass(frozen=True)
class Run:
    """One run for a worker: called, it is computed."""

    solver: Solver
    request: Request

    def get_ready(self) -> None:
        """Do what the solver needs in this process before its first run; the clock of the run starts after it."""
        self.solver.get_ready()

    def __call__(self) -> Computed:
        """Answer the request."""
        started, clock = now(), time.perf_counter()
        answer = validated(self.solver.solve(self.request), self.solver.naming)
        wall = time.perf_counter() - clock
        return Computed(answer, {**provenance(), "started": started, "finished": now(), "wall_seconds": wall})


def validated(answer: Answer, naming: Naming = CUTTING) -> Answer:
    """Return the answer, or a failed one in its place if its force, or any further response, is not a number.

    >>> validated(Answer("ok", response=float("nan"))).reason
    'nan'
    """
    if answer.status != "ok":
        return Answer("failed", None, answer.reason or "failed", answer.message, answer.details)
    rest, nouns = dict(answer.details), {response.name: response.noun for response in naming.responses}
    for name, value in {naming.response.name: answer.response, **rest.pop(RESPONSES, {})}.items():
        given = f"the solver returned {value} for the {nouns.get(name, name)}"
        if value is None or not math.isfinite(value):
            return Answer("failed", None, "nan", given, rest)
        if abs(value) > MOST:
            message = f"{given}, which exceeds the largest allowed value ({MOST:g})"
            return Answer("failed", None, "bad_result", message, rest)
    return answer


class Batch:
    """Runs in the hands of an executor.

    Parameters
    ----------
    requests : mapping
        A request per key.
    tries : int
        How often a run is begun that ends by accident.
    """

    def __init__(self, requests: Mapping[str, Request], solver: Solver, executor: RunExecutor, tries: int) -> None:
        self.requests, self.solver, self.executor, self.tries = requests, solver, executor, tries
        self._waiting = deque(requests)
        self._pending: dict[Future[Computed], str] = {}
        self._begun: Counter[str] = Counter()
        self._done: queue.SimpleQueue[Future[Computed]] = queue.SimpleQueue()

    def arriving(self) -> Iterator[tuple[str, Computed]]:
        """Yield key and outcome of every run as they are done."""
        while self._waiting or self._pending:
            while self._waiting and len(self._pending) < self.executor.ahead:
                self._submit(self._waiting.popleft())
            future = next_of(self._done)
            key = self._pending.pop(future)
            computed = outcome(future)
            if computed.answer.reason in ACCIDENTS and self._begun[key] < self.tries:
                logger.info("%s run %d is restarted", self.requests[key].stage, self.requests[key].row + 1)
                self._submit(key)
            else:
                yield key, self._counted(key, computed)

    def rest(self) -> Iterator[tuple[str, Computed]]:
        """After an interruption yield what is done, and take back what has not begun."""
        for future, key in self._pending.items():
            if not future.cancel() and future.done() and future.exception() is None:
                yield key, future.result()

    def _submit(self, key: str) -> None:
        future = self.executor.submit(Run(self.solver, self.requests[key]))
        self._pending[future] = key
        self._begun[key] += 1
        future.add_done_callback(self._done.put)

    def _counted(self, key: str, computed: Computed) -> Computed:
        """Say how often a run was begun, if more than once."""
        begun = self._begun[key]
        if begun == 1:
            return computed
        answer, circumstances = computed.answer, {**computed.circumstances, "tries": begun}
        if not answer.ok:
            answer = replace(answer, message=f"{answer.message} (started {begun} times)")
        return Computed(answer, circumstances)


def outcome(future: Future[Computed]) -> Computed:
    """Return what a finished future holds; an exception is a failed run, not the end of the study."""
    try:
        return future.result()
    except ClusterLost:
        raise
    except SimulationFailed as error:
        answer = Answer("failed", reason=error.reason, message=str(error))
    except RunTimedOut as error:
        answer = Answer("failed", reason=TIMEOUT, message=str(error), details={"time_limit": error.limit})
    except WorkerDied as error:
        answer = Answer("failed", reason="worker_died", message=str(error))
    except Exception as error:
        logger.debug("a run raised", exc_info=error)
        answer = Answer("failed", reason="exception", message=f"{type(error).__name__}: {error}")
    return Computed(answer, {**provenance(), "finished": now()})
