"""Waiting so long and no longer, by a clock that stands still while this process does.

A process that is stopped (Ctrl-Z, a batch system that suspends jobs) finds that hours have passed when it goes on;
whoever works for it has perhaps not had a second of them.
"""

from __future__ import annotations

from collections.abc import Callable

SLICE_S = 0.25  # what a stop may cost at most


def within(
    limit: float | None, wait: Callable[[float | None], bool], stands_still: Callable[[], bool] = lambda: False
) -> bool:
    """Wait until `wait(seconds)` tells that what is waited for has come; at most `limit` seconds, None for ever.

    Time is counted in slices, each of them once, however late this process wakes from it, and none at whose end
    `stands_still` tells that whoever is waited for is stopped.

    >>> within(1.0, lambda seconds: False), within(None, lambda seconds: True)
    (False, True)
    """
    if limit is None:
        return wait(None)
    used = 0.0
    while used < limit:
        part = min(SLICE_S, limit - used)
        if wait(part):
            return True
        if not stands_still():
            used += part
    return wait(0.0)
