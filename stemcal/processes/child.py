"""Python workers: a process that computes one call after the other.

A `Child` is called through standard input and answers through standard output. It finds modules where this process
does, but does not import the script that runs here: so a script, or a notebook, needs no ``if __name__ ==
"__main__"``; what a child calls is in modules. It ends when its input closes: with its parent, in any way that
ended.
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

from stemcal.processes.family import APART, GRACE_S, end_family
from stemcal.processes.limits import RunTimedOut, next_of
from stemcal.processes.outputs import lossy_stderr

LOADING_S = 3600.0  # to import what a call needs and to compile
_LENGTH = struct.Struct("<Q")
T = TypeVar("T")
_BEGUN = b"begun"
_LOOK_MS = 500  # between two looks of a guard at its worker


class ChildDied(Exception):
    """The process ended without an answer; the message is the reason."""


class Child:
    """A process that computes one call after the other; `environment` adds variables to those of this process."""

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
        """Return (result, None) or (None, exception) of a pickled (function, args, kwargs).

        Its time `limit`, s, counts from the moment on at which the child has loaded what the call needs. Raises
        `ChildDied` or `RunTimedOut` if the child is gone, or not to be asked again.
        """
        with suppress(OSError):  # it is gone, as the answer will show
            _put(self._process.stdin, blob)
        try:
            self._receive(LOADING_S)
        except RunTimedOut:
            raise ChildDied(f"the process was not ready within {LOADING_S:g} s") from None
        result, error = pickle.loads(self._receive(limit))
        return result, error

    def kill(self) -> None:
        """End the process, and all that it has started, now."""
        end_family(self.pid)
        self._process.wait()

    def dismiss(self) -> None:
        """Close the input of the process, which then ends if it has nothing to compute."""
        with suppress(OSError):
            self._process.stdin.close()  # type: ignore[union-attr]
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE_S)
        self.kill()  # what is left of it

    def _listen(self) -> None:
        while (message := _taken(self._process.stdout)) is not None:
            self._messages.put(message)
        self._messages.put(None)

    def _receive(self, limit: float | None) -> bytes:
        try:
            message = next_of(self._messages, limit)
        except queue.Empty:
            raise RunTimedOut(limit or 0.0) from None
        if message is None:
            self._messages.put(None)  # for a caller that asks again
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(GRACE_S)
            raise ChildDied(_ending(self._process.poll()))
        return message


def computed_apart(call: Callable[[], T], limit: float | None = None, environment: Mapping[str, str] = {}) -> T:
    """Return a call's result from its own process; `ChildDied` without an answer, `RunTimedOut` after `limit` s."""
    child = Child(environment)
    try:
        result, error = child.call(pickle.dumps((call, (), {})), limit)
    finally:
        child.kill()
    if error is not None:
        raise error
    return cast(T, result)


def _ending(code: int | None) -> str:
    """Return the end of a process in words."""
    if code is None:
        return "no exit code"
    if code < 0:
        with suppress(ValueError):
            name = signal.Signals(-code).name
            cause = ", usually because the system ran out of memory" if name == "SIGKILL" else ""
            return f"signal {name}{cause}"
    return f"exit code {code}"


# ---- in the child


_SERVE = f"from {__name__} import serve; serve()"


def serve() -> None:
    """Answer calls from standard input until it closes. Runs in the child."""
    source, target = _own_pipes()
    if hasattr(os, "fork") and os.fork() == 0:  # no thread is running yet
        _guard(source, target)
    atexit.register(end_family, os.getpid())  # the last to run; the parent would not find what has left the session
    calls: queue.Queue[bytes | None] = queue.Queue()
    threading.Thread(target=_read, args=(source, calls), name="calls", daemon=True).start()
    with suppress(OSError):  # the caller is gone
        while (blob := calls.get()) is not None:
            call, problem = _loaded(blob)
            _put(target, _BEGUN)
            try:
                answer = pickle.dumps((call(), None)) if call is not None else _failed(problem)
            except BaseException as error:  # SystemExit from a user's function is an answer too
                answer = _failed(error)
            calls.task_done()  # before the parent hears of it, and may close the pipe
            _put(target, answer)
    gc.freeze()  # the interpreter would search all that is loaded for garbage before it ends


def _guard(source: IO[bytes], target: IO[bytes]) -> NoReturn:
    """End the worker's family when caller or worker is gone; native code cannot notice the closed input itself."""
    worker, waiting = os.getppid(), select.poll()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    target.close()  # the caller reads its end as the end of the worker
    waiting.register(source, 0)  # the closing of a pipe is always reported
    while os.getppid() == worker and not waiting.poll(_LOOK_MS):
        pass
    with suppress(Exception):
        deadline = time.monotonic() + GRACE_S  # for a worker that has nothing to compute
        while os.getppid() == worker and time.monotonic() < deadline:
            time.sleep(0.05)
        end_family(worker)
    os._exit(0)


def _own_pipes() -> tuple[IO[bytes], IO[bytes]]:
    """Take the pipes of standard input and output for the calls; what a call prints goes to standard error."""
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
    """Take calls until the pipe closes; then no answer is wanted, and all ends that is still at work."""
    while (blob := _taken(source)) is not None:
        calls.put(blob)
    if calls.unfinished_tasks:
        end_family(os.getpid())
        os._exit(1)
    calls.put(None)


def _loaded(blob: bytes) -> tuple[Callable[[], Any] | None, BaseException | None]:
    """Return a pickled call, with what it needs loaded and `get_ready` called, or why it cannot be."""
    try:
        function, args, kwargs = pickle.loads(blob)
        if hasattr(function, "get_ready"):
            function.get_ready()
    except Exception as error:
        return None, error
    return partial(function, *args, **kwargs), None


def _failed(error: BaseException | None) -> bytes:
    """Return an error as an answer; one that does not survive a pickle, or is no `Exception`, as a `RuntimeError`."""
    with suppress(Exception):
        answer = pickle.dumps((None, error))
        if isinstance(pickle.loads(answer)[1], Exception):
            return answer
    return pickle.dumps((None, RuntimeError(f"{type(error).__name__}: {error}")))


def _put(stream: IO[bytes] | None, message: bytes) -> None:
    assert stream is not None
    stream.write(_LENGTH.pack(len(message)) + message)
    stream.flush()


def _taken(stream: IO[bytes] | None) -> bytes | None:
    """Return the next message, None where there are no more."""
    assert stream is not None
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    size = _LENGTH.unpack(head)[0]
    message = stream.read(size)
    return message if len(message) == size else None
