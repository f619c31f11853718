"""The calls that wait for workers."""

from __future__ import annotations

import itertools
import queue
from concurrent.futures import Future
from typing import Any, NamedTuple


class Call(NamedTuple):
    """A future, the pickled call that will fill it, and how many seconds that may take."""

    future: Future[Any]
    blob: bytes
    limit: float | None


NOW, WHEN_IDLE, LAST = range(3)  # whose turn it is: all that is due now comes before what can wait


class Calls:
    """Calls in the order in which they are to be done; None says that there will be no more."""

    def __init__(self) -> None:
        self._queue: queue.PriorityQueue[tuple[int, int, Call | None]] = queue.PriorityQueue()
        self._count = itertools.count()  # of two calls with the same turn the first comes first
        self.empty = self._queue.empty

    def put(self, call: Call | None, turn: int) -> None:
        """Add a call, or None, behind all others of the same turn."""
        self._queue.put((turn, next(self._count), call))

    def get(self, wait: bool = True) -> Call | None:
        """Return the next call; without waiting raise `queue.Empty` if there is none."""
        return self._queue.get(block=wait)[2]
