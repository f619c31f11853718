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
    HOURGLASS_REMAINDER,
    HOURGLASS_STIFFNESS,
    INTERNAL_ENERGY,
    INTERNAL_REMAINDER,
    LANES,
    PLASTIC_STRAIN,
    RATE_FACTOR,
    STATE_ROWS,
    STRESS,
    VELOCITIES,
    VISCOUS_LENGTH,
    VISCOUS_PRESSURE,
    VOLUME,
    YIELD_RATE,
    book,
    fetch,
    living,
    load,
    load3,
    load6,
    load8,
    scatter,
    store,
    store3,
    store6,
    store8,
)
from stemcal.fem.kernels.compile import entry, inlined, kernel
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
from stemcal.fem.kernels.numbers import HALF, ONE, TINY, ZERO, like
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
    closing = max(-(de[0] + de[1] + de[2]) / max(dt, TINY), ZERO)
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
def hourglass_forces(
    state: Array, lane: int, u: Floats, v: Floats, w: Floats, x: Floats, y: Floats, z: Floats,
    L: Floats, R: Floats, dt: float, material: Floats,
) -> Floats:  # fmt: skip
    """Return the forces on the four hourglass modes and their power."""
    memory = material.hourglass_memory
    gain = load(state, HOURGLASS_STIFFNESS, lane) * (memory * dt + (ONE - memory))
    q4, p4 = resist(load3(state, HOURGLASS_FORCE, lane), modal_rate(4, u, v, w, x, y, z, L), R, gain, memory)
    q5, p5 = resist(load3(state, HOURGLASS_FORCE + 3, lane), modal_rate(5, u, v, w, x, y, z, L), R, gain, memory)
    q6, p6 = resist(load3(state, HOURGLASS_FORCE + 6, lane), modal_rate(6, u, v, w, x, y, z, L), R, gain, memory)
    q7, p7 = resist(load3(state, HOURGLASS_FORCE + 9, lane), modal_rate(7, u, v, w, x, y, z, L), R, gain, memory)
    return (q4, q5, q6, q7), p4 + p5 + p6 + p7


@inlined
def corner_forces(
    i: int, stress: Floats, pressure: float, Q: Floats, x: Floats, y: Floats, z: Floats,
    bx: Floats, by: Floats, bz: Floats, volume: float,
) -> Floats:  # fmt: skip
    """Return component i of the forces on the eight corners."""
    q4, q5, q6, q7 = Q
    row = stress_row(i, stress, pressure, taken_from_stress(q4, q5, q6, q7, i, x, y, z), ONE / volume)
    return corners(modal_forces(row, (q4[i], q5[i], q6[i], q7[i]), bx, by, bz))


@inlined
def element(scratch: Array, state: Array, lane: int, dt: float, material: Floats) -> None:
    """Advance one element by one step: from corner positions and velocities to corner forces and new state.

    Precision is that of its state; `dt` and `material` have the same.
    """
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
    old, back = rotate_tensor(R, load6(state, STRESS, lane)), rotate_tensor(R, load6(state, BACK_STRESS, lane))
    trial = elastic_trial(old, de, material.bulk, material.shear)
    factor, strain = load(state, RATE_FACTOR, lane), load(state, PLASTIC_STRAIN, lane)
    stress, back, strain, q, static_yield = radial_return(trial, back, strain, factor, material)
    alive = load(state, ALIVE, lane) if strain < load(state, FAILURE_STRAIN, lane) else ZERO
    pressure = bulk_viscosity(de, dt, load(state, VISCOUS_LENGTH, lane), material)
    mean_pressure = HALF * (load(state, VISCOUS_PRESSURE, lane) + pressure)
    work = HALF * (double_dot(old, de) + double_dot(stress, de)) - mean_pressure * (de[0] + de[1] + de[2])

    # the forces on the corners
    Q, power = hourglass_forces(state, lane, u, v, w, x, y, z, L, R, dt, material)
    store8(scratch, FORCES, lane, corner_forces(0, stress, pressure, Q, x, y, z, bx, by, bz, volume), alive)
    store8(scratch, FORCES + 8, lane, corner_forces(1, stress, pressure, Q, x, y, z, bx, by, bz, volume), alive)
    store8(scratch, FORCES + 16, lane, corner_forces(2, stress, pressure, Q, x, y, z, bx, by, bz, volume), alive)

    # what the element keeps
    store6(state, STRESS, lane, stress, alive)
    store6(state, BACK_STRESS, lane, back, alive)
    for m in range(4):
        store3(state, HOURGLASS_FORCE + 3 * m, lane, Q[m], alive)
    book(state, INTERNAL_ENERGY, INTERNAL_REMAINDER, lane, volume * work if alive > ZERO else ZERO)
    book(state, HOURGLASS_ENERGY, HOURGLASS_REMAINDER, lane, dt * power if alive > ZERO else ZERO)
    store(state, PLASTIC_STRAIN, lane, strain)
    store(state, ALIVE, lane, alive)
    store(state, YIELD_RATE, lane, equivalent_rate(de, dt) if q > static_yield else ZERO)
    store(state, VOLUME, lane, volume)
    store(state, VISCOUS_PRESSURE, lane, pressure)


@kernel
def advance(scratch: Array, state: Array, dt: float, material: Floats) -> None:
    """Advance the elements of one block: a function of its own, or LLVM would not vectorise the loop."""
    for lane in range(LANES):
        element(scratch, state, lane, dt, material)


@inlined
def run_block(b: int, scratch: Array, runs: Any, x: Array, v: Array, state: Array, dt: float, material: Floats) -> None:
    """Advance block b from the motion of its nodes, and work out the rate factors of its next step."""
    states, following = state.reshape(state.size), min(b + 1, runs.shape[0] - 1) * STATE_ROWS * LANES
    fetch(scratch, runs[b], x, v, states, following)
    advance(scratch, state[b].reshape(STATE_ROWS * LANES), dt, material)
    for lane in range(LANES):
        rate = state[b, YIELD_RATE, lane]
        state[b, RATE_FACTOR, lane] = rate_factor(rate, material.rate_c, material.rate_exponent)


@entry
def add_internal_forces(
    scratch: Array, runs: Any, targets: Any, x: Array, v: Array, state: Array, f: Array, dt: float, material: Floats
) -> int:
    """Subtract the internal forces of all elements from the nodal forces and advance the elements' state.

    `targets`, shaped as `runs`, names the rows of `f` for each run of corners: the nodes themselves, or rows apart
    where two parts of a large model meet (`stemcal.fem.lanes`). Returns how many elements have failed.
    """
    failed, step = 0, like(state[0, 0, 0], dt)
    for b in range(runs.shape[0]):
        alive = living(state[b])
        if alive > 0:
            run_block(b, scratch, runs, x, v, state, step, material)
            scatter(scratch, targets[b], f)
            failed += alive - living(state[b])
    return failed
