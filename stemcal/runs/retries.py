"""Pass runs to an executor, convert exceptions into failed answers, and restart runs that ended by accident."""

import logging
import queue
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future
from dataclasses import replace

from stemcal.errors import SimulationFailed, Waiting
from stemcal.processes.limits import RunTimedOut, next_of
from stemcal.registry import described
from stemcal.runs.executors import ClusterLost, RunExecutor, WorkerDied
from stemcal.runs.record import ACCIDENTS, TIMEOUT, Computed, Run
from stemcal.runs.study_folder import provenance
from stemcal.solvers.protocol import Answer, Request
from stemcal.storage.log import now

logger = logging.getLogger(__name__)

_TRIES = 2  # number of times that a run is started if it ends by accident


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
