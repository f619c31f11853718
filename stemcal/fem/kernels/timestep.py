"""The largest stable time step of central differences, from the current shapes of the elements."""

from typing import Any

import numpy as np
from numpy import sqrt

from stemcal.arrays import Array, Floats
from stemcal.fem.kernels.block import (
    ALIVE,
    COORDINATES,
    ELEMENT_MASS,
    HOURGLASS_STIFFNESS,
    LANES,
    RATES,
    VOLUMES,
    fetch,
    held,
    load,
    load_corners,
    states_of,
)
from stemcal.fem.kernels.compile import SIXTY_FOUR, ZERO, entry, inlined, kernel, like
from stemcal.fem.kernels.hexahedron import contract, minors, modal_sums
from stemcal.fem.kernels.hourglass import DAMPING
from stemcal.fem.kernels.layers import of_block, uniform_stiffness
from stemcal.fem.kernels.llvm import write_scratch


@inlined
def _element_coordinates(hexes: Any, e: int, x: Array, i: int) -> Floats:
    """Return coordinate i of the corners of element e."""
    return (
        x[hexes[e, 0], i], x[hexes[e, 1], i], x[hexes[e, 2], i], x[hexes[e, 3], i],
        x[hexes[e, 4], i], x[hexes[e, 5], i], x[hexes[e, 6], i], x[hexes[e, 7], i],
    )  # fmt: skip


@inlined
def _dot6(a: Floats, b: Floats) -> float:
    """Return Σ aₘ bₘ over the modes m = 1…6."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@inlined
def _squared_frequency(x: Floats, y: Floats, z: Floats, stiffness: float, mass: float, material: Floats) -> Floats:
    """Return an upper bound of ω² (1/s²) of the fastest mode of a free element, and 64 V, from its modal sums.

    Let G be the 3×3 products BᵢBⱼ of the nodal gradients. Then (tr ε)² ≤ |u|² tr G and ε:ε ≤ |u|² ‖G‖, so the stiffness
    against uniform strain is at most V (λ tr G + 2μ ‖G‖), with Gershgorin's bound for ‖G‖. The volume mode of a cube
    attains this bound. A transversely isotropic material with axis a is at most as stiff as an isotropic one plus a
    term κ e_a aa, which adds V κ a·G a (`Material._bound`).
    The hourglass modes (stiffness a) have ω² = 64 a/m; the damping β limits the step as if ω² were 1 + 2β times that.
    """
    bx, by, bz = minors(y, z), minors(z, x), minors(x, y)
    whole = contract(x, bx)
    xx, yy, zz = _dot6(bx, bx), _dot6(by, by), _dot6(bz, bz)
    xy, yz, zx = _dot6(bx, by), _dot6(by, bz), _dot6(bz, bx)
    norm = max(xx + abs(xy) + abs(zx), max(yy + abs(xy) + abs(yz), zz + abs(yz) + abs(zx)))
    uniform = uniform_stiffness((xx, yy, zz, xy, yz, zx), (x[3], y[3], z[3]), norm, material) / whole
    hourglass = like(stiffness, 64.0 * (1.0 + 2.0 * DAMPING)) * stiffness
    return max(uniform, hourglass) / mass, whole


@entry
def element_steps(topology: Floats, x: Array, state: Array, element_mass: Array, material: Floats) -> Array:
    """Return the stable step 2/ω of each element (E,), s."""
    hexes, slots = topology.hexes, topology.slots
    steps = np.empty(hexes.shape[0])
    for e in range(hexes.shape[0]):
        omega2, _ = _squared_frequency(
            modal_sums(_element_coordinates(hexes, e, x, 0)),
            modal_sums(_element_coordinates(hexes, e, x, 1)),
            modal_sums(_element_coordinates(hexes, e, x, 2)),
            held(state, slots[e], HOURGLASS_STIFFNESS),
            element_mass[e],
            material,
        )
        steps[e] = 2.0 / sqrt(max(omega2, 1.0e-300))
    return steps


@kernel
def _find_frequencies(scratch: Array, state: Array, material: Floats) -> None:
    """Store ω² and 64 V of the elements of a block in the rows `RATES` and `VOLUMES` of the scratch array."""
    for lane in range(LANES):
        x = modal_sums(load_corners(scratch, COORDINATES, lane))
        y = modal_sums(load_corners(scratch, COORDINATES + 8, lane))
        z = modal_sums(load_corners(scratch, COORDINATES + 16, lane))
        stiffness, mass = load(state, HOURGLASS_STIFFNESS, lane), load(state, ELEMENT_MASS, lane)
        omega2, whole = _squared_frequency(x, y, z, stiffness, mass, material)
        write_scratch(scratch, RATES * LANES + lane, omega2)
        write_scratch(scratch, VOLUMES * LANES + lane, whole)


@entry
def stable_step(body: Floats, materials: Floats) -> Floats:
    """Return the stable step 2/ω of the standing elements, the slot of the element that determines it, and its volume.

    ω is that of the fastest free element: no frequency of the assembled mesh is higher. The search ends with step 0 at
    an element whose volume is not positive.
    """
    scratch, state, runs, states = body.scratch, body.state, body.runs, states_of(body.state)
    first = state[0, 0, 0]
    fastest, slowest, smallest = ZERO * first, 0, SIXTY_FOUR + ZERO * first
    for b in range(runs.shape[0]):
        fetch(scratch, runs[b], body.seen)
        _find_frequencies(scratch, states[b], of_block(materials, b))
        for lane in range(LANES):
            if state[b, ALIVE, lane] == ZERO:
                continue
            omega2, whole = scratch[RATES * LANES + lane], scratch[VOLUMES * LANES + lane]
            if not whole > ZERO:
                return 0.0, b * LANES + lane, whole / 64.0
            if omega2 > fastest:
                fastest, slowest, smallest = omega2, b * LANES + lane, whole
    return 2.0 / sqrt(max(float(fastest), 1.0e-300)), slowest, smallest / 64.0
