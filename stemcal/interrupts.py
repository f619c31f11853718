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
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import inf
from types import FrameType
from typing import Any

_Takes = Callable[[int, FrameType | None], None]

HEARTBEAT_S = 0.5  # how long Ctrl-C may have to wait on Windows, where a wait without end hears none
_PATIENCE = 1.0  # s, until an interrupt that nobody deals with is raised again
_LOOK = 0.1  # s, between looks for whether one is due


class Terminated(KeyboardInterrupt):
    """SIGTERM, raised as an exception so that `with` blocks close as they do on Ctrl-C."""


KINDS = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: Terminated}


@contextmanager
def heard(*numbers: signal.Signals) -> Iterator[list[int]]:
    """Let signals raise exceptions inside the block, again and again until one is dealt with.

    Yields the signals that have come: an error after one may be what a library has made of it. A signal that is
    ignored today stays so. Only the main thread may set handlers; in another nothing is done. A generator with a
    ``finally`` that takes longer than a second needs `contextlib.closing` to be left in peace.
    """
    came: list[int] = []
    handlers = {number: _Handler(KINDS[number], came) for number in numbers if _can_be_heard(number)}
    over: list[bool] = []
    if handlers:
        threading.Thread(target=_repeat, args=(handlers, over), name="repeat interrupts", daemon=True).start()
    with _installed(handlers, over):
        yield came


@contextmanager
def put_off() -> Iterator[None]:
    """Put interrupts off to the end of the block, for what must not be broken off in the middle.

    Only the main thread may set handlers; in another nothing is done.
    """
    came: list[int] = []
    over: list[bool] = []
    former = {number: signal.getsignal(number) for number in KINDS if _can_be_heard(number)}
    handlers: dict[signal.Signals, Any] = {number: handler for number, handler in former.items() if callable(handler)}

    def note(number: int, frame: FrameType | None) -> None:
        came.append(number)
        if over:
            handlers[signal.Signals(number)](number, frame)

    try:
        with _installed(dict.fromkeys(handlers, note), over):
            yield
    finally:
        if came:
            handlers[signal.Signals(came[0])](came[0], None)


@contextmanager
def _installed(handlers: Mapping[signal.Signals, _Takes], over: list[bool]) -> Iterator[None]:
    """Have these handlers inside the block, the former ones after it; `over` is true as soon as it ends."""
    before = {number: signal.getsignal(number) for number in handlers}
    try:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        yield
    finally:
        over.append(True)
        for number, former in before.items():
            signal.signal(number, former)


def _can_be_heard(number: signal.Signals) -> bool:
    """Tell whether this thread may set a handler, and the present one is neither to ignore it nor out of reach."""
    is_main = threading.current_thread() is threading.main_thread()
    return is_main and signal.getsignal(number) not in (signal.SIG_IGN, None)


class _Handler:
    """Raises an exception for each signal that comes, and for a repeated one unless it is being dealt with.

    It takes no lock: a signal may come while another is being handled.
    """

    def __init__(self, kind: type[KeyboardInterrupt], came: list[int]) -> None:
        self._kind, self._came = kind, came
        self.due = inf  # when it is to be repeated, s
        self.repeats = False

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        repeats, self.repeats = self.repeats, False
        self.due = time.monotonic() + _PATIENCE
        if repeats and _dealt_with():
            return
        self._came.append(number)
        raise self._kind


def _repeat(handlers: Mapping[signal.Signals, _Handler], over: Sequence[bool]) -> None:
    """Send signals to the main thread again when they are due, until all is over; runs in a thread."""
    while not over:
        time.sleep(_LOOK)
        for number, handler in handlers.items():
            if time.monotonic() > handler.due and not over:
                handler.due, handler.repeats = inf, True
                _send_to_main(number)


def _send_to_main(number: signal.Signals) -> None:
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, number)  # it wakes a main thread that waits
    else:
        _thread.interrupt_main(number)


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
