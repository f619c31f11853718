"""The executor of one machine: a fixed number of worker processes, each of them expendable.

`ProcessPoolExecutor` gives up every pending run when one worker dies. Here a dead worker costs the run it was
at, nothing else: its future gets `WorkerDied`, the next run a new process. A run that takes longer than its time
limit, counted from its own start, is ended with all that it has started, and its future gets `RunTimedOut`. What a
worker loads or compiles before does not count, nor does time while this process or the worker is stopped, or the
worker waits for a core that others have.
"""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing
import pickle
import queue
import signal
import sys
import threading
import types
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from multiprocessing.connection import wait
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import Any, NamedTuple, ParamSpec, TypeVar

from stemcal.executors.base import RunExecutor
from stemcal.executors.failures import RunTimedOut, WorkerDied
from stemcal.executors.family import end_family
from stemcal.executors.machine import available_cores
from stemcal.executors.worker import serve
from stemcal.patience import Hindrance, within

P = ParamSpec("P")
T = TypeVar("T")
Chore = Callable[[], object]

__all__ = ["LocalExecutor", "RunTimedOut", "WorkerDied", "available_cores"]

PATIENCE_S = 2.0  # between asking a worker to end and ending it
LOADING_S = 3600.0  # to import what a call needs and to compile; the limit of the call itself comes after
_starting = threading.Lock()


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
        self._calls = _Calls()
        self._crews: list[_Crew] = []
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
            self._calls.put(_Call(future, blob, time_limit), _WHEN_IDLE if when_idle else _NOW)
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
        crew = _Crew(self._calls, f"worker {len(self._crews) + 1}", self._ready, self._spare)
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
            self._calls.put(None, _LAST)
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


class _Call(NamedTuple):
    """A future, the pickled call that will fill it, and how many seconds that may take."""

    future: Future[Any]
    blob: bytes
    limit: float | None


_NOW, _WHEN_IDLE, _LAST = range(3)


class _Calls:
    """Calls in the order in which they are to be done; None says that there will be no more."""

    def __init__(self) -> None:
        self._queue: queue.PriorityQueue[tuple[int, int, _Call | None]] = queue.PriorityQueue()
        self._count = itertools.count()  # of two calls with the same turn the first comes first
        self.empty = self._queue.empty

    def put(self, call: _Call | None, turn: int) -> None:
        self._queue.put((turn, next(self._count), call))

    def get(self, wait: bool = True) -> _Call | None:
        """Return the next call; without waiting raise `queue.Empty` if there is none."""
        return self._queue.get(block=wait)[2]


class _Crew(threading.Thread):
    """A thread that feeds one worker process and replaces it when it dies.

    It starts the process itself and outlives it: on Linux a worker dies with the thread that started it.
    """

    def __init__(self, calls: _Calls, name: str, ready: bytes, spare: bytes) -> None:
        super().__init__(name=name, daemon=True)
        self.calls, self.ready, self.spare = calls, ready, spare
        self.stopping, self.at_chore = threading.Event(), threading.Event()
        self.worker: _Worker | None = None

    def run(self) -> None:
        """Feed the worker until there is no more work."""
        _block_ctrl_c()
        self._do(self.ready)
        call = self.calls.get()
        while call is not None:
            if call.future.set_running_or_notify_cancel():
                self._fulfil(call)
            call = self._next()
        if self.worker is not None:
            self.worker.dismiss()

    def _next(self) -> _Call | None:
        """Return the next call; while there is none, have done what is for a spare moment."""
        try:
            return self.calls.get(wait=False)
        except queue.Empty:
            chore, self.spare = self.spare, b""
            self._do(chore)
            return self.calls.get()

    def _do(self, chore: bytes) -> None:
        """Have the worker do something that nobody waits for."""
        if chore:
            self.at_chore.set()
            self._fulfil(_Call(Future(), chore, None))
            self.at_chore.clear()

    def stop(self) -> None:
        """End the worker now."""
        self.stopping.set()
        if (worker := self.worker) is not None:
            worker.kill()

    def _fulfil(self, call: _Call) -> None:
        try:
            result, error = self._attempt(call)
        except Exception as failure:  # the thread must live: others wait in the queue
            result, error = None, failure
        if error is None:
            call.future.set_result(result)
        else:
            call.future.set_exception(error)

    def _attempt(self, call: _Call) -> tuple[Any, BaseException | None]:
        """Let the worker compute a call; one that dies over it is replaced for the next."""
        try:
            if self.worker is None and not self.stopping.is_set():
                self.worker = _Worker(self.name)
            if self.worker is None or self.stopping.is_set():  # `stop` may have come while the worker started
                raise _Gone("stopped")
            return self.worker.compute(call.blob, call.limit)
        except _Gone as gone:
            if self.worker is not None:
                self.worker.end()
            self.worker = None
            if self.stopping.is_set():
                return None, WorkerDied("stopped before it was done")
            return None, WorkerDied(f"the worker process ended: {gone}")
        except RunTimedOut as late:
            self.worker = None
            return None, late


class _Gone(Exception):
    """The worker process is no more."""


class _Worker:
    """A worker process and this end of its pipe."""

    def __init__(self, name: str) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, far_end = context.Pipe()
        self.process: SpawnProcess = context.Process(target=serve, args=(far_end,), name=name, daemon=True)
        try:
            with _free_to_have_children(), _without_main():
                self.process.start()
        finally:
            far_end.close()
        self._receive()  # it is ready

    def compute(self, blob: bytes, limit: float | None) -> tuple[Any, BaseException | None]:
        """Return (result, None) or (None, exception).

        Raises
        ------
        _Gone
            The process has died.
        RunTimedOut
            It took longer than `limit` and was ended.
        """
        try:
            self.pipe.send_bytes(blob)
        except OSError:
            raise self._gone() from None
        self._begun()
        result, error = pickle.loads(self._receive(limit))
        return result, error

    def _begun(self) -> None:
        """Wait until the call has begun; a worker that never gets so far is no fault of the call."""
        try:
            self._receive(LOADING_S)
        except RunTimedOut:
            raise _Gone(f"it was not ready within {LOADING_S:g} s") from None

    def _receive(self, limit: float | None = None) -> bytes:
        if not within(limit, self._is_heard, Hindrance(self.process.pid)):
            self.end()
            raise RunTimedOut(limit or 0.0)
        try:
            if self.pipe.poll():  # an answer may lie there although its sender has ended
                return self.pipe.recv_bytes()
        except (EOFError, OSError):
            pass
        raise self._gone()

    def _is_heard(self, seconds: float | None) -> bool:
        """Wait for word of the process, or its end."""
        return bool(wait([self.pipe, self.process.sentinel], seconds))

    def _gone(self) -> _Gone:
        """See a process off that has closed its end, and say how it ended."""
        self.process.join(PATIENCE_S)
        self.end()
        return _Gone(_ending(self.process.exitcode))

    def kill(self) -> None:
        """End the process, and what it has started, without ceremony."""
        with contextlib.suppress(OSError, ValueError):
            if self.process.pid is not None and self.process.exitcode is None:
                end_family(self.process.pid)
                self.process.kill()

    def end(self) -> None:
        """End the process and wait until it is gone."""
        self.kill()
        self.process.join()
        self.pipe.close()

    def dismiss(self) -> None:
        """Close the pipe, so that the process ends by itself; if it does not, end it."""
        self.pipe.close()
        self.process.join(PATIENCE_S)
        if self.process.is_alive():
            self.kill()
            self.process.join()


def _ending(code: int | None) -> str:
    """Say how a process ended.

    >>> _ending(3)
    'exit code 3'
    """
    if code is None:
        return "no exit code"
    if code < 0:
        with contextlib.suppress(ValueError):
            return f"signal {signal.Signals(-code).name}"
    return f"exit code {code}"


@contextlib.contextmanager
def _free_to_have_children() -> Iterator[None]:
    """Start a process although this one may be a daemon itself, as Dask's workers are.

    `multiprocessing` forbids it lest orphans be left; our workers end with their parent.
    """
    config = multiprocessing.current_process()._config  # type: ignore[attr-defined]
    with _starting:
        daemon = config.pop("daemon", None)
        try:
            yield
        finally:
            if daemon is not None:
                config["daemon"] = daemon


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    """Start a process that does not import the script that runs here: it would begin the study once more.

    So a script, or a notebook, needs no ``if __name__ == "__main__"``; what a worker calls lies in modules.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _block_ctrl_c() -> None:
    """Let processes started by this thread begin with SIGINT blocked, until they can ignore it."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
