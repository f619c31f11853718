"""Reading in a process beside this one, which can be ended: neither a regular expression nor a parser can be stopped.

The process starts with the first reading that needs it and serves all others of its worker; it ends with it.
"""

from __future__ import annotations

import pickle
import queue
import struct
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import IO, Any, ParamSpec, TypeVar

from stemcal.interrupts import wait_until
from stemcal.solvers.processes import KEEPER
from stemcal.solvers.programs.reductions import NoResult

__all__ = ["LEAST_READING_S", "run_in_helper", "serve"]

P = ParamSpec("P")
T = TypeVar("T")

STARTING_S = 60.0
LEAST_READING_S = 2.0  # also after a program that took all of its time
_LENGTH = struct.Struct("<Q")
_SERVING = "from stemcal.solvers.programs.helper_process import serve; serve()"


def run_in_helper(seconds: float, function: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> T:
    """Return what a function of a module gives, called in the process beside this one.

    Raises
    ------
    NoResult
        ``timeout`` if it takes longer than so many seconds, ``bad_result`` if the process died of it.
    """
    with _lock:
        answer: T = _process().call(pickle.dumps((function, args, kwargs)), seconds)
        return answer


class _Beside:
    """The process and what it has said."""

    def __init__(self) -> None:
        KEEPER.wake()
        self.process = subprocess.Popen(
            [sys.executable, "-c", _SERVING],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        KEEPER.watch(self.process.pid)
        self.said: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._heard: bytes | None = None
        threading.Thread(target=self._listen, name="reading", daemon=True).start()
        self._hear(STARTING_S)

    def call(self, blob: bytes, seconds: float) -> Any:
        """Return what the call gives; one that is late ends the process."""
        try:
            _put(self.process.stdin, blob)
        except OSError:
            raise self._gone() from None
        result, error = pickle.loads(self._hear(seconds))
        if error is not None:
            raise error
        return result

    def _hear(self, seconds: float) -> bytes:
        if not wait_until(seconds, self._is_heard):
            self.end()
            raise NoResult("timeout", "reading the result took longer than what was left of solver.time_limit")
        if self._heard is None:
            raise self._gone()
        return self._heard

    def _is_heard(self, seconds: float) -> bool:
        try:
            self._heard = self.said.get(timeout=seconds)
        except queue.Empty:
            return False
        return True

    def _listen(self) -> None:
        while (blob := _taken(self.process.stdout)) is not None:
            self.said.put(blob)
        self.said.put(None)

    def _gone(self) -> NoResult:
        self.end()
        return NoResult("bad_result", f"the process that read the result ended with code {self.process.returncode}")

    def end(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.wait()
        KEEPER.forget(self.process.pid)

    @property
    def lives(self) -> bool:
        """Whether it can be called."""
        return self.process.poll() is None


_lock = threading.Lock()
_running: list[_Beside] = []


def _process() -> _Beside:
    if not (_running and _running[-1].lives):
        _running[:] = [_Beside()]
    return _running[-1]


def serve() -> None:
    """Answer calls from standard input until it closes. Runs in the process beside."""
    given, taken = sys.stdin.buffer, sys.stdout.buffer
    sys.stdout = sys.stderr
    _put(taken, b"ready")
    while (blob := _taken(given)) is not None:
        function, args, kwargs = pickle.loads(blob)
        try:
            answer = pickle.dumps((function(*args, **kwargs), None))
        except NoResult as failure:
            answer = pickle.dumps((None, failure))
        except MemoryError:
            answer = pickle.dumps((None, NoResult("bad_result", "there is not enough memory to read the result")))
        except Exception as failure:
            answer = pickle.dumps((None, NoResult("bad_result", f"{type(failure).__name__}: {failure}")))
        _put(taken, answer)


def _put(stream: IO[bytes] | None, blob: bytes) -> None:
    if stream is not None:
        stream.write(_LENGTH.pack(len(blob)) + blob)
        stream.flush()


def _taken(stream: IO[bytes] | None) -> bytes | None:
    """Return the next message, None where there are no more."""
    head = stream.read(_LENGTH.size) if stream is not None else b""
    if stream is None or len(head) < _LENGTH.size:
        return None
    size = _LENGTH.unpack(head)[0]
    blob = stream.read(size)
    return blob if len(blob) == size else None
