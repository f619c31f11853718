"""Ctrl-C and SIGTERM as exceptions that do not get lost.

Python prints and forgets an exception that is raised where none can pass: in a callback of the import system, of native
code, or of an object's end. For an interrupt that means a program that goes on although it was told to end.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Callable

_MOMENT = 0.01  # s, for the callback to have returned


class Terminated(KeyboardInterrupt):
    """SIGTERM, raised as an exception so that `with` blocks close as they do on Ctrl-C."""


class Hearing:
    """A `sys.unraisablehook` that raises lost interrupts again, in the main thread.

    Once one has come nothing else is told of: what it has left half made complains when it is deleted.

    Parameters
    ----------
    report : callable, optional
        Told of everything else; default, whoever is told of it today.

    Examples
    --------
    >>> import sys
    >>> before, sys.unraisablehook = sys.unraisablehook, Hearing()
    >>> sys.unraisablehook = before
    """

    def __init__(self, report: Callable[[sys.UnraisableHookArgs], object] | None = None) -> None:
        self.interrupted = False
        self._report = report or sys.unraisablehook
        self._timers: list[threading.Timer] = []

    def __call__(self, lost: sys.UnraisableHookArgs) -> None:
        """Take what Python could not raise."""
        if issubclass(lost.exc_type, KeyboardInterrupt):
            self.interrupted = True
            number = signal.SIGTERM if issubclass(lost.exc_type, Terminated) else signal.SIGINT
            self._timers.append(threading.Timer(_MOMENT, _thread.interrupt_main, [number]))
            self._timers[-1].start()
        elif not self.interrupted:
            self._report(lost)

    def rest(self) -> None:
        """Raise none again that has not been yet."""
        for timer in self._timers:
            timer.cancel()
