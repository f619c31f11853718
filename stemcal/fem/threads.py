"""One large model on several cores: a step's elements and nodes shared out to threads, the rest as ever.

Each thread advances some of the parts of the blocks (`stemcal.fem.lanes`), which meet no row of the nodal forces in
common; what is between two parts is added when all threads are done, as in the compiled loop. So every node collects
its forces in the same order and the result has the same bits whatever the number of threads. The kernels release the
interpreter lock, plain threads do.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from stemcal.fem.kernels.element import add_internal_forces
from stemcal.fem.kernels.march import REACHED, fail_in_the_mean, finish_step, mean_step, meet_tools, renew_time_step
from stemcal.fem.kernels.nodes import add_late_forces, kick_and_drift
from stemcal.fem.state import State, scratch_like

March = Callable[[float, State], int]


class ThreadedMarch:
    """Marches a state of one-point elements with `count` threads; a context manager."""

    def __init__(self, state: State, count: int) -> None:
        self._count = count
        self._pool = ThreadPoolExecutor(count - 1) if count > 1 else None
        body, ends = state.body, state.lanes.ends
        self._block_ends = ends[np.linspace(0, len(ends) - 1, count + 1).astype(int)]
        self._chunk_ends = np.linspace(0, len(state.ledger.node_sums), count + 1).astype(int)
        self._scratch = [scratch_like(body.state) for _ in range(count)]

    def __enter__(self) -> ThreadedMarch:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._pool is not None:
            self._pool.shutdown()

    def __call__(self, until: float, state: State) -> int:
        """Advance the model to time `until`; returns why it stopped."""
        body, clock, ledger, tools = state.body, state.clock, state.ledger, state.tools
        while clock.time[0] < until:
            outcome = renew_time_step(body, state.topology, clock, state.material, state.settings)
            if outcome != REACHED:
                return int(outcome)
            apart = fail_in_the_mean(body, state.topology, state.exchange, clock)
            failed = sum(self._together(self._add_internal_forces, state)) > 0 or apart
            add_late_forces(body)
            meet_tools(
                failed, body, state.topology, tools, state.edge, state.spread, state.candidates, clock, ledger,
                state.friction, state.settings,
            )  # fmt: skip
            self._together(self._move_nodes, state)
            outcome = finish_step(body, tools, clock, ledger)
            if outcome != REACHED:
                return int(outcome)
        return REACHED

    def _together(self, work: Callable[[State, int], Any], state: State) -> list[Any]:
        """Do a share of the work in each thread, the first in this one, and return what each gives."""
        others = [self._pool.submit(work, state, thread) for thread in range(1, self._count)] if self._pool else []
        return [work(state, 0), *(other.result() for other in others)]

    def _add_internal_forces(self, state: State, thread: int) -> int:
        mine = slice(self._block_ends[thread], self._block_ends[thread + 1])
        body = state.body
        failed = add_internal_forces(
            self._scratch[thread], body.runs[mine], body.targets[mine], body.x, body.v, body.state[mine], body.f,
            state.clock.step_before[0], state.material,
        )  # fmt: skip
        return int(failed)

    def _move_nodes(self, state: State, thread: int) -> None:
        begin, end = self._chunk_ends[thread], self._chunk_ends[thread + 1]
        kick_and_drift(state.body, mean_step(state.clock), state.clock.step[0], state.ledger.node_sums, begin, end)
