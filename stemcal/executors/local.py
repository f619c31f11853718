"""The executor of one machine: a fixed number of worker processes, each of them expendable.

`ProcessPoolExecutor` gives up every pending run when one worker dies. Here a dead worker costs the run it was
at, nothing else: its future gets `WorkerDied`, the next run a new process. A run that takes longer than its time
limit, counted from its own start, is ended with all that it has started, and its future gets `RunTimedOut`. What a
worker loads or compiles before does not count, nor does time while this process is stopped.
"""

import contextlib
import pickle
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from types import TracebackType
from typing import Any, ParamSpec, TypeVar

from stemcal.executors.base import RunExecutor, RunTimedOut, WorkerDied
from stemcal.executors.machine import available_cores
from stemcal.executors.time_limited_worker import Call, WorkerThread

P = ParamSpec("P")
T = TypeVar("T")

__all__ = ["LocalExecutor", "RunTimedOut", "WorkerDied", "available_cores"]


class LocalExecutor(RunExecutor):
    """Computes calls in `workers` processes of this machine.

    Parameters
    ----------
    workers : int, optional
        How many; default, one per core. Processes start when there is work for them, by ``spawn``.
    time_limit : float, optional
        How long a call may take, s, counted from the moment a worker begins it.

    Notes
    -----
    Leaving a ``with`` block by an exception (Ctrl-C) ends the workers at once and cancels what has not begun.
    """

    def __init__(self, workers: int | None = None, time_limit: float | None = None) -> None:
        self._workers = max(1, workers if workers is not None else available_cores())
        self.time_limit = time_limit
        self._calls: queue.SimpleQueue[Call | None] = queue.SimpleQueue()
        self._threads: list[WorkerThread] = []
        self._closed = False
        self._lock = threading.Lock()

    @property
    def workers(self) -> int:
        """How many processes there are at most."""
        return self._workers

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Queue a call; function, arguments and result must be picklable."""
        return self.submit_pickled(pickle.dumps((fn, args, kwargs)), self.time_limit)

    def submit_pickled(self, blob: bytes, time_limit: float | None) -> Future[Any]:
        """Queue a pickled (function, args, kwargs) with a time limit of its own."""
        future: Future[Any] = Future()
        with self._lock:
            if self._closed:
                raise RuntimeError("cannot submit to an executor that is shut down")
            self._calls.put(Call(future, blob, time_limit))
            if len(self._threads) < self.workers:
                self._threads.append(WorkerThread(self._calls, f"worker {len(self._threads) + 1}"))
                self._threads[-1].start()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Take no more calls; finish what is queued, or cancel it; then end the workers."""
        with self._lock:
            self._closed = True
        if cancel_futures:
            self._cancel_queued()
        for _ in self._threads:
            self._calls.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def stop(self) -> None:
        """End the workers now, in the middle of their runs, and cancel everything queued."""
        with self._lock:
            self._closed = True
        self._cancel_queued()
        for thread in self._threads:
            thread.stop()
        self.shutdown()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.shutdown()
        else:
            self.stop()

    def _cancel_queued(self) -> None:
        with contextlib.suppress(queue.Empty):
            while True:
                call = self._calls.get_nowait()
                if call is not None:
                    call.future.cancel()
                    call.future.set_running_or_notify_cancel()
