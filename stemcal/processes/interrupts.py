"""Ctrl-C and SIGTERM as exceptions.

An exception raised by a signal handler can be lost: in a callback of the import system, Python prints it and continues.
Therefore a signal is only recorded while a module is imported and inside `put_off`. `raise_noted`, which every waiting
loop calls, raises it later. Only the commands of stemcal install handlers; those of scripts and notebooks are kept.
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
_put_off: list[object] = []  # one entry for each active `put_off` block


@contextmanager
def raising_interrupts() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM, unless ignored, raise exceptions; without effect outside the main thread."""
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
    """Delay interrupts to the end of the block, for native code that must not be interrupted."""
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
    """Raise the last recorded interrupt, even if it was raised before and the exception was lost."""
    if _noted and threading.current_thread() is _MAIN:
        raise KINDS[signal.Signals(_noted[-1])]


def ignore_signals() -> None:
    """Ignore Ctrl-C and SIGTERM from now on, so that the process can end undisturbed."""
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
