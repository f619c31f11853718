"""Runs given to an executor: what each gives, what its failure is called, which are begun again."""

import logging
import math
import queue
import time
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

from stemcal.errors import SimulationFailed, Waiting
from stemcal.executors import ClusterLost, RunExecutor, RunTimedOut, WorkerDied
from stemcal.files.log import now
from stemcal.folder import provenance
from stemcal.interrupts import next_of
from stemcal.naming import CUTTING, Naming
from stemcal.runs.record import ACCIDENTS, TIMEOUT, identity_and_key
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.study.types.field_types import MOST

logger = logging.getLogger(__name__)

_TRIES = 2  # how often a run is begun that ends by accident

Computed = tuple[Answer, dict[str, Any]]
"""An answer with the circumstances it was computed under."""


@dataclass(frozen=True)
class Run:
    """A request to a solver, and what determines its answer; the `key`, a hash of that, is the name of its record.

    Called, as a worker does, it is computed.
    """

    solver: Solver
    request: Request
    identity: dict[str, Any]
    key: str

    @classmethod
    def of(cls, solver: Solver, request: Request) -> "Run":
        """Return the run of a request."""
        return cls(solver, request, *identity_and_key(solver, request))

    def get_ready(self) -> None:
        """Do what the solver needs in this process before its first run; the clock of the run starts after it."""
        self.solver.get_ready()

    def __call__(self) -> Computed:
        """Answer the request."""
        started, clock = now(), time.perf_counter()
        answer = validated(self.solver.solve(self.request), self.solver.naming)
        wall = time.perf_counter() - clock
        return answer, {**provenance(), "started": started, "finished": now(), "wall_seconds": wall}


class Batch:
    """Runs in the hands of an executor; `awaited` are those that people still have to do."""

    def __init__(self, runs: Iterable[Run], executor: RunExecutor) -> None:
        self.executor, self.awaited = executor, list[Request]()
        self._waiting = deque(runs)
        self._pending: dict[Future[Computed], Run] = {}
        self._begun: Counter[str] = Counter()
        self._done: queue.SimpleQueue[Future[Computed]] = queue.SimpleQueue()

    def arriving(self) -> Iterator[tuple[Run, Computed]]:
        """Yield every run with what came of it as they are done."""
        while self._waiting or self._pending:
            while self._waiting and len(self._pending) < self.executor.ahead:
                self._submit(self._waiting.popleft())
            future = next_of(self._done)
            run = self._pending.pop(future)
            try:
                answer, circumstances = _ended(future)
            except Waiting:
                self.awaited.append(run.request)
                continue
            begun = self._begun[run.key]
            if answer.reason in ACCIDENTS and begun < _TRIES:
                logger.info("%s run %d is restarted", run.request.stage, run.request.row + 1)
                self._submit(run)
                continue
            if begun > 1:
                circumstances = {**circumstances, "tries": begun}
                if not answer.ok:
                    answer = replace(answer, message=f"{answer.message} (started {begun} times)")
            yield run, (answer, circumstances)

    def rest(self) -> Iterator[tuple[Run, Computed]]:
        """After an interruption yield what is done, and take back what has not begun."""
        for future, run in self._pending.items():
            if not future.cancel() and future.done() and future.exception() is None:
                yield run, future.result()

    def _submit(self, run: Run) -> None:
        future = self.executor.submit(run)
        self._pending[future] = run
        self._begun[run.key] += 1
        future.add_done_callback(self._done.put)


def _ended(future: Future[Computed]) -> Computed:
    """Return what a finished future holds; an exception is a failed run, not the end of the study."""
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
        answer = Answer("failed", reason="exception", message=f"{type(error).__name__}: {error}")
    return answer, {**provenance(), "finished": now()}


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
            message = f"{given}; the magnitude exceeds {MOST:g}"
            return Answer("failed", None, "bad_result", message, rest)
    return answer
