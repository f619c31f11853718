"""Ctrl-C and SIGTERM as exceptions.

An exception that a signal handler raises is lost where none can pass: in a callback of the import system Python prints
it and continues. So while a module is imported, and inside `put_off`, a signal is only noted; `raise_noted` raises it,
and all that waits calls that again and again. Only a command sets handlers: scripts and notebooks keep their own.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Terminated(KeyboardInterrupt):
    """SIGTERM, raised as an exception so that `with` blocks close as they do on Ctrl-C."""


KINDS = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: Terminated}
_noted: list[int] = []
_put_off: list[object] = []  # one entry for each block inside which signals are only noted


@contextmanager
def heard() -> Iterator[None]:
    """Have Ctrl-C and SIGTERM, unless ignored, raise exceptions; only the main thread may, others do nothing."""
    former = {number: signal.getsignal(number) for number in KINDS if threading.current_thread() is _MAIN}
    replaced = {number: handler for number, handler in former.items() if handler not in (signal.SIG_IGN, None, _handle)}
    try:
        for number in replaced:
            signal.signal(number, _handle)
        yield
    finally:
        for number, handler in replaced.items():
            signal.signal(number, handler)
        if replaced:
            _noted.clear()


@contextmanager
def put_off() -> Iterator[None]:
    """Put interrupts off to the end of the block, for native code that must not be left in the middle."""
    if threading.current_thread() is not _MAIN:
        yield
        return
    _put_off.append(None)
    try:
        yield
    finally:
        _put_off.pop()
    raise_noted()


def raise_noted() -> None:
    """Raise the last interrupt that has come, be it only noted or lost."""
    if _noted and threading.current_thread() is _MAIN:
        raise KINDS[signal.Signals(_noted[-1])]


def ignore_signals() -> None:
    """Ignore both from now on: there is nothing left to be interrupted but the process's own end."""
    for number in KINDS:
        signal.signal(number, signal.SIG_IGN)


def _handle(number: int, frame: FrameType | None) -> None:
    _noted.append(number)
    while frame is not None and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    is_importing = frame is not None
    if not (_put_off or is_importing):
        raise KINDS[signal.Signals(number)]


_MAIN = threading.main_thread()
