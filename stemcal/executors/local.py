"""The executor of one machine: a fixed number of worker processes, each of them expendable.

`ProcessPoolExecutor` gives up every pending run when one worker dies. Here a dead worker costs the run it was
at, nothing else: the run is tried once more in a new process, then its future gets `WorkerDied`.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import queue
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from multiprocessing.connection import wait
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import Any, NamedTuple, ParamSpec, TypeVar

from stemcal.errors import StemcalError
from stemcal.executors.worker import serve

P = ParamSpec("P")
T = TypeVar("T")

ATTEMPTS = 2
PATIENCE_S = 2.0  # between asking a worker to end and ending it


class WorkerDied(StemcalError):
    """The process that computed a run ended, twice, without an answer."""


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class LocalExecutor(Executor):
    """Computes calls in `workers` processes of this machine.

    Parameters
    ----------
    workers : int, optional
        How many; default, one per core. Processes start when there is work for them, by ``spawn``.

    Notes
    -----
    Leaving a ``with`` block by an exception (Ctrl-C) ends the workers at once and cancels what has not begun.
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = max(1, workers if workers is not None else available_cores())
        self._calls: queue.SimpleQueue[_Call | None] = queue.SimpleQueue()
        self._crews: list[_Crew] = []
        self._closed = False
        self._lock = threading.Lock()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Queue a call; function, arguments and result must be picklable."""
        future: Future[T] = Future()
        blob = pickle.dumps((fn, args, kwargs))
        with self._lock:
            if self._closed:
                raise RuntimeError("cannot submit to an executor that is shut down")
            self._calls.put(_Call(future, blob))
            if len(self._crews) < self.workers:
                crew = _Crew(self._calls, f"worker {len(self._crews) + 1}")
                self._crews.append(crew)
                crew.start()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Take no more calls; finish what is queued, or cancel it; then end the workers."""
        with self._lock:
            self._closed = True
        if cancel_futures:
            self._cancel_queued()
        for _ in self._crews:
            self._calls.put(None)
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

    def _cancel_queued(self) -> None:
        with contextlib.suppress(queue.Empty):
            while True:
                call = self._calls.get_nowait()
                if call is not None:
                    call.future.cancel()
                    call.future.set_running_or_notify_cancel()


class _Call(NamedTuple):
    """A future and the pickled call that will fill it."""

    future: Future[Any]
    blob: bytes


class _Crew(threading.Thread):
    """A thread that feeds one worker process and replaces it when it dies.

    It starts the process itself and outlives it: on Linux a worker dies with the thread that started it.
    """

    def __init__(self, calls: queue.SimpleQueue[_Call | None], name: str) -> None:
        super().__init__(name=name, daemon=True)
        self.calls = calls
        self.stopping = threading.Event()
        self.worker: _Worker | None = None

    def run(self) -> None:
        """Feed the worker until there is no more work."""
        _block_ctrl_c()
        while (call := self.calls.get()) is not None:
            if call.future.set_running_or_notify_cancel():
                self._fulfil(call)
        if self.worker is not None:
            self.worker.dismiss()

    def stop(self) -> None:
        """End the worker now."""
        self.stopping.set()
        if (worker := self.worker) is not None:
            worker.kill()

    def _fulfil(self, call: _Call) -> None:
        try:
            result, error = self._attempt(call.blob)
        except Exception as failure:  # the thread must live: others wait in the queue
            result, error = None, failure
        if error is None:
            call.future.set_result(result)
        else:
            call.future.set_exception(error)

    def _attempt(self, blob: bytes) -> tuple[Any, BaseException | None]:
        """Let the worker compute a call; a worker that dies over it is replaced, once."""
        causes: list[str] = []
        while len(causes) < ATTEMPTS and not self.stopping.is_set():
            try:
                if self.worker is None:
                    self.worker = _Worker(self.name)
                if self.stopping.is_set():  # `stop` may have come while the worker started
                    self.worker.kill()
                return self.worker.compute(blob)
            except _Gone as gone:
                self.worker = None
                causes.append(str(gone))
        if self.stopping.is_set():
            return None, WorkerDied("stopped before it was done")
        return None, WorkerDied(f"the worker process ended {len(causes)} times: {'; '.join(causes)}")


class _Gone(Exception):
    """The worker process is no more."""


class _Worker:
    """A worker process and this end of its pipe."""

    def __init__(self, name: str) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, far_end = context.Pipe()
        self.process: SpawnProcess = context.Process(target=serve, args=(far_end,), name=name, daemon=True)
        try:
            self.process.start()
        finally:
            far_end.close()
        self._receive()  # it is ready

    def compute(self, blob: bytes) -> tuple[Any, BaseException | None]:
        """Return (result, None) or (None, exception); raise `_Gone` if the process dies."""
        try:
            self.pipe.send_bytes(blob)
        except OSError:
            raise self._gone() from None
        result, error = pickle.loads(self._receive())
        return result, error

    def _receive(self) -> bytes:
        wait([self.pipe, self.process.sentinel])
        try:
            if self.pipe.poll():  # an answer may lie there although its sender has ended
                return self.pipe.recv_bytes()
        except (EOFError, OSError):
            pass
        raise self._gone()

    def _gone(self) -> _Gone:
        self.process.join(PATIENCE_S)
        self.kill()
        self.process.join()
        self.pipe.close()
        return _Gone(_ending(self.process.exitcode))

    def kill(self) -> None:
        """End the process without ceremony."""
        with contextlib.suppress(OSError, ValueError):
            self.process.kill()

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


def _block_ctrl_c() -> None:
    """Let processes started by this thread begin with SIGINT blocked, until they can ignore it."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
