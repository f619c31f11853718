"""One explicit step of the one-point hexahedron: the physics of one element, and the loops over blocks of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.block import (
    ALIVE,
    BACK_STRESS,
    COORDINATES,
    FAILURE_STRAIN,
    FORCES,
    HOURGLASS_ENERGY,
    HOURGLASS_FORCE,
    HOURGLASS_STIFFNESS,
    INTERNAL_ENERGY,
    LANES,
    PLASTIC_STRAIN,
    RATE_FACTOR,
    STATE,
    STRESS,
    VELOCITIES,
    VISCOUS_LENGTH,
    VOLUME,
    YIELD_RATE,
    add,
    fetch,
    keep,
    load,
    load3,
    load6,
    load8,
    scatter,
    stands,
    store,
    store3,
    store6,
    store8,
)
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

Array = NDArray[np.float64]
Floats = Any


class MaterialNumbers(NamedTuple):
    """The material as the kernels see it: `stemcal.fem.material.Material.numbers()` makes it."""

    bulk: float
    shear: float
    yield_stress: float
    plastic_modulus: float
    beta: float
    rate_c: float
    rate_exponent: float
    density: float
    sound_speed: float
    viscosity_linear: float
    viscosity_quadratic: float
    hourglass_memory: float


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
def element(scratch: Array, lane: int, dt: float, material: Floats) -> None:
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
    alive = load(scratch, STATE + ALIVE, lane) if strain < load(scratch, STATE + FAILURE_STRAIN, lane) else 0.0
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
    add(scratch, STATE + INTERNAL_ENERGY, lane, volume * work if alive > 0.0 else 0.0)
    add(scratch, STATE + HOURGLASS_ENERGY, lane, dt * (p4 + p5 + p6 + p7) if alive > 0.0 else 0.0)
    store(scratch, STATE + PLASTIC_STRAIN, lane, strain)
    store(scratch, STATE + ALIVE, lane, alive)
    store(scratch, STATE + YIELD_RATE, lane, equivalent_rate(de, dt) if q > static_yield else 0.0)
    store(scratch, STATE + VOLUME, lane, volume)


@inlined
def run_block(scratch: Array, corners: Any, x: Array, v: Array, state: Array, dt: float, material: Floats) -> None:
    """Advance the elements of one block; their corner forces stay in the scratch."""
    fetch(scratch, corners, x, v, state)
    for lane in range(LANES):  # the loop that must vectorise
        element(scratch, lane, dt, material)
    keep(scratch, state)
    for lane in range(LANES):
        state[RATE_FACTOR, lane] = rate_factor(state[YIELD_RATE, lane], material.rate_c, material.rate_exponent)


@kernel
def add_internal_forces(
    scratch: Array, blocks: Any, x: Array, v: Array, state: Array, f: Array, dt: float, material: Floats
) -> None:
    """Subtract the internal forces of all elements from the nodal forces and advance the elements' state."""
    for b in range(blocks.shape[0]):
        if stands(state[b]):
            run_block(scratch, blocks[b], x, v, state[b], dt, material)
            scatter(scratch, blocks[b], f)


@kernel
def store_internal_forces(
    scratch: Array,
    blocks: Any,
    x: Array,
    v: Array,
    state: Array,
    forces: Array,
    dt: float,
    material: Floats,
) -> None:
    """Advance some blocks and store their corner forces, (blocks, 3, 8, lanes): one thread's share of a step."""
    for b in range(blocks.shape[0]):
        if not stands(state[b]):
            forces[b] = 0.0
            continue
        run_block(scratch, blocks[b], x, v, state[b], dt, material)
        for i in range(3):
            for a in range(8):
                for lane in range(LANES):
                    forces[b, i, a, lane] = scratch[(FORCES + 8 * i + a) * LANES + lane]


@kernel
def sum_internal_forces(forces: Array, first: Any, places: Any, f: Array, begin: int, end: int) -> None:
    """Subtract the stored corner forces from nodes begin…end−1, in the order in which one thread would have.

    Node n collects from ``places[first[n]:first[n + 1]]``, rows (block, corner, lane).
    """
    for n in range(begin, end):
        for p in range(first[n], first[n + 1]):
            b, a, lane = places[p, 0], places[p, 1], places[p, 2]
            for i in range(3):
                f[n, i] -= forces[b, i, a, lane]
