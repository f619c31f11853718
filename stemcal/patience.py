"""Waiting so long and no longer, by a clock that stands still while nobody can work.

A process that is stopped (Ctrl-Z, a batch system that suspends jobs) finds that hours have passed when it goes on;
whoever works for it has perhaps not had a second of them. Nor has who waits for a core that others have.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from pathlib import Path

__all__ = ["Hindrance", "within"]

SLICE_S = 0.25  # what a stop may cost at most


def within(
    limit: float | None, wait: Callable[[float | None], bool], hindered: Callable[[], float] = lambda: 0.0
) -> bool:
    """Wait until `wait(seconds)` tells that what is waited for has come; at most `limit` seconds, None for ever.

    Time is counted in slices, each of them once, however late this process wakes from it, less what `hindered` tells
    at its end: for how many seconds since the last look whoever is waited for could not work.

    >>> within(1.0, lambda seconds: False), within(None, lambda seconds: True)
    (False, True)
    """
    if limit is None:
        return wait(None)
    used = 0.0
    hindered()
    while used < limit:
        part = min(SLICE_S, limit - used)
        if wait(part):
            return True
        used += max(0.0, part - max(0.0, hindered()))
    return wait(0.0)


class Hindrance:
    """Tells, each time it is called, for how many seconds since the last a process could not work; only Linux knows.

    It was stopped by a signal, or ready to compute and waiting for a core that others had.
    """

    def __init__(self, pid: int | None) -> None:
        self._pid = pid
        self._waited = 0.0

    def __call__(self) -> float:
        """Return the seconds; infinity if the process is stopped now."""
        if self._pid is None:
            return 0.0
        before, self._waited = self._waited, waited_for_core(self._pid)
        return inf if is_stopped(self._pid) else self._waited - before


def is_stopped(pid: int) -> bool:
    """Tell whether a process is stopped by a signal, as by Ctrl-Z."""
    try:
        state = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[0]
    except (OSError, IndexError):
        return False
    return state in (b"T", b"t")


def waited_for_core(pid: int) -> float:
    """Return how many seconds the first thread of a process has been ready to compute, but had no core."""
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_bytes().split()[1]) * 1e-9
    except (OSError, ValueError, IndexError):
        return 0.0
