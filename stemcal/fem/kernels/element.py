"""One explicit step of one block of hexahedra: gather, the physics lane by lane, scatter.

A block is `LANES` elements. Everything the physics touches lies in one flat scratch array, value `row` of element
`lane` at ``scratch[row * LANES + lane]`` with both numbers known when compiling: in this form, and with every function
inlined, LLVM turns the loop over the lanes into vector instructions.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.compile import inlined, kernel
from stemcal.fem.kernels.hexahedron import (
    at_midstep,
    contract,
    corners,
    minor_derivatives,
    modal_forces,
    modes,
    rotate_tensor,
    spin_rotation,
    strain_increment,
    velocity_gradient,
)
from stemcal.fem.kernels.hourglass import modal_rate, resist, taken_from_stress
from stemcal.fem.kernels.plasticity import (
    double_dot,
    elastic_trial,
    equivalent_rate,
    radial_return,
    rate_factor,
)

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
HOURGLASS_STIFFNESS = 31
VISCOUS_LENGTH = 32
STATE_ROWS = 33

# Rows of a block's scratch: corner coordinates, velocities, forces (x, y, z by eight), then the state.
COORDINATES = 0
VELOCITIES = 24
FORCES = 48
STATE = 72
SCRATCH_ROWS = STATE + STATE_ROWS


class MaterialNumbers(NamedTuple):
    """The material as the kernels see it: `stemcal.fem.material.Material.numbers()` makes it."""

    bulk: float
    shear: float
    yield_stress: float
    plastic_modulus: float
    beta: float
    rate_c: float
    rate_exponent: float
    failure_strain: float
    density: float
    sound_speed: float
    viscosity_linear: float
    viscosity_quadratic: float
    hourglass_memory: float


@inlined
def load(scratch: NDArray[np.float64], row: int, lane: int) -> Floats:
    """Return one row of one lane."""
    return scratch[row * LANES + lane]


@inlined
def store(scratch: NDArray[np.float64], row: int, lane: int, value: float) -> None:
    """Store one row of one lane."""
    scratch[row * LANES + lane] = value


@inlined
def add(scratch: NDArray[np.float64], row: int, lane: int, value: float) -> None:
    """Add to one row of one lane."""
    scratch[row * LANES + lane] += value


@inlined
def load8(scratch: NDArray[np.float64], row: int, lane: int) -> Floats:
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
def load6(scratch: NDArray[np.float64], row: int, lane: int) -> Floats:
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
def load3(scratch: NDArray[np.float64], row: int, lane: int) -> Floats:
    """Return a vector of one lane."""
    return (
        scratch[row * LANES + lane],
        scratch[(row + 1) * LANES + lane],
        scratch[(row + 2) * LANES + lane],
    )


@inlined
def store8(scratch: NDArray[np.float64], row: int, lane: int, f: Floats, factor: float) -> None:
    """Store eight successive rows of one lane, times `factor`."""
    scratch[row * LANES + lane] = factor * f[0]
    scratch[(row + 1) * LANES + lane] = factor * f[1]
    scratch[(row + 2) * LANES + lane] = factor * f[2]
    scratch[(row + 3) * LANES + lane] = factor * f[3]
    scratch[(row + 4) * LANES + lane] = factor * f[4]
    scratch[(row + 5) * LANES + lane] = factor * f[5]
    scratch[(row + 6) * LANES + lane] = factor * f[6]
    scratch[(row + 7) * LANES + lane] = factor * f[7]


@inlined
def store6(scratch: NDArray[np.float64], row: int, lane: int, f: Floats, factor: float) -> None:
    """Store a symmetric tensor of one lane, times `factor`."""
    scratch[row * LANES + lane] = factor * f[0]
    scratch[(row + 1) * LANES + lane] = factor * f[1]
    scratch[(row + 2) * LANES + lane] = factor * f[2]
    scratch[(row + 3) * LANES + lane] = factor * f[3]
    scratch[(row + 4) * LANES + lane] = factor * f[4]
    scratch[(row + 5) * LANES + lane] = factor * f[5]


@inlined
def store3(scratch: NDArray[np.float64], row: int, lane: int, f: Floats, factor: float) -> None:
    """Store a vector of one lane, times `factor`."""
    scratch[row * LANES + lane] = factor * f[0]
    scratch[(row + 1) * LANES + lane] = factor * f[1]
    scratch[(row + 2) * LANES + lane] = factor * f[2]


@inlined
def bulk_viscosity(de: Floats, dt: float, length: float, material: Floats) -> Floats:
    """Return von Neumann and Richtmyer's pressure, q = ρ l (c₂ l ε̇ᵥ² + c₁ c |ε̇ᵥ|) in compression, 0 in expansion."""
    closing = max(-(de[0] + de[1] + de[2]) / max(dt, 1.0e-30), 0.0)
    quadratic = material.viscosity_quadratic * length * closing
    linear = material.viscosity_linear * material.sound_speed
    return material.density * length * closing * (quadratic + linear)


@inlined
def stress_row(i: int, stress: Floats, pressure: float, taken: Floats, per_volume: float) -> Floats:
    """Return row i of σ − q I less what the hourglass forces take, the stress that acts on the corners."""
    sxx, syy, szz, sxy, syz, szx = stress
    rows = ((sxx - pressure, sxy, szx), (sxy, syy - pressure, syz), (szx, syz, szz - pressure))
    row = rows[i]
    return row[0] - per_volume * taken[0], row[1] - per_volume * taken[1], row[2] - per_volume * taken[2]


@inlined
def element(scratch: NDArray[np.float64], lane: int, dt: float, material: Floats) -> None:
    """Advance one element by one step: from corner positions and velocities to corner forces and new state."""
    x = modes(load8(scratch, COORDINATES, lane))
    y = modes(load8(scratch, COORDINATES + 8, lane))
    z = modes(load8(scratch, COORDINATES + 16, lane))
    u = modes(load8(scratch, VELOCITIES, lane))
    v = modes(load8(scratch, VELOCITIES + 8, lane))
    w = modes(load8(scratch, VELOCITIES + 16, lane))

    # how the element deforms in this step
    bx, by, bz = minor_derivatives(y, z), minor_derivatives(z, x), minor_derivatives(x, y)
    volume = contract(x, bx)
    L = velocity_gradient(u, v, w, bx, by, bz, volume)
    Lm = at_midstep(L, dt)
    de, R = strain_increment(Lm, dt), spin_rotation(Lm, dt)

    # the stress that follows
    old = rotate_tensor(R, load6(scratch, STATE + STRESS, lane))
    back = rotate_tensor(R, load6(scratch, STATE + BACK_STRESS, lane))
    trial = elastic_trial(old, de, material.bulk, material.shear)
    factor, strain = load(scratch, STATE + RATE_FACTOR, lane), load(scratch, STATE + PLASTIC_STRAIN, lane)
    stress, back, strain, q, static_yield = radial_return(trial, back, strain, factor, material)
    alive = load(scratch, STATE + ALIVE, lane) if strain < material.failure_strain else 0.0
    pressure = bulk_viscosity(de, dt, load(scratch, STATE + VISCOUS_LENGTH, lane), material)

    # the resistance of the four hourglass modes
    memory = material.hourglass_memory
    gain = load(scratch, STATE + HOURGLASS_STIFFNESS, lane) * (memory * dt + (1.0 - memory))
    Q = STATE + HOURGLASS_FORCE
    q4, p4 = resist(load3(scratch, Q, lane), modal_rate(4, u, v, w, x, y, z, L), R, gain, memory)
    q5, p5 = resist(load3(scratch, Q + 3, lane), modal_rate(5, u, v, w, x, y, z, L), R, gain, memory)
    q6, p6 = resist(load3(scratch, Q + 6, lane), modal_rate(6, u, v, w, x, y, z, L), R, gain, memory)
    q7, p7 = resist(load3(scratch, Q + 9, lane), modal_rate(7, u, v, w, x, y, z, L), R, gain, memory)

    # the forces on the corners
    tx = stress_row(0, stress, pressure, taken_from_stress(q4, q5, q6, q7, 0, x, y, z), 1.0 / volume)
    ty = stress_row(1, stress, pressure, taken_from_stress(q4, q5, q6, q7, 1, x, y, z), 1.0 / volume)
    tz = stress_row(2, stress, pressure, taken_from_stress(q4, q5, q6, q7, 2, x, y, z), 1.0 / volume)
    hx, hy, hz = (q4[0], q5[0], q6[0], q7[0]), (q4[1], q5[1], q6[1], q7[1]), (q4[2], q5[2], q6[2], q7[2])
    store8(scratch, FORCES, lane, corners(modal_forces(tx, hx, bx, by, bz)), alive)
    store8(scratch, FORCES + 8, lane, corners(modal_forces(ty, hy, bx, by, bz)), alive)
    store8(scratch, FORCES + 16, lane, corners(modal_forces(tz, hz, bx, by, bz)), alive)

    # what the element keeps
    store6(scratch, STATE + STRESS, lane, stress, alive)
    store6(scratch, STATE + BACK_STRESS, lane, back, alive)
    store3(scratch, Q, lane, q4, alive)
    store3(scratch, Q + 3, lane, q5, alive)
    store3(scratch, Q + 6, lane, q6, alive)
    store3(scratch, Q + 9, lane, q7, alive)
    work = 0.5 * (double_dot(old, de) + double_dot(stress, de)) - pressure * (de[0] + de[1] + de[2])
    add(scratch, STATE + INTERNAL_ENERGY, lane, alive * volume * work)
    add(scratch, STATE + HOURGLASS_ENERGY, lane, alive * dt * (p4 + p5 + p6 + p7))
    store(scratch, STATE + PLASTIC_STRAIN, lane, strain)
    store(scratch, STATE + ALIVE, lane, alive)
    store(scratch, STATE + YIELD_RATE, lane, equivalent_rate(de, dt) if q > static_yield else 0.0)
    store(scratch, STATE + VOLUME, lane, volume)


@kernel
def add_internal_forces(
    scratch: NDArray[np.float64],
    blocks: NDArray[np.int32],
    x: NDArray[np.float64],
    v: NDArray[np.float64],
    state: NDArray[np.float64],
    f: NDArray[np.float64],
    dt: float,
    material: Floats,
) -> None:
    """Subtract the internal forces of every element from the nodal forces and advance the elements' state."""
    for b in range(blocks.shape[0]):
        for a in range(8):
            for lane in range(LANES):
                n = blocks[b, a, lane]
                for i in range(3):
                    scratch[(COORDINATES + 8 * i + a) * LANES + lane] = x[n, i]
                    scratch[(VELOCITIES + 8 * i + a) * LANES + lane] = v[n, i]
        for row in range(STATE_ROWS):
            for lane in range(LANES):
                scratch[(STATE + row) * LANES + lane] = state[b, row, lane]
        for lane in range(LANES):
            element(scratch, lane, dt, material)
        for row in range(STATE_ROWS):
            for lane in range(LANES):
                state[b, row, lane] = scratch[(STATE + row) * LANES + lane]
        for a in range(8):
            for lane in range(LANES):
                n = blocks[b, a, lane]
                for i in range(3):
                    f[n, i] -= scratch[(FORCES + 8 * i + a) * LANES + lane]
        for lane in range(LANES):
            state[b, RATE_FACTOR, lane] = rate_factor(
                state[b, YIELD_RATE, lane], material.rate_c, material.rate_exponent
            )
