"""Python workers: a child process that executes one function call after the other.

A `Child` receives calls through standard input and replies through standard output. It has the module search path of
this process but does not import the running script. Scripts and notebooks therefore need no ``if __name__ ==
"__main__"``, but a function that a child executes must be defined in a module. The child ends when its input closes,
thus also when its parent ends for any reason.
"""

import atexit
import gc
import os
import pickle
import queue
import select
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import IO, Any, NoReturn, TypeVar, cast

from stemcal.processes.limits import RunTimedOut, next_of
from stemcal.processes.outputs import lossy_stderr
from stemcal.processes.program import APART, GRACE_S, end_family

LOADING_S = 3600.0  # time limit for imports and compilation before a call
_LENGTH = struct.Struct("<Q")
T = TypeVar("T")
_BEGUN = b"begun"
_LOOK_MS = 500  # interval at which the guard process checks its worker


class ChildDied(Exception):
    """Raised if a child process ends before it returns a result; the message has the reason."""


class Child:
    """A process that executes one call after the other, with the environment of this process plus `environment`."""

    def __init__(self, environment: Mapping[str, str] = {}) -> None:
        self._process = subprocess.Popen(
            [sys.executable or "python", "-P", "-c", f"import sys; sys.path[:] = {sys.path!r}; {_SERVE}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **environment},
            start_new_session=True,
            creationflags=APART,
        )
        self.pid = self._process.pid
        self._messages: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        threading.Thread(target=self._listen, name="answers", daemon=True).start()

    def call(self, blob: bytes, limit: float | None = None) -> tuple[Any, BaseException | None]:
        """Execute a pickled (function, args, kwargs); return (result, None), or (None, exception) if it raised.

        The time `limit` (s) starts when the child has imported and compiled everything the call needs. After
        `ChildDied` or `RunTimedOut` the child cannot be used again.
        """
        with suppress(OSError):  # the child has ended: `_receive` raises the error
            _put(self._process.stdin, blob)
        try:
            self._receive(LOADING_S)
        except RunTimedOut:
            raise ChildDied(f"the process was not ready within {LOADING_S:g} s") from None
        result, error = pickle.loads(self._receive(limit))
        return result, error

    def kill(self) -> None:
        """Terminate the process, and all processes that it has started, immediately."""
        end_family(self.pid)
        self._process.wait()

    def dismiss(self) -> None:
        """Close the input of the process: an idle process then ends by itself, a busy one is terminated."""
        with suppress(OSError):
            self._process.stdin.close()  # type: ignore[union-attr]
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE_S)
        self.kill()  # also processes that it started

    def _listen(self) -> None:
        while (message := _next_message(self._process.stdout)) is not None:
            self._messages.put(message)
        self._messages.put(None)

    def _receive(self, limit: float | None) -> bytes:
        try:
            message = next_of(self._messages, limit)
        except queue.Empty:
            raise RunTimedOut(limit or 0.0) from None
        if message is None:
            self._messages.put(None)  # so that a later call does not wait but fails too
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(GRACE_S)
            raise ChildDied(_ending(self._process.poll()))
        return message


def computed_apart(call: Callable[[], T], limit: float | None = None, environment: Mapping[str, str] = {}) -> T:
    """Return the result of `call`, executed in a new process; raise its exception, `ChildDied` or `RunTimedOut`."""
    child = Child(environment)
    try:
        result, error = child.call(pickle.dumps((call, (), {})), limit)
    finally:
        child.kill()
    if error is not None:
        raise error
    return cast(T, result)


def _ending(code: int | None) -> str:
    if code is None:
        return "no exit code"
    if code < 0:
        with suppress(ValueError):
            name = signal.Signals(-code).name
            cause = ", usually because the system ran out of memory" if name == "SIGKILL" else ""
            return f"signal {name}{cause}"
    return f"exit code {code}"


_SERVE = f"from {__name__} import serve; serve()"


def serve() -> None:
    """Execute calls from standard input until it closes. Runs in the child."""
    source, target = _own_pipes()
    if hasattr(os, "fork") and os.fork() == 0:  # forking is safe, because no thread is running yet
        _guard(source, target)
    # The child ends processes that left the session, which the parent cannot find; registered first, this runs last.
    atexit.register(end_family, os.getpid())
    calls: queue.Queue[bytes | None] = queue.Queue()
    threading.Thread(target=_read, args=(source, calls), name="calls", daemon=True).start()
    with suppress(OSError):  # the parent has ended
        while (blob := calls.get()) is not None:
            call, problem = _loaded(blob)
            _put(target, _BEGUN)
            try:
                answer = pickle.dumps((call(), None)) if call is not None else _failed(problem)
            except BaseException as error:  # also SystemExit, raised by a user's function
                answer = _failed(error)
            calls.task_done()  # before the reply, after which the parent may close the pipe
            _put(target, answer)
    gc.freeze()  # avoids a slow garbage collection at exit


def _guard(source: IO[bytes], target: IO[bytes]) -> NoReturn:
    """Wait until the parent or the worker ends, then terminate the worker and all processes that it started.

    The guard is a separate process, because a worker in native code could not notice that its input is closed.
    """
    worker, waiting = os.getppid(), select.poll()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    target.close()  # so that the pipe closes, and the parent notices it, when the worker ends
    waiting.register(source, 0)  # `poll` reports a closed pipe even without a flag
    while os.getppid() == worker and not waiting.poll(_LOOK_MS):
        pass
    with suppress(Exception):
        deadline = time.monotonic() + GRACE_S  # an idle worker ends by itself
        while os.getppid() == worker and time.monotonic() < deadline:
            time.sleep(0.05)
        end_family(worker)
    os._exit(0)


def _own_pipes() -> tuple[IO[bytes], IO[bytes]]:
    """Reserve standard input and output for calls and replies; printed output of a call goes to standard error."""
    source, target = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    with suppress(OSError):
        os.dup2(2, 1)
    lossy_stderr()
    sys.stdout = sys.stderr
    return source, target


def _read(source: IO[bytes], calls: queue.Queue[bytes | None]) -> None:
    """Queue calls until the pipe closes; then end the worker, even during a call."""
    while (blob := _next_message(source)) is not None:
        calls.put(blob)
    if calls.unfinished_tasks:
        end_family(os.getpid())
        os._exit(1)
    calls.put(None)


def _loaded(blob: bytes) -> tuple[Callable[[], Any] | None, BaseException | None]:
    try:
        function, args, kwargs = pickle.loads(blob)
        if hasattr(function, "get_ready"):
            function.get_ready()
    except Exception as error:
        return None, error
    return partial(function, *args, **kwargs), None


def _failed(error: BaseException | None) -> bytes:
    with suppress(Exception):
        answer = pickle.dumps((None, error))
        if isinstance(pickle.loads(answer)[1], Exception):
            return answer
    return pickle.dumps((None, RuntimeError(f"{type(error).__name__}: {error}")))


def _put(stream: IO[bytes] | None, message: bytes) -> None:
    assert stream is not None
    stream.write(_LENGTH.pack(len(message)) + message)
    stream.flush()


def _next_message(stream: IO[bytes] | None) -> bytes | None:
    assert stream is not None
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    size = _LENGTH.unpack(head)[0]
    message = stream.read(size)
    return message if len(message) == size else None
