"""Ctrl-C and SIGTERM as exceptions that do not get lost.

An exception that comes at any moment may be raised where none can pass (in a callback of the import system, of native
code, of an object's end): Python prints it and goes on. Or a library takes it for the sign that something is missing,
or makes another error of it. For an interrupt that would mean a program that goes on although it was told to end.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_PATIENCE = 1.0  # s, until an interrupt that nobody deals with is raised again


class Terminated(KeyboardInterrupt):
    """SIGTERM, raised as an exception so that `with` blocks close as they do on Ctrl-C."""


KINDS = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: Terminated}


@contextmanager
def heard(*numbers: signal.Signals) -> Iterator[list[int]]:
    """Let signals raise exceptions inside the block, again and again until one is dealt with.

    Yields the signals that have come: an error after one may be what a library has made of it. A signal that is
    ignored today stays so. Only the main thread may set handlers; in another nothing is done.
    """
    came: list[int] = []
    handlers: list[_Handler] = []
    before: dict[int, Any] = {}
    try:
        if threading.current_thread() is threading.main_thread():
            for number in numbers:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    handlers.append(_Handler(KINDS[number], came))
                    before[number] = signal.signal(number, handlers[-1])
        yield came
    finally:
        for handler in handlers:
            handler.rest()
        for known, former in before.items():
            signal.signal(known, former)


class _Handler:
    """Raises an exception for each signal that comes, and once more for one that nobody has dealt with."""

    def __init__(self, kind: type[KeyboardInterrupt], came: list[int]) -> None:
        self._kind, self._came = kind, came
        self._timer: threading.Timer | None = None
        self._repeats = False

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        repeats, self._repeats = self._repeats, False
        self.rest()
        self._timer = threading.Timer(_PATIENCE, self._repeat, [signal.Signals(number)])
        self._timer.daemon = True
        self._timer.start()
        if repeats and _dealt_with():
            return
        self._came.append(number)
        raise self._kind

    def _repeat(self, number: signal.Signals) -> None:
        self._repeats = True
        _thread.interrupt_main(number)

    def rest(self) -> None:
        """Raise no more."""
        if self._timer is not None:
            self._timer.cancel()


def _dealt_with() -> bool:
    """Tell whether an ``except``, ``finally`` or the end of a ``with`` is at work on an interrupt."""
    error = sys.exc_info()[1]
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


class QuietHook:
    """A `sys.unraisablehook` that tells nothing of interrupts, nor, after one, of what it has left half made.

    Parameters
    ----------
    report : callable, optional
        Told of everything else; default, whoever is told of it today.
    """

    def __init__(self, report: Callable[[sys.UnraisableHookArgs], object] | None = None) -> None:
        self.interrupted = False
        self._report = report or sys.unraisablehook

    def __call__(self, lost: sys.UnraisableHookArgs) -> None:
        """Take what Python could not raise."""
        self.interrupted |= issubclass(lost.exc_type, KeyboardInterrupt)
        if not self.interrupted:
            self._report(lost)
