"""Blocks of elements: which value lies where, and how it gets there.

A block is `LANES` elements. Everything their physics touches lies in one flat scratch array, value `row` of element
`lane` at ``scratch[row * LANES + lane]`` with both numbers known when compiling: in this form, and with every function
inlined, LLVM turns a loop over the lanes into vector instructions. Between steps the state rests in an array
(blocks, rows, lanes).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.compile import inlined

Array = NDArray[np.float64]
Floats = Any
LANES = 16

# Rows of an element's state, kept between steps.
STRESS = 0
BACK_STRESS = 6
PLASTIC_STRAIN = 12
HOURGLASS_FORCE = 13
INTERNAL_ENERGY = 25
HOURGLASS_ENERGY = 26
ALIVE = 27
RATE_FACTOR = 28
YIELD_RATE = 29
VOLUME = 30
# Rows that stay as they were at the start.
CHANGING_ROWS = 31
HOURGLASS_STIFFNESS = 31
VISCOUS_LENGTH = 32
FAILURE_STRAIN = 33
STATE_ROWS = 34

# Rows of a block's scratch: corner coordinates, velocities, forces (x, y, z by eight), then the state.
COORDINATES = 0
VELOCITIES = 24
FORCES = 48
STATE = 72
SCRATCH_ROWS = STATE + STATE_ROWS


@inlined
def fetch(scratch: Array, corners: Any, x: Array, v: Array, state: Array) -> None:
    """Copy into the scratch what the elements of a block start a step with; `corners` is (8, lanes)."""
    for a in range(8):
        for lane in range(LANES):
            n = corners[a, lane]
            for i in range(3):
                scratch[(COORDINATES + 8 * i + a) * LANES + lane] = x[n, i]
                scratch[(VELOCITIES + 8 * i + a) * LANES + lane] = v[n, i]
    for row in range(STATE_ROWS):
        for lane in range(LANES):
            scratch[(STATE + row) * LANES + lane] = state[row, lane]


@inlined
def keep(scratch: Array, state: Array) -> None:
    """Copy the changed rows of a block's state back from the scratch."""
    for row in range(CHANGING_ROWS):
        for lane in range(LANES):
            state[row, lane] = scratch[(STATE + row) * LANES + lane]


@inlined
def scatter(scratch: Array, corners: Any, f: Array) -> None:
    """Subtract the forces of a block's corners from those of the nodes."""
    for a in range(8):
        for lane in range(LANES):
            n = corners[a, lane]
            for i in range(3):
                f[n, i] -= scratch[(FORCES + 8 * i + a) * LANES + lane]


@inlined
def stands(state: Array) -> bool:
    """Return whether any element of a block is alive."""
    for lane in range(LANES):  # noqa: SIM110 - numba has no generator expressions
        if state[ALIVE, lane] > 0.0:
            return True
    return False


@inlined
def load(scratch: Array, row: int, lane: int) -> Floats:
    """Return one row of one lane."""
    return scratch[row * LANES + lane]


@inlined
def store(scratch: Array, row: int, lane: int, value: float) -> None:
    """Store one row of one lane."""
    scratch[row * LANES + lane] = value


@inlined
def add(scratch: Array, row: int, lane: int, value: float) -> None:
    """Add to one row of one lane."""
    scratch[row * LANES + lane] += value


@inlined
def load8(scratch: Array, row: int, lane: int) -> Floats:
    """Return eight successive rows of one lane."""
    return (
        scratch[row * LANES + lane],
        scratch[(row + 1) * LANES + lane],
        scratch[(row + 2) * LANES + lane],
        scratch[(row + 3) * LANES + lane],
        scratch[(row + 4) * LANES + lane],
        scratch[(row + 5) * LANES + lane],
        scratch[(row + 6) * LANES + lane],
        scratch[(row + 7) * LANES + lane],
    )


@inlined
def load6(scratch: Array, row: int, lane: int) -> Floats:
    """Return a symmetric tensor of one lane."""
    return (
        scratch[row * LANES + lane],
        scratch[(row + 1) * LANES + lane],
        scratch[(row + 2) * LANES + lane],
        scratch[(row + 3) * LANES + lane],
        scratch[(row + 4) * LANES + lane],
        scratch[(row + 5) * LANES + lane],
    )


@inlined
def load3(scratch: Array, row: int, lane: int) -> Floats:
    """Return a vector of one lane."""
    return (
        scratch[row * LANES + lane],
        scratch[(row + 1) * LANES + lane],
        scratch[(row + 2) * LANES + lane],
    )


@inlined
def store8(scratch: Array, row: int, lane: int, f: Floats, alive: float) -> None:
    """Store eight successive rows of one lane, or zeros if it is not alive."""
    scratch[row * LANES + lane] = f[0] if alive > 0.0 else 0.0
    scratch[(row + 1) * LANES + lane] = f[1] if alive > 0.0 else 0.0
    scratch[(row + 2) * LANES + lane] = f[2] if alive > 0.0 else 0.0
    scratch[(row + 3) * LANES + lane] = f[3] if alive > 0.0 else 0.0
    scratch[(row + 4) * LANES + lane] = f[4] if alive > 0.0 else 0.0
    scratch[(row + 5) * LANES + lane] = f[5] if alive > 0.0 else 0.0
    scratch[(row + 6) * LANES + lane] = f[6] if alive > 0.0 else 0.0
    scratch[(row + 7) * LANES + lane] = f[7] if alive > 0.0 else 0.0


@inlined
def store6(scratch: Array, row: int, lane: int, f: Floats, alive: float) -> None:
    """Store a symmetric tensor of one lane, or zeros if it is not alive."""
    scratch[row * LANES + lane] = f[0] if alive > 0.0 else 0.0
    scratch[(row + 1) * LANES + lane] = f[1] if alive > 0.0 else 0.0
    scratch[(row + 2) * LANES + lane] = f[2] if alive > 0.0 else 0.0
    scratch[(row + 3) * LANES + lane] = f[3] if alive > 0.0 else 0.0
    scratch[(row + 4) * LANES + lane] = f[4] if alive > 0.0 else 0.0
    scratch[(row + 5) * LANES + lane] = f[5] if alive > 0.0 else 0.0


@inlined
def store3(scratch: Array, row: int, lane: int, f: Floats, alive: float) -> None:
    """Store a vector of one lane, or zeros if it is not alive."""
    scratch[row * LANES + lane] = f[0] if alive > 0.0 else 0.0
    scratch[(row + 1) * LANES + lane] = f[1] if alive > 0.0 else 0.0
    scratch[(row + 2) * LANES + lane] = f[2] if alive > 0.0 else 0.0
