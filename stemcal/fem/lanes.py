"""Where the elements of a mesh lie in the kernels' blocks, and where their corner forces go.

Elements follow one another in the lanes as long as all their corners follow one another among the nodes. Where the next
element's corners lie a few nodes further, at the end of a row say, that number of lanes stays empty; where they lie
elsewhere a new run begins, and where they are of another material a new block. Empty lanes read and write nodes as the
others do, but they are dead: what they write is a zero.

A large model has several parts of blocks in a row, each of which a thread can advance by itself. A run of corners that
meets a node of an earlier part puts its forces into rows apart, and these are added, one by one and in order, when all
parts are done. The parts are those of the mesh, not of the threads: the result has the same bits for any number.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.block import LANES, RUNS
from stemcal.fem.kernels.compile import RUN

Array = NDArray[np.float64]
Ints = NDArray[np.int32]

# Corners this many nodes further leave lanes empty rather than begin a new run.
_SHORT = RUN // 2
# Least number of blocks of a part, most parts of a model.
_BLOCKS_OF_A_PART = 512
_PARTS = 16


@dataclass(frozen=True)
class Lanes:
    """Where elements lie.

    slots: Block · `LANES` + lane of each element.
    runs: First node of each run of corners.
    targets: First row of the nodal forces for each of them: the same, or a row apart.
    late: The nodes of the rows apart; these follow the N + `RUN` rows of the nodes.
    ends: Part p is blocks ends[p]…ends[p+1]−1.
    """

    slots: Ints
    runs: Ints
    targets: Ints
    late: Ints
    ends: NDArray[np.int_]

    def spread(self, per_element: Array, fill: float) -> Array:
        """Return values per element as (blocks, lanes), with a value for the empty lanes."""
        spread = np.full(len(self.runs) * LANES, fill)
        spread[self.slots] = per_element
        return spread.reshape(-1, LANES)

    def gathered(self, rows: Array) -> Array:
        """Return rows of the elements' state, (blocks, lanes) or (blocks, rows, lanes), as (E,) or (E, rows)."""
        lanes_last = np.moveaxis(rows, -1, 1)
        return np.asarray(lanes_last.reshape(-1, *rows.shape[1:-1])[self.slots], dtype=float)


def lay_out(hexes: Ints, nodes: int, materials: NDArray[np.int_] | None = None) -> Lanes:
    """Lay the elements (E, 8) of a mesh, of the given materials (E,), out in blocks."""
    slots, heads = _slots(hexes, np.zeros(len(hexes), dtype=int) if materials is None else materials)
    count = -(-(slots[-1] + 1) // LANES) * LANES
    # each run begins where its first element would, were all its lanes filled
    first = np.zeros((count // RUN, 8), dtype=np.int32)
    run = slots // RUN
    first[run] = hexes[heads] + (run * RUN - slots[heads])[:, None]
    runs = np.ascontiguousarray(first.reshape(-1, RUNS, 8).transpose(0, 2, 1))
    parts = int(np.clip(len(runs) // _BLOCKS_OF_A_PART, 1, _PARTS))
    ends = np.linspace(0, len(runs), parts + 1).astype(int)
    return Lanes(slots, runs, *_targets(runs, ends, nodes), ends)


def _slots(hexes: Ints, materials: NDArray[np.int_]) -> tuple[Ints, NDArray[np.int_]]:
    """Return the slot of each element, and the element that heads the row of runs it is in."""
    apart, changes = np.diff(hexes, axis=0), np.diff(materials) != 0
    near = np.all(apart == apart[:, :1], axis=1) & (apart[:, 0] >= 1) & (apart[:, 0] <= _SHORT) & ~changes
    begins = np.concatenate([[0], np.flatnonzero(~near) + 1])
    row = np.cumsum(np.concatenate([[0], ~near]))
    heads = begins[row]
    within = hexes[:, 0] - hexes[heads, 0]
    last = np.concatenate([begins[1:], [len(hexes)]]) - 1
    lengths = -(-(within[last] + 1) // RUN) * RUN
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    for first in 1 + row[:-1][changes]:  # the rows of runs with which another material begins
        starts[first:] += -starts[first] % LANES
    return (starts[row] + within).astype(np.int32), heads


def _targets(runs: Ints, ends: NDArray[np.int_], nodes: int) -> tuple[Ints, Ints]:
    """Return the first row of the nodal forces for each run of corners, and the nodes of the rows apart."""
    owner = np.full(nodes + RUN, -1)
    targets = runs.copy()
    late: list[Ints] = []
    used = nodes + RUN
    for part, (begin, end) in enumerate(pairwise(ends)):
        mine = runs[begin:end, ..., None] + np.arange(RUN, dtype=np.int32)
        owner[mine[owner[mine] < 0]] = part
        shared = np.any(owner[mine] < part, axis=-1)
        late.append(mine[shared].ravel().astype(np.int32))
        targets[begin:end][shared] = used + RUN * np.arange(shared.sum(), dtype=np.int32)
        used += RUN * int(shared.sum())
    return targets, np.concatenate(late)


def nodal(values: Array) -> Array:
    """Return a copy of values per node (N, 3) stored component by component."""
    copy: Array = nodal_zeros(len(values), np.dtype(float))
    copy[:] = values
    return copy


def nodal_zeros(count: int, kind: np.dtype[Any]) -> Any:
    """Return zeros (`count`, 3) that lie component by component.

    Behind the last component there are `RUN` numbers to spare, which a run of the last nodes may reach into.
    """
    return np.zeros(3 * count + RUN, dtype=kind)[: 3 * count].reshape((count, 3), order="F")
