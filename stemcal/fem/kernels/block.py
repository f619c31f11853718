"""Blocks of elements: the layout of their data, and its transfer from and to the nodes.

A block has `LANES` elements. Their data are in two flat arrays: a scratch array for values at the corners during a
step, and the state of the block. Value `row` of element `lane` is ``values[row * LANES + lane]``, with constants for
`row` and `LANES`: in this layout, and with every function inlined, LLVM vectorises the loops over the lanes. The states
of all blocks are one array (blocks, rows, lanes).

The lanes are filled in runs of `RUN` successive elements whose corner nodes are successive too. Each corner of a run is
then a vector of nodes, defined by its first node (`llvm`). `stemcal.fem.lanes` forms the runs; empty lanes are dead.
"""

from typing import Any, NamedTuple

import numpy as np

from stemcal.arrays import Array, Floats
from stemcal.fem.kernels.compile import RUN, ZERO, inlined
from stemcal.fem.kernels.llvm import (
    counting,
    prefetch,
    read_corners,
    read_scratch,
    read_state,
    subtract_run,
    write_scratch,
    write_state,
)

LANES = 32  # fills two to eight vector registers; 16 lanes were measured a tenth slower, 64 no faster
RUNS = LANES // RUN
count_positive, count_negative = counting(">", LANES), counting("<", LANES)

# Rows of an element's state.
STRESS = 0
BACK_STRESS = 6
PLASTIC_STRAIN = 12
HOURGLASS_FORCE = 13  # forces on the modal sums, x, y, z of each of the four hourglass modes
INTERNAL_ENERGY = 25
HOURGLASS_ENERGY = 26
ALIVE = 27
RATE_FACTOR = 28  # factor on the yield stress; during a step, −Δε:Δε marks an element that yields
VISCOUS_PRESSURE = 29
# Accumulated round-off of the energies (`book`).
INTERNAL_REMAINDER = 30
HOURGLASS_REMAINDER = 31
PLASTIC_RATE = 32  # smoothed plastic strain rate
# Constant rows.
HOURGLASS_STIFFNESS = 33  # stiffness a against a modal sum over the corners
VISCOUS_LENGTH = 34
FAILURE_STRAIN = 35
ELEMENT_MASS = 36
STATE_ROWS = 37

# Rows of the scratch array: coordinates and velocities of the eight corners along x, y, z; forces replace coordinates.
COORDINATES = 0
VELOCITIES = 24
FORCES = COORDINATES
SCRATCH_ROWS = 48
# Results of the time step's computation; they use the rows of corner 0, whose relative coordinates are always zero.
RATES = COORDINATES
VOLUMES = VELOCITIES

CACHE_LINE = 64  # size of a cache line, bytes
# The state of a block is prefetched while the elements this number of blocks before it are computed.
AHEAD = 2


class Seen(NamedTuple):
    """Nodal positions and velocities that elements read: the body's arrays, or copies for single precision.

    Elements need only the relative positions of their corners. The copies of positions are the low 32 bits of whole
    numbers of a small unit, so the differences within an element are exact at any distance from the origin.
    """

    x: Any  # (N, 3) positions: int32 multiples of `unit`, or double, mm
    v: Array  # (N, 3) velocities in the elements' precision
    unit: float  # mm per whole number in `x`; 1 for double precision


@inlined
def states_of(state: Array) -> Array:
    """Return each block's state as a flat row; call this before a loop, as it takes as long as a dozen elements."""
    return state.reshape((state.shape[0], STATE_ROWS * LANES))


@inlined
def bring_near(states: Array, b: int) -> None:
    """Prefetch the state of block b (of the last block, if there is no block b) into the second-level cache.

    The processor does not predict the strides with which rows are read. Without the prefetch, a model larger than that
    cache is a quarter slower, but a smaller one is a few % faster.
    """
    mine = states[min(b, states.shape[0] - 1)]
    for place in range(0, STATE_ROWS * LANES, CACHE_LINE // states.itemsize):
        prefetch(mine, place)


@inlined
def fetch(scratch: Array, runs: Any, seen: Any) -> None:
    """Gather positions and velocities of a block's corners, relative to the first corner of each element.

    Single precision is sufficient for these relative values, but not for absolute positions.
    """
    for r in range(0, RUNS, 2):
        read_corners(seen.x, seen.unit, runs, r, scratch, COORDINATES * LANES + r * RUN, LANES)
        read_corners(seen.v, seen.unit, runs, r, scratch, VELOCITIES * LANES + r * RUN, LANES)


@inlined
def scatter(scratch: Array, runs: Any, f: Array) -> None:
    """Subtract the corner forces of a block from the nodal forces."""
    for a in range(8):
        for r in range(RUNS):
            subtract_run(f, np.intp(runs[a, r]), scratch, (FORCES + a) * LANES + r * RUN, 8 * LANES)


@inlined
def living(state: Array) -> int:
    """Return the number of live elements of a block."""
    return int(count_positive(state, ALIVE * LANES))


@inlined
def yielding(state: Array) -> int:
    """Return the number of elements of a block that yield in this step, whose `RATE_FACTOR` is negative."""
    return int(count_negative(state, RATE_FACTOR * LANES))


@inlined
def held(state: Array, slot: int, row: int) -> float:
    """Return the value in a row of an element's state; the element's `slot` is block · `LANES` + lane."""
    return state[slot // LANES, row, slot % LANES]


@inlined
def load(values: Array, row: int, lane: int) -> Floats:
    """Return the value in a row of a lane."""
    return read_state(values, row * LANES + lane)


@inlined
def store(values: Array, row: int, lane: int, value: float) -> None:
    """Store a value in a row of a lane."""
    write_state(values, row * LANES + lane, value)


@inlined
def book(values: Array, row: int, remainder: int, lane: int, value: float) -> None:
    """Add a value to a row of a lane by compensated summation, which keeps the round-off in the row `remainder`.

    Kahan, Comm. ACM 8, 40 (1965). In single precision, small increments of a large energy would otherwise be lost.
    """
    old = read_state(values, row * LANES + lane)
    added = value - read_state(values, remainder * LANES + lane)
    new = old + added
    write_state(values, remainder * LANES + lane, (new - old) - added)
    write_state(values, row * LANES + lane, new)


@inlined
def load_corners(values: Array, row: int, lane: int) -> Floats:
    """Return the values of the eight corners from successive rows; the first is 0, as they are relative to corner 0."""
    return (
        ZERO,
        read_scratch(values, (row + 1) * LANES + lane),
        read_scratch(values, (row + 2) * LANES + lane),
        read_scratch(values, (row + 3) * LANES + lane),
        read_scratch(values, (row + 4) * LANES + lane),
        read_scratch(values, (row + 5) * LANES + lane),
        read_scratch(values, (row + 6) * LANES + lane),
        read_scratch(values, (row + 7) * LANES + lane),
    )


@inlined
def load6(values: Array, row: int, lane: int) -> Floats:
    """Return a symmetric tensor from six successive rows of a lane."""
    return (
        read_state(values, row * LANES + lane),
        read_state(values, (row + 1) * LANES + lane),
        read_state(values, (row + 2) * LANES + lane),
        read_state(values, (row + 3) * LANES + lane),
        read_state(values, (row + 4) * LANES + lane),
        read_state(values, (row + 5) * LANES + lane),
    )


@inlined
def load3(values: Array, row: int, lane: int) -> Floats:
    """Return a vector from three successive rows of a lane."""
    return (
        read_state(values, row * LANES + lane),
        read_state(values, (row + 1) * LANES + lane),
        read_state(values, (row + 2) * LANES + lane),
    )


@inlined
def store8(values: Array, row: int, lane: int, f: Floats) -> None:
    """Store eight values in successive rows of a lane."""
    write_scratch(values, row * LANES + lane, f[0])
    write_scratch(values, (row + 1) * LANES + lane, f[1])
    write_scratch(values, (row + 2) * LANES + lane, f[2])
    write_scratch(values, (row + 3) * LANES + lane, f[3])
    write_scratch(values, (row + 4) * LANES + lane, f[4])
    write_scratch(values, (row + 5) * LANES + lane, f[5])
    write_scratch(values, (row + 6) * LANES + lane, f[6])
    write_scratch(values, (row + 7) * LANES + lane, f[7])


@inlined
def store6(values: Array, row: int, lane: int, f: Floats, alive: float) -> None:
    """Store a symmetric tensor in six successive rows of a lane, or zeros if the element is not alive."""
    write_state(values, row * LANES + lane, f[0] if alive > ZERO else ZERO)
    write_state(values, (row + 1) * LANES + lane, f[1] if alive > ZERO else ZERO)
    write_state(values, (row + 2) * LANES + lane, f[2] if alive > ZERO else ZERO)
    write_state(values, (row + 3) * LANES + lane, f[3] if alive > ZERO else ZERO)
    write_state(values, (row + 4) * LANES + lane, f[4] if alive > ZERO else ZERO)
    write_state(values, (row + 5) * LANES + lane, f[5] if alive > ZERO else ZERO)


@inlined
def store3(values: Array, row: int, lane: int, f: Floats) -> None:
    """Store a vector in three successive rows of a lane."""
    write_state(values, row * LANES + lane, f[0])
    write_state(values, (row + 1) * LANES + lane, f[1])
    write_state(values, (row + 2) * LANES + lane, f[2])
