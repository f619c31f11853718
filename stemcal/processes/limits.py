"""The time limit of a run, `solver.time_limit` of a spec: waiting that ends with it, and the error beyond it.

A run in a worker process is limited in `processes.child.Child`, a program in `processes.program.run_program`. The
clock starts with the run: loading and compiling in a worker do not count, nor does time while this process is stopped.
"""

import queue
from collections.abc import Callable
from contextlib import suppress
from math import inf
from typing import TypeVar

from stemcal.errors import StemcalError
from stemcal.processes.interrupts import raise_noted

T = TypeVar("T")

SLICE_S = 0.25  # of a wait: on Windows one without end hears no Ctrl-C


class RunTimedOut(StemcalError):
    """A run took longer than its time limit and was ended."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        super().__init__(f"the run exceeded its time limit of {limit:g} s and was terminated")


def wait_until(limit: float | None, wait: Callable[[float], bool]) -> bool:
    """Wait until `wait(seconds)` returns true; at most `limit` seconds, None for ever.

    Time is counted in slices, each of them once, however late this process wakes from it: one that is stopped (Ctrl-Z,
    a batch system that suspends jobs) finds that hours have passed when it continues, in which no work was done.

    >>> wait_until(1.0, lambda seconds: False), wait_until(None, lambda seconds: True)
    (False, True)
    """
    left = inf if limit is None else limit
    while left > 0.0:
        raise_noted()
        if wait(min(SLICE_S, left)):
            return True
        left -= SLICE_S
    return wait(0.0)


def next_of(source: queue.SimpleQueue[T], limit: float | None = None) -> T:
    """Wait for the next item of a queue, at most `limit` seconds; then raise `queue.Empty`."""
    items: list[T] = []

    def has_come(seconds: float) -> bool:
        with suppress(queue.Empty):
            items.append(source.get(timeout=seconds))
        return bool(items)

    if not wait_until(limit, has_come):
        raise queue.Empty
    return items[0]
