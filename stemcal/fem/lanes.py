"""Place the elements of a mesh in the lanes of the kernels' blocks, and assign rows to their corner forces.

Successive elements are in successive lanes while each of their eight corner nodes increases by one. If the corner nodes
of the next element are a few nodes further, for example at the end of a row, that number of lanes stays empty; if they
are elsewhere, a new run begins; with another material, a new block. Empty lanes are dead elements: they read and write
nodes as the others do, but the forces they write are zero.

A large model is divided into parts of successive blocks, which threads can advance independently. A run of corners that
shares a node with an earlier part writes its forces into separate rows, which are added in a fixed order once all parts
are done. The parts depend on the mesh, not on the number of threads, so the result is bit-identical for any number.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array, Ints
from stemcal.fem.kernels.block import LANES, RUNS
from stemcal.fem.kernels.compile import RUN

# Up to this number of nodes between successive elements, lanes stay empty; beyond it a new run begins.
_SHORT = RUN // 2
# Minimum number of blocks in a part, maximum number of parts.
_BLOCKS_OF_A_PART = 512
_PARTS = 16


@dataclass(frozen=True)
class Lanes:
    """The layout of the elements of a mesh in blocks.

    slots: Block · `LANES` + lane of each element (E,).
    runs: First node of each run of corners (blocks, 8, runs of a block).
    targets: First row of the nodal forces for each run, shaped as `runs`: that of its first node, or a separate row.
    late: Node of each separate row; the separate rows follow the N + `RUN` rows of the nodes.
    ends: Part p has the blocks ends[p]…ends[p+1]−1.
    """

    slots: Ints
    runs: Ints
    targets: Ints
    late: Ints
    ends: NDArray[np.int_]

    def spread(self, per_element: Array, fill: float) -> Array:
        """Return values per element (E,) as (blocks, lanes), with `fill` in the empty lanes."""
        spread = np.full(len(self.runs) * LANES, fill)
        spread[self.slots] = per_element
        return spread.reshape(-1, LANES)

    def gathered(self, rows: Array) -> Array:
        """Return values of lanes, (blocks, lanes) or (blocks, rows, lanes), per element: (E,) or (E, rows)."""
        return np.asarray(np.moveaxis(rows, -1, 1).reshape(-1, *rows.shape[1:-1])[self.slots], dtype=float)


def lay_out(hexes: Ints, nodes: int, materials: NDArray[np.int_] | None = None) -> Lanes:
    """Return the layout of the elements with corners `hexes` (E, 8) and materials (E,); `nodes`: number of nodes."""
    slots, heads = _slots(hexes, np.zeros(len(hexes), dtype=int) if materials is None else materials)
    count = -(-(slots[-1] + 1) // LANES) * LANES
    # the first node of a run is the node of its first lane, even if this lane is empty
    first = np.zeros((count // RUN, 8), dtype=np.int32)
    run = slots // RUN
    first[run] = hexes[heads] + (run * RUN - slots[heads])[:, None]
    runs = np.ascontiguousarray(first.reshape(-1, RUNS, 8).transpose(0, 2, 1))
    parts = int(np.clip(len(runs) // _BLOCKS_OF_A_PART, 1, _PARTS))
    ends = np.linspace(0, len(runs), parts + 1).astype(int)
    return Lanes(slots, runs, *_targets(runs, ends, nodes), ends)


def _slots(hexes: Ints, materials: NDArray[np.int_]) -> tuple[Ints, NDArray[np.int_]]:
    """Return the slot of each element (E,), and the first element of the chain of successive elements it is in (E,)."""
    apart, changes = np.diff(hexes, axis=0), np.diff(materials) != 0
    near = np.all(apart == apart[:, :1], axis=1) & (apart[:, 0] >= 1) & (apart[:, 0] <= _SHORT) & ~changes
    begins = np.concatenate([[0], np.flatnonzero(~near) + 1])
    row = np.cumsum(np.concatenate([[0], ~near]))
    heads = begins[row]
    within = hexes[:, 0] - hexes[heads, 0]
    last = np.concatenate([begins[1:], [len(hexes)]]) - 1
    lengths = -(-(within[last] + 1) // RUN) * RUN
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    for first in 1 + row[:-1][changes]:  # chains at which the material changes begin a new block
        starts[first:] += -starts[first] % LANES
    return (starts[row] + within).astype(np.int32), heads


def _targets(runs: Ints, ends: NDArray[np.int_], nodes: int) -> tuple[Ints, Ints]:
    """Return the first row of the nodal forces for each run of corners, and the node of each separate row."""
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
    """Return a copy of values per node (N, 3) whose memory is ordered by component, then by node."""
    copy: Array = nodal_zeros(len(values), np.dtype(float))
    copy[:] = values
    return copy


def nodal_zeros(count: int, kind: np.dtype[Any]) -> Any:
    """Return zeros (`count`, 3) ordered by component in memory, with `RUN` spare numbers behind the last one."""
    return np.zeros(3 * count + RUN, dtype=kind)[: 3 * count].reshape((count, 3), order="F")
