"""The executor of one machine: a fixed number of worker processes, each of them expendable.

`ProcessPoolExecutor` gives up every pending run when one worker dies. Here a dead worker costs the run it was
at, nothing else: its future gets `WorkerDied`, the next run a new process. A run that takes longer than its time
limit, counted from its own start, is ended with all that it has started, and its future gets `RunTimedOut`. What a
worker loads or compiles before does not count, nor does time while this process or the worker is stopped, or the
worker waits for a core that others have.
"""

from __future__ import annotations

import contextlib
import pickle
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from types import TracebackType
from typing import Any, ParamSpec, TypeVar

from stemcal.executors.base import RunExecutor
from stemcal.executors.calls import LAST, NOW, WHEN_IDLE, Call, Calls
from stemcal.executors.crew import Crew
from stemcal.executors.failures import RunTimedOut, WorkerDied
from stemcal.executors.machine import available_cores

P = ParamSpec("P")
T = TypeVar("T")
Chore = Callable[[], object]

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
        self._calls = Calls()
        self._crews: list[Crew] = []
        self._ready = self._spare = b""
        self._closed = False
        self._lock = threading.Lock()

    @property
    def workers(self) -> int:
        """How many processes there are at most."""
        return self._workers

    @property
    def started(self) -> bool:
        """Whether there are processes already."""
        return bool(self._crews)

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Queue a call; function, arguments and result must be picklable."""
        return self.submit_pickled(pickle.dumps((fn, args, kwargs)), self.time_limit)

    def submit_pickled(self, blob: bytes, time_limit: float | None, when_idle: bool = False) -> Future[Any]:
        """Queue a pickled (function, args, kwargs) with a time limit of its own; behind all others if `when_idle`."""
        future: Future[Any] = Future()
        with self._lock:
            if self._closed:
                raise RuntimeError("cannot submit to an executor that is shut down")
            self._calls.put(Call(future, blob, time_limit), WHEN_IDLE if when_idle else NOW)
            if len(self._crews) < self.workers:
                self._add_crew()
        return future

    def start(self, ready: Chore, spare: Chore, most: int) -> None:
        """Start the workers before there are calls, at most so many.

        Parameters
        ----------
        ready : callable
            What each of them does first.
        spare : callable
            What each does, once, when it has computed something and there is nothing else to compute.
        most : int

        Notes
        -----
        What these raise is not told: the calls that need what they load will tell.
        """
        self._ready, self._spare = (pickle.dumps((chore, (), {})) for chore in (ready, spare))
        with self._lock:
            while not self._closed and len(self._crews) < min(most, self.workers):
                self._add_crew()

    def _add_crew(self) -> None:
        crew = Crew(self._calls, f"worker {len(self._crews) + 1}", self._ready, self._spare)
        self._crews.append(crew)
        crew.start()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Take no more calls; finish what is queued, or cancel it; then end the workers."""
        with self._lock:
            self._closed = True
        if cancel_futures:
            self._cancel_queued()
        if self._calls.empty():
            self._end_chores()
        for _ in self._crews:
            self._calls.put(None, LAST)
        if wait:
            for crew in self._crews:
                crew.join()

    def stop(self) -> None:
        """End the workers now, in the middle of their runs, and cancel everything queued."""
        with self._lock:
            self._closed = True
        self._cancel_queued()
        for crew in self._crews:
            crew.stop()
        self.shutdown()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.shutdown()
        else:
            self.stop()

    def _end_chores(self) -> None:
        """Wait for no worker that is only getting ready for calls that will not come."""
        for crew in self._crews:
            if crew.at_chore.is_set():
                crew.stop()

    def _cancel_queued(self) -> None:
        with contextlib.suppress(queue.Empty):
            while True:
                call = self._calls.get(wait=False)
                if call is not None:
                    call.future.cancel()
                    call.future.set_running_or_notify_cancel()
