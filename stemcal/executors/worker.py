"""What runs in a worker process: take a call from the pipe, answer, wait for the next.

The process ends when the pipe closes or its parent dies, whichever it sees first: a killed study leaves no
orphan.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from stemcal.leaving import leave_at_once
from stemcal.solvers.protocol import Readied

_ONE_THREAD = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)

READY = b"ready"
BEGUN = b"begun"
_PR_SET_PDEATHSIG = 1  # <linux/prctl.h>


def serve(pipe: Connection) -> None:
    """Answer calls until the pipe closes. Runs as the main function of a worker process."""
    _leave_signals_to_parent()
    _use_one_thread()
    _keep_stdout_clean()
    _let_linux_end_it()
    threading.Thread(target=_end_with_parent, name="end with parent", daemon=True).start()
    try:
        pipe.send_bytes(READY)
        while True:
            _take(pipe.recv_bytes(), pipe)
    except (EOFError, OSError):
        leave_at_once(0)  # the parent has closed the pipe: no more work


def _take(blob: bytes, pipe: Connection) -> None:
    """Say `BEGUN` once the call and what it needs is loaded; answer the pickled (result, None) or (None, exception).

    A function that is `Readied` is made ready first: its time limit counts from `BEGUN` on.
    """
    try:
        function, args, kwargs = pickle.loads(blob)
        if isinstance(function, Readied):
            function.get_ready()
        problem = None
    except Exception as error:
        problem = error
    pipe.send_bytes(BEGUN)
    pipe.send_bytes(_failed(problem) if problem is not None else _answer(function, args, kwargs))


def _answer(function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> bytes:
    try:
        return pickle.dumps((function(*args, **kwargs), None))
    except BaseException as error:  # SystemExit from a user's function is an answer too
        return _failed(error)


def _failed(error: BaseException) -> bytes:
    return pickle.dumps((None, _portable(error)))


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


def _leave_signals_to_parent() -> None:
    """Ctrl-C reaches every process of a terminal; the parent decides what it means."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _use_one_thread() -> None:
    """Let libraries that are imported from now on compute with one thread: the runs share the cores."""
    for name in _ONE_THREAD:
        os.environ[name] = "1"


def _keep_stdout_clean() -> None:
    """Send whatever a run prints to stderr: stdout belongs to the command's tables or JSON."""
    with contextlib.suppress(OSError):
        os.dup2(2, 1)


def _let_linux_end_it() -> None:
    """Ask Linux to kill this process when the thread that started it ends.

    The thread of `_end_with_parent` does the same everywhere, but has to wait while compiled code holds the
    interpreter's lock.
    """
    parent = multiprocessing.parent_process()
    if sys.platform != "linux" or parent is None:
        return
    import ctypes

    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent.pid:  # it died before we asked
        os._exit(1)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()  # returns when the parent is gone, even by SIGKILL
        os._exit(1)
