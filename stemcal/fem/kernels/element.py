"""One explicit step of the one-point hexahedron: the physics of one element, and the loops over blocks of them."""

from typing import Any

from numpy import sqrt

from stemcal.arrays import Array, Floats
from stemcal.fem.kernels.block import (
    AHEAD,
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
    PLASTIC_RATE,
    PLASTIC_STRAIN,
    RATE_FACTOR,
    STRESS,
    VELOCITIES,
    VISCOUS_LENGTH,
    VISCOUS_PRESSURE,
    book,
    bring_near,
    fetch,
    living,
    load,
    load3,
    load6,
    load_corners,
    scatter,
    states_of,
    store,
    store3,
    store6,
    store8,
    yielding,
)
from stemcal.fem.kernels.compile import HALF, ONE, TINY, ZERO, entry, inlined, kernel, like
from stemcal.fem.kernels.hexahedron import (
    at_midstep,
    contract,
    minors,
    modal_forces,
    modal_sums,
    rotate_tensor,
    spin_rotation,
    spread,
    strain_increment,
    velocity_gradient,
)
from stemcal.fem.kernels.hourglass import damped, dot3, modal_rate, resist, taken_by_stress, taken_from_stress
from stemcal.fem.kernels.layers import of_block, stress_after
from stemcal.fem.kernels.plasticity import double_dot, rate_factor, smoothed


@inlined
def _per_time(dt: Floats) -> Floats:
    """Return 1/Δt, a finite number even in the first step (Δt = 0); LLVM moves the division out of the loop."""
    return ONE / max(dt, TINY)


@inlined
def _bulk_viscosity(de: Floats, dt: float, length: float, material: Floats) -> Floats:
    """Return the bulk viscosity q = ρ l (c₂ l ε̇ᵥ² + c₁ c |ε̇ᵥ|) in compression, 0 in expansion.

    l: element length, ε̇ᵥ: volume strain rate, c: speed of sound, c₁, c₂: coefficients. Source: von Neumann and
    Richtmyer, J. Appl. Phys. 21, 232-237 (1950), with the usual linear term.
    """
    closing = max(-(de[0] + de[1] + de[2]) * _per_time(dt), ZERO)
    quadratic = material.viscosity_quadratic * length * closing
    linear = material.viscosity_linear * material.sound_speed
    return material.density * length * closing * (quadratic + linear)


@inlined
def _acting_stress(stress: Floats, pressure: float, alive: float) -> Floats:
    """Return (σ − q I)/64, with bulk viscosity q and the 1/64 of unscaled sums; zeros if the element is not alive."""
    share = like(alive, 1.0 / 64.0) if alive > ZERO else ZERO
    return (
        share * (stress[0] - pressure),
        share * (stress[1] - pressure),
        share * (stress[2] - pressure),
        share * stress[3],
        share * stress[4],
        share * stress[5],
    )


@inlined
def _stress_row(i: int, acting: Floats, taken: Floats, per_whole: float) -> Floats:
    """Return row i of the acting stress minus the part that the hourglass forces contribute, `taken` / 64 V."""
    xx, yy, zz, xy, yz, zx = acting
    row = ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))[i]
    return row[0] - per_whole * taken[0], row[1] - per_whole * taken[1], row[2] - per_whole * taken[2]


@inlined
def hourglass_forces(
    state: Array, lane: int, u: Floats, v: Floats, w: Floats, x: Floats, y: Floats, z: Floats,
    L: Floats, R: Floats, stress: Floats, dt: float, alive: float,
) -> Floats:  # fmt: skip
    """Return the forces on the four hourglass modes without damping, the same with damping, and their power.

    The power is that of the mean of old and new forces. All are zero if the element is not alive.
    """
    # stiffness a: the constant one, or the one that the stress requires (`hourglass`); Q ← R Q + a Δt q̇
    lasting = like(alive, 1.0) if alive > ZERO else ZERO
    least = taken_by_stress(double_dot(stress, stress), load(state, VISCOUS_LENGTH, lane))
    wanted = max(load(state, HOURGLASS_STIFFNESS, lane), least)
    stiffness = wanted if alive > ZERO else ZERO
    gain = stiffness * dt
    turn = (
        lasting * R[0], lasting * R[1], lasting * R[2],
        lasting * R[3], lasting * R[4], lasting * R[5],
        lasting * R[6], lasting * R[7], lasting * R[8],
    )  # fmt: skip
    r4, r5 = modal_rate(4, u, v, w, x, y, z, L), modal_rate(5, u, v, w, x, y, z, L)
    r6, r7 = modal_rate(6, u, v, w, x, y, z, L), modal_rate(7, u, v, w, x, y, z, L)
    q4 = resist(load3(state, HOURGLASS_FORCE, lane), r4, turn, gain)
    q5 = resist(load3(state, HOURGLASS_FORCE + 3, lane), r5, turn, gain)
    q6 = resist(load3(state, HOURGLASS_FORCE + 6, lane), r6, turn, gain)
    q7 = resist(load3(state, HOURGLASS_FORCE + 9, lane), r7, turn, gain)
    felt = (damped(q4, r4, gain), damped(q5, r5, gain), damped(q6, r6, gain), damped(q7, r7, gain))
    power = dot3(felt[0], r4) + dot3(felt[1], r5) + dot3(felt[2], r6) + dot3(felt[3], r7)
    squares = dot3(r4, r4) + dot3(r5, r5) + dot3(r6, r6) + dot3(r7, r7)
    return (q4, q5, q6, q7), felt, power - HALF * gain * squares


@inlined
def _corner_forces(
    i: int, acting: Floats, Q: Floats, x: Floats, y: Floats, z: Floats,
    bx: Floats, by: Floats, bz: Floats, per_whole: float,
) -> Floats:  # fmt: skip
    """Return component i of the forces on the eight corners by the acting stress and the hourglass forces Q."""
    q4, q5, q6, q7 = Q
    row = _stress_row(i, acting, taken_from_stress(q4, q5, q6, q7, i, x, y, z), per_whole)
    return spread(modal_forces(row, (q4[i], q5[i], q6[i], q7[i]), bx, by, bz))


@inlined
def element(scratch: Array, state: Array, lane: int, dt: float, material: Floats) -> None:
    """Advance one element by one step: from corner positions and velocities to corner forces and new state.

    An element that is not alive may have zero volume. Its values are multiplied by 0 instead of skipped, because a
    branch would prevent vectorisation; they stay finite. `dt` and `material` have the precision of the state.
    """
    x = modal_sums(load_corners(scratch, COORDINATES, lane))
    y = modal_sums(load_corners(scratch, COORDINATES + 8, lane))
    z = modal_sums(load_corners(scratch, COORDINATES + 16, lane))
    u = modal_sums(load_corners(scratch, VELOCITIES, lane))
    v = modal_sums(load_corners(scratch, VELOCITIES + 8, lane))
    w = modal_sums(load_corners(scratch, VELOCITIES + 16, lane))

    # strain increment and rotation of this step; `whole` is 64 V
    bx, by, bz = minors(y, z), minors(z, x), minors(x, y)
    whole = contract(x, bx)
    volume = like(whole, 1.0 / 64.0) * whole
    alive = load(state, ALIVE, lane)
    per_whole = ONE / whole if alive > ZERO else ZERO
    L = velocity_gradient(u, v, w, bx, by, bz, per_whole)
    Lm = at_midstep(L, dt)
    de, R = strain_increment(Lm, dt), spin_rotation(Lm, dt)

    # stress: rotate the old one with the material, then integrate the material law
    old, back = rotate_tensor(R, load6(state, STRESS, lane)), rotate_tensor(R, load6(state, BACK_STRESS, lane))
    factor, strain = load(state, RATE_FACTOR, lane), load(state, PLASTIC_STRAIN, lane)
    before = strain
    edge = (x[3], y[3], z[3])
    stress, back, strain, q, static_yield = stress_after(old, back, de, strain, factor, edge, material)
    alive = alive if strain < load(state, FAILURE_STRAIN, lane) else ZERO
    pressure = _bulk_viscosity(de, dt, load(state, VISCOUS_LENGTH, lane), material)
    mean_pressure = HALF * (load(state, VISCOUS_PRESSURE, lane) + pressure)
    work = HALF * (double_dot(old, de) + double_dot(stress, de)) - mean_pressure * (de[0] + de[1] + de[2])

    # forces on the corners
    Q, felt, power = hourglass_forces(state, lane, u, v, w, x, y, z, L, R, stress, dt, alive)
    acting = _acting_stress(stress, pressure, alive)
    store8(scratch, FORCES, lane, _corner_forces(0, acting, felt, x, y, z, bx, by, bz, per_whole))
    store8(scratch, FORCES + 8, lane, _corner_forces(1, acting, felt, x, y, z, bx, by, bz, per_whole))
    store8(scratch, FORCES + 16, lane, _corner_forces(2, acting, felt, x, y, z, bx, by, bz, per_whole))

    # new state
    store6(state, STRESS, lane, stress, alive)
    store6(state, BACK_STRESS, lane, back, alive)
    for m in range(4):
        store3(state, HOURGLASS_FORCE + 3 * m, lane, Q[m])
    book(state, INTERNAL_ENERGY, INTERNAL_REMAINDER, lane, volume * work if alive > ZERO else ZERO)
    book(state, HOURGLASS_ENERGY, HOURGLASS_REMAINDER, lane, dt * power if alive > ZERO else ZERO)
    store(state, PLASTIC_STRAIN, lane, strain)
    store(state, ALIVE, lane, alive)
    smooth = smoothed(load(state, PLASTIC_RATE, lane), strain - before, dt, material.rate_filter)
    store(state, PLASTIC_RATE, lane, smooth)
    yielded = double_dot(de, de) if q > static_yield else ZERO
    at_once = -yielded if yielded > ZERO else ONE  # `_follow_rates` replaces −Δε:Δε by the rate factor
    store(state, RATE_FACTOR, lane, factor if material.rate_filter > ZERO else at_once)
    store(state, VISCOUS_PRESSURE, lane, pressure)


@kernel
def advance(scratch: Array, state: Array, dt: float, material: Floats) -> None:
    """Advance the elements of one block. LLVM vectorises this loop only in a separate function."""
    for lane in range(LANES):
        element(scratch, state, lane, dt, material)


@inlined
def _follow_rates(state: Array, dt: float, material: Floats) -> None:
    """Compute the rate factors of yielding elements for the next step; skip blocks without any, as powers are slow."""
    if yielding(state) > 0:
        for lane in range(LANES):
            squared = -load(state, RATE_FACTOR, lane)
            if squared > ZERO:
                rate = sqrt(squared) * _per_time(dt)
                store(state, RATE_FACTOR, lane, rate_factor(rate, material.rate_c, material.rate_exponent))


@kernel
def follow_smooth_rates(state: Array, materials: Floats) -> None:
    """Compute the rate factors of all elements whose plastic strain rate is smoothed."""
    for b in range(state.shape[0]):
        material = of_block(materials, b)
        if material.rate_filter > ZERO and material.rate_c > ZERO:
            for lane in range(LANES):
                rate = state[b, PLASTIC_RATE, lane]
                if rate > ZERO:
                    state[b, RATE_FACTOR, lane] = rate_factor(rate, material.rate_c, material.rate_exponent)


@inlined
def run_block(scratch: Array, runs: Any, seen: Any, state: Array, dt: float, material: Floats) -> None:
    """Advance a block by one step of its nodes' motion, and compute the rate factors for the next step."""
    fetch(scratch, runs, seen)
    advance(scratch, state, dt, material)
    _follow_rates(state, dt, material)


@entry
def add_internal_forces(
    scratch: Array, runs: Any, targets: Any, seen: Any, state: Array, f: Array, dt: float, materials: Floats
) -> int:
    """Subtract the internal forces of all elements from the nodal forces, and advance the elements' state.

    `targets`, shaped as `runs`, has the first row of `f` for each run of corners: that of its nodes, or a separate row
    where two parts of a large model meet (`stemcal.fem.lanes`). Returns the number of elements that failed.
    """
    failed, step, states = 0, like(state[0, 0, 0], dt), states_of(state)
    for b in range(runs.shape[0]):
        alive = living(states[b])
        if alive > 0:
            bring_near(states, b + AHEAD)
            run_block(scratch, runs[b], seen, states[b], step, of_block(materials, b))
            scatter(scratch, targets[b], f)
            failed += alive - living(states[b])
    return failed
