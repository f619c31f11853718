"""Python processes of our own that are told what to call: through standard input, answered through standard output.

A child finds modules where this process does, but does not import the script that runs here: so a script, or a
notebook, needs no ``if __name__ == "__main__"``; what a child calls lies in modules. It ends when its input closes:
with its parent, in whatever way that ended.
"""

import gc
import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import IO, Any

import psutil

from stemcal.interrupts import next_of

GRACE_S = 2.0  # for a child to end by itself
LOADING_S = 3600.0  # to import what a call needs and to compile
_LENGTH = struct.Struct("<Q")
_BEGUN = b"begun"
_PR_SET_PDEATHSIG = 1  # <linux/prctl.h>


class ChildDied(Exception):
    """The process ended without an answer; the message tells how."""


class ChildLate(Exception):
    """The answer did not come in time."""


class Child:
    """A process that computes one call after the other.

    Parameters
    ----------
    environment : mapping
        Variables that it has beside those of this process.

    Raises
    ------
    OSError
        If it cannot be started.
    """

    def __init__(self, environment: Mapping[str, str] = {}) -> None:
        code = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve({os.getpid()})"
        self._process = subprocess.Popen(
            [sys.executable or "python", "-P", "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **environment},
        )
        self.pid = self._process.pid
        self._messages: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        threading.Thread(target=self._listen, name="answers", daemon=True).start()

    def call(self, blob: bytes, limit: float | None = None) -> tuple[Any, BaseException | None]:
        """Return (result, None) or (None, exception) of a pickled (function, args, kwargs).

        Its time `limit`, s, counts from the moment on at which the child has loaded what the call needs.

        Raises
        ------
        ChildDied, ChildLate
            The child is gone, or not to be asked again.
        """
        self.tell(blob)
        return self.answer(limit)

    def tell(self, blob: bytes) -> None:
        """Have a call computed; its `answer` is to be asked for."""
        with suppress(OSError):  # it is gone, as the answer will tell
            _put(self._process.stdin, blob)

    def answer(self, limit: float | None = None) -> tuple[Any, BaseException | None]:
        """Return what `call` does, of the call that it has been told."""
        try:
            self._receive(LOADING_S)
        except ChildLate:
            raise ChildDied(f"it was not ready within {LOADING_S:g} s") from None
        result, error = pickle.loads(self._receive(limit))
        return result, error

    @property
    def is_alive(self) -> bool:
        """Whether the process is there to be asked."""
        return self._process.poll() is None

    def kill(self) -> None:
        """End the process, and all that it has started, now."""
        if self.is_alive:
            end_tree(self.pid)
        self._process.wait()

    def dismiss(self) -> None:
        """Let the process end by itself, which it does if it has nothing to compute."""
        with suppress(OSError):
            self._process.stdin.close()  # type: ignore[union-attr]
        try:
            self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self.kill()

    def _listen(self) -> None:
        while (message := _taken(self._process.stdout)) is not None:
            self._messages.put(message)
        self._messages.put(None)

    def _receive(self, limit: float | None) -> bytes:
        try:
            message = next_of(self._messages, limit)
        except queue.Empty:
            raise ChildLate from None
        if message is None:
            self._messages.put(None)  # for a caller that asks again
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(GRACE_S)
            raise ChildDied(_ending(self._process.poll()))
        return message


def _ending(code: int | None) -> str:
    """Return how a process ended.

    >>> _ending(3), _ending(-9)
    ('exit code 3', 'signal SIGKILL, usually for lack of memory')
    """
    if code is None:
        return "no exit code"
    if code < 0:
        with suppress(ValueError):
            name = signal.Signals(-code).name
            return f"signal {name}, usually for lack of memory" if name == "SIGKILL" else f"signal {name}"
    return f"exit code {code}"


def end_tree(pid: int) -> None:
    """Kill a process, its descendants and the process groups that these lead; what is gone already is no error.

    A worker that runs an external program has children, often in groups of their own: killed alone, it would leave
    them computing.
    """
    with suppress(psutil.Error):
        root = psutil.Process(pid)
        descendants = root.children(recursive=True)
        root.kill()
        for process in descendants:
            if sys.platform != "win32":
                with suppress(OSError):
                    if os.getpgid(process.pid) == process.pid:
                        os.killpg(process.pid, signal.SIGKILL)
            with suppress(psutil.Error):
                process.kill()


# ---- in the child


def serve(parent: int) -> None:
    """Answer calls from standard input until it closes. Runs in the child."""
    _leave_signals_to_parent()
    _end_with_thread_of(parent)
    source, target = _own_pipes()
    calls: queue.Queue[bytes | None] = queue.Queue()
    threading.Thread(target=_read, args=(source, calls), name="calls", daemon=True).start()
    with suppress(OSError):  # the caller is gone
        while (blob := calls.get()) is not None:
            call, problem = _loaded(blob)
            _put(target, _BEGUN)
            answer = _computed(call) if call is not None else _failed(problem)
            calls.task_done()  # before the parent hears of it, and may close the pipe
            _put(target, answer)
    gc.freeze()  # the interpreter would search all that is loaded for garbage before it ends


def _leave_signals_to_parent() -> None:
    """Ctrl-C reaches every process of a terminal; the parent decides what it means."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _own_pipes() -> tuple[IO[bytes], IO[bytes]]:
    """Take the pipes of standard input and output for the calls; what a call prints goes to standard error."""
    source, target = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    with suppress(OSError):
        os.dup2(2, 1)
    return source, target


def _end_with_thread_of(parent: int) -> None:
    """Ask Linux to kill this process when the thread that started it ends.

    `_read` ends it everywhere, but has to wait while compiled code holds the interpreter's lock.
    """
    if sys.platform == "linux":
        import ctypes

        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # it died before we asked
            os._exit(1)


def _read(source: IO[bytes], calls: queue.Queue[bytes | None]) -> None:
    """Take calls until the pipe closes; then no answer is wanted, and the process ends, be it at work or not."""
    while (blob := _taken(source)) is not None:
        calls.put(blob)
    if calls.unfinished_tasks:
        os._exit(1)
    calls.put(None)


def _loaded(blob: bytes) -> tuple[Callable[[], Any] | None, BaseException | None]:
    """Return a pickled call, once it and what it needs are loaded, or why it cannot be.

    A function with a method `get_ready` is made ready.
    """
    try:
        function, args, kwargs = pickle.loads(blob)
        if hasattr(function, "get_ready"):
            function.get_ready()
    except Exception as error:
        return None, error
    return partial(function, *args, **kwargs), None


def _computed(call: Callable[[], Any]) -> bytes:
    try:
        return pickle.dumps((call(), None))
    except BaseException as error:  # SystemExit from a user's function is an answer too
        return _failed(error)


def _failed(error: BaseException | None) -> bytes:
    return pickle.dumps((None, error and _portable(error)))


def _portable(error: BaseException) -> BaseException:
    """Return the error if it survives a pickle, else a `RuntimeError` that says the same."""
    plain = RuntimeError(f"{type(error).__name__}: {error}")
    if not isinstance(error, Exception):
        return plain
    try:
        copy: Any = pickle.loads(pickle.dumps(error))
    except Exception:
        return plain
    return error if isinstance(copy, Exception) else plain


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
