"""One large model on several cores: a step's elements and nodes shared out to threads, the rest as ever.

Each thread advances some of the parts of the blocks (`stemcal.fem.lanes`), which meet no row of the nodal forces in
common; what is between two parts is added when all threads are done, each node's rows by one thread in their order. So
every node collects its forces in the same order and the result has the same bits for any number of threads.

The threads run the compiled loop side by side, without the interpreter's lock, and meet in it several times a step.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np

from stemcal.fem.kernels.march import GOING_ON, Share, Team, march
from stemcal.fem.kernels.nodes import CHUNK
from stemcal.fem.state import State, scratch_like

March = Callable[[float, State], int]


class Marching:
    """Marches a state with `count` threads; a context manager."""

    def __init__(self, state: State, count: int) -> None:
        self._team, self._shares = team_of(count), shares_of(state, count)
        self._pool = ThreadPoolExecutor(count) if count > 1 else None
        self._begin = Barrier(count)

    def __enter__(self) -> Marching:
        return self

    def __exit__(self, *exception: object) -> None:
        self._begin.abort()
        if self._pool is not None:
            self._pool.shutdown()

    def __call__(self, until: float, state: State) -> int:
        """Advance the model to time `until`; returns why it stopped."""
        if self._pool is None:
            return int(march(until, self._shares[0], self._team, *state.parts()))
        marching = [self._pool.submit(self._take_part, until, share, state) for share in self._shares]
        outcome, *_ = (one.result() for one in marching)
        return outcome

    def _take_part(self, until: float, share: Share, state: State) -> int:
        """Do a thread's share, once all are there: an interrupt before that leaves no thread waiting in the loop."""
        self._begin.wait()
        return int(march(until, share, self._team, *state.parts()))


def march_to(until: float, state: State) -> int:
    """Advance the model to time `until` with this thread alone; returns why it stopped."""
    return Marching(state, 1)(until, state)


def team_of(count: int) -> Team:
    """Return a team of threads."""
    single = np.zeros(1, dtype=np.int64)
    return Team(count, single, single.copy(), np.zeros(count, dtype=np.int64), np.full(1, GOING_ON, dtype=np.int64))


def shares_of(state: State, count: int) -> list[Share]:
    """Share the parts of the blocks, the chunks of nodes and the rows apart out to the threads."""
    body, ends = state.body, state.lanes.ends
    blocks = ends[np.linspace(0, len(ends) - 1, count + 1).astype(int)].tolist()
    chunks = np.linspace(0, len(state.ledger.node_sums), count + 1).astype(int).tolist()
    owner = np.searchsorted(np.array(chunks[1:-1]) * CHUNK, body.late, side="right")
    return [
        Share(
            thread=thread,
            blocks=(blocks[thread], blocks[thread + 1]),
            chunks=(chunks[thread], chunks[thread + 1]),
            scratch=body.scratch if thread == 0 else scratch_like(body.state),
            late=np.flatnonzero(owner == thread).astype(np.int32),
        )
        for thread in range(count)
    ]
