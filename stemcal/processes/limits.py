"""Waiting with a time limit, and the error of a run that exceeds its limit (`solver.time_limit` of a spec).

`processes.child.Child` applies the limit to a run in a worker, `processes.program.run_program` to a program. Loading
and compiling in a worker do not count, nor does time while this process is suspended.
"""

import queue
from collections.abc import Callable
from contextlib import suppress
from math import inf
from typing import TypeVar

from stemcal.errors import StemcalError
from stemcal.processes.interrupts import raise_noted

T = TypeVar("T")

_SLICE_S = 0.25  # longest single wait: on Windows, Ctrl-C cannot interrupt a wait without limit


class RunTimedOut(StemcalError):
    """Raised for a run that took longer than its time limit and was ended."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        super().__init__(f"the run exceeded its time limit of {limit:g} s and was terminated")


def wait_until(limit: float | None, wait: Callable[[float], bool]) -> bool:
    """Wait until `wait(seconds)` returns True, at most `limit` seconds (None: without limit); return its last result.

    The limit applies to the sum of the single waits, not to the time of the clock: while this process is suspended
    (Ctrl-Z, a batch system), hours may pass in which no work is done.

    >>> wait_until(1.0, lambda seconds: False), wait_until(None, lambda seconds: True)
    (False, True)
    """
    left = inf if limit is None else limit
    while left > 0.0:
        raise_noted()
        if wait(min(_SLICE_S, left)):
            return True
        left -= _SLICE_S
    return wait(0.0)


def next_of(source: queue.SimpleQueue[T], limit: float | None = None) -> T:
    """Return the next item of a queue; raise `queue.Empty` after `limit` seconds without one."""
    items: list[T] = []

    def has_come(seconds: float) -> bool:
        with suppress(queue.Empty):
            items.append(source.get(timeout=seconds))
        return bool(items)

    if not wait_until(limit, has_come):
        raise queue.Empty
    return items[0]
