"""A thread that feeds one worker process of this machine, and ends it where a run exceeds its time limit."""

import queue
import signal
import threading
from concurrent.futures import Future
from typing import Any, NamedTuple

from stemcal.child import Child, ChildDied, ChildLate
from stemcal.executors.base import RunTimedOut, WorkerDied

# The runs share the cores.
_ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "NUMBA_NUM_THREADS",
    ),
    "1",
)


class Call(NamedTuple):
    """A future, the pickled call that will fill it, and how many seconds that may take."""

    future: Future[Any]
    blob: bytes
    limit: float | None


class WorkerThread(threading.Thread):
    """Takes calls from a queue, until that gives None, and has a process compute them; replaces one that dies."""

    def __init__(self, calls: queue.SimpleQueue[Call | None], name: str) -> None:
        super().__init__(name=name, daemon=True)
        self._calls = calls
        self._stopping = threading.Event()
        self._worker: Child | None = None

    def run(self) -> None:
        """Feed the worker until there is no more work."""
        _block_ctrl_c()
        while (call := self._calls.get()) is not None:
            if call.future.set_running_or_notify_cancel():
                self._fulfil(call)
        if self._worker is not None:
            self._worker.dismiss()

    def stop(self) -> None:
        """End the worker now."""
        self._stopping.set()
        if (worker := self._worker) is not None:
            worker.kill()

    def _fulfil(self, call: Call) -> None:
        try:
            result, error = self._attempt(call)
        except Exception as failure:  # the thread must live: others wait in the queue
            result, error = None, failure
        if error is None:
            call.future.set_result(result)
        else:
            call.future.set_exception(error)

    def _attempt(self, call: Call) -> tuple[Any, BaseException | None]:
        """Let the worker compute a call; one that dies over it, or is late, is replaced for the next."""
        try:
            if self._worker is None and not self._stopping.is_set():
                self._worker = Child(_ONE_THREAD)
            if self._worker is None or self._stopping.is_set():  # `stop` may have come while the worker started
                raise ChildDied("stopped")
            return self._worker.call(call.blob, call.limit)
        except (ChildDied, ChildLate) as problem:
            if self._worker is not None:
                self._worker.kill()
            self._worker = None
            if self._stopping.is_set():
                return None, WorkerDied("stopped before it was done")
            if isinstance(problem, ChildLate):
                return None, RunTimedOut(call.limit or 0.0)
            return None, WorkerDied(f"the worker process ended: {problem}")


def _block_ctrl_c() -> None:
    """Let processes started by this thread begin with SIGINT blocked, until they can ignore it."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
