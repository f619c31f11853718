"""A worker process of this machine and the thread that feeds it."""

from __future__ import annotations

import contextlib
import multiprocessing
import pickle
import queue
import signal
import sys
import threading
import types
from collections.abc import Iterator
from concurrent.futures import Future
from multiprocessing.connection import wait
from multiprocessing.context import SpawnProcess
from typing import Any

from stemcal.executors.calls import Call, Calls
from stemcal.executors.failures import RunTimedOut, WorkerDied
from stemcal.executors.family import end_family
from stemcal.executors.worker import serve
from stemcal.patience import Hindrance, within

PATIENCE_S = 2.0  # between asking a worker to end and ending it
LOADING_S = 3600.0  # to import what a call needs and to compile; the limit of the call itself comes after
_starting = threading.Lock()


class Crew(threading.Thread):
    """A thread that feeds one worker process and replaces it when it dies.

    It starts the process itself and outlives it: on Linux a worker dies with the thread that started it.
    """

    def __init__(self, calls: Calls, name: str, ready: bytes, spare: bytes) -> None:
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

    def _next(self) -> Call | None:
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
            self._fulfil(Call(Future(), chore, None))
            self.at_chore.clear()

    def stop(self) -> None:
        """End the worker now."""
        self.stopping.set()
        if (worker := self.worker) is not None:
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
