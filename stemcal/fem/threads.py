"""One large model on several cores: the step's internal forces shared out to threads, the rest as ever.

Each thread computes some blocks of elements and stores their corner forces; then each sums those of some nodes, in the
order in which a single thread would have added them. So the result has the same bits whatever the number of threads.
The kernels release the interpreter lock, plain threads do.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.block import LANES, SCRATCH_ROWS
from stemcal.fem.kernels.element import store_internal_forces, sum_internal_forces
from stemcal.fem.kernels.march import REACHED, finish_step, renew_time_step
from stemcal.fem.state import State

Ints = NDArray[np.int32]
March = Callable[[float, State], int]


class ThreadedMarch:
    """Marches a state of one-point elements with `count` threads; a context manager."""

    def __init__(self, state: State, count: int) -> None:
        self._count = count
        self._pool = ThreadPoolExecutor(count)
        blocks = state.body.blocks
        self._forces = np.zeros((len(blocks), 3, 8, LANES))
        self._first, self._places = corner_places(blocks, len(state.body.x))
        self._scratch = [np.zeros(SCRATCH_ROWS * LANES) for _ in range(count)]
        self._block_ends = np.linspace(0, len(blocks), count + 1).astype(int)
        self._node_ends = np.linspace(0, len(state.body.x), count + 1).astype(int)

    def __enter__(self) -> ThreadedMarch:
        return self

    def __exit__(self, *exception: object) -> None:
        self._pool.shutdown()

    def __call__(self, until: float, state: State) -> int:
        """Advance the model to time `until`; returns why it stopped."""
        body, clock = state.body, state.clock
        while clock.time[0] < until:
            outcome = renew_time_step(body, state.topology, clock, state.material, state.settings)
            if outcome != REACHED:
                return int(outcome)
            self._together(self._compute, state)
            self._together(self._sum, state)
            outcome = finish_step(
                body, state.topology, state.tools, state.edge, state.candidates, clock, state.ledger,
                state.friction, state.settings,
            )  # fmt: skip
            if outcome != REACHED:
                return int(outcome)
        return REACHED

    def _together(self, work: Callable[[State, int], None], state: State) -> None:
        """Do a share of the work in each thread and wait for all."""
        list(self._pool.map(lambda thread: work(state, thread), range(self._count)))

    def _compute(self, state: State, thread: int) -> None:
        mine = slice(self._block_ends[thread], self._block_ends[thread + 1])
        body = state.body
        store_internal_forces(
            self._scratch[thread], body.blocks[mine], body.x, body.v, body.state[mine], self._forces[mine],
            state.clock.step_before[0], state.material,
        )  # fmt: skip

    def _sum(self, state: State, thread: int) -> None:
        begin, end = self._node_ends[thread], self._node_ends[thread + 1]
        sum_internal_forces(self._forces, self._first, self._places, state.body.f, begin, end)


def corner_places(blocks: Ints, nodes: int) -> tuple[Ints, Ints]:
    """Return where the forces of each node stand: (N + 1,) first place, and (places, 3) rows (block, corner, lane).

    Within a node the places follow the order of the single-threaded scatter: block, corner, lane.
    """
    flat = blocks.ravel()
    order = np.argsort(flat, kind="stable")
    first = np.searchsorted(flat[order], np.arange(nodes + 1))
    places = np.stack(np.unravel_index(order, blocks.shape), axis=1)
    return first.astype(np.int32), places.astype(np.int32)
