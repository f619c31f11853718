"""The largest stable time step of central differences, from the elements as they are now."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import sqrt
from numpy.typing import NDArray

from stemcal.fem.kernels.block import ALIVE, HOURGLASS_STIFFNESS, held
from stemcal.fem.kernels.compile import entry, inlined
from stemcal.fem.kernels.hexahedron import contract, minor_derivatives, modes

Floats = Any
Array = NDArray[np.float64]


@inlined
def element_coordinates(hexes: Any, e: int, x: Array, i: int) -> Floats:
    """Return component i of the corners of element e."""
    return (
        x[hexes[e, 0], i], x[hexes[e, 1], i], x[hexes[e, 2], i], x[hexes[e, 3], i],
        x[hexes[e, 4], i], x[hexes[e, 5], i], x[hexes[e, 6], i], x[hexes[e, 7], i],
    )  # fmt: skip


@inlined
def dot6(a: Floats, b: Floats) -> float:
    """Return Σ aₘ bₘ over six modes."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@inlined
def stiffness_bound(bx: Floats, by: Floats, bz: Floats, volume: float, lame: float, shear: float) -> float:
    """Return a bound of the largest eigenvalue of an element's uniform-strain stiffness over its volume.

    With G the 3×3 products BᵢBⱼ of the nodal gradients, (tr ε)² ≤ |u|² tr G and ε:ε ≤ |u|² ‖G‖, hence
    λ tr G + 2μ ‖G‖, with Gershgorin's bound for ‖G‖. A cube's volume mode attains it.
    """
    xx, yy, zz = dot6(bx, bx), dot6(by, by), dot6(bz, bz)
    xy, yz, zx = abs(dot6(bx, by)), abs(dot6(by, bz)), abs(dot6(bz, bx))
    norm = max(xx + xy + zx, max(yy + xy + yz, zz + yz + zx))
    # nodal gradients are ⅛ of the modal ones in these products, over V²
    return (lame * (xx + yy + zz) + 2.0 * shear * norm) / (8.0 * volume * volume)


@inlined
def frequency(
    topology: Floats, e: int, x: Array, state: Array, mass: Array, lame: float, shear: float, memory: float
) -> Floats:
    """Return a bound of ω² of the fastest mode of a free element, 1/s², and its volume.

    ω² ≤ 8 V k / m for its uniform strain, k from `stiffness_bound`; its stiffness hourglass modes have ω² = 64 a/m.
    """
    hexes = topology.hexes
    mx, my, mz = (
        modes(element_coordinates(hexes, e, x, 0)),
        modes(element_coordinates(hexes, e, x, 1)),
        modes(element_coordinates(hexes, e, x, 2)),
    )
    bx, by, bz = minor_derivatives(my, mz), minor_derivatives(mz, mx), minor_derivatives(mx, my)
    volume = contract(mx, bx)
    uniform = 8.0 * volume * stiffness_bound(bx, by, bz, volume, lame, shear)
    hourglass = 64.0 * memory * held(state, topology.slots[e], HOURGLASS_STIFFNESS)
    return max(uniform, hourglass) / mass[e], volume


@entry
def element_steps(
    topology: Floats, x: Array, state: Array, element_mass: Array, lame: float, shear: float, memory: float
) -> Array:
    """Return the stable step 2/ω of each element (E,), s."""
    steps = np.empty(topology.hexes.shape[0])
    for e in range(topology.hexes.shape[0]):
        omega2, _ = frequency(topology, e, x, state, element_mass, lame, shear, memory)
        steps[e] = 2.0 / sqrt(max(omega2, 1.0e-300))
    return steps


@entry
def stable_step(
    topology: Floats, x: Array, state: Array, element_mass: Array, lame: float, shear: float, memory: float
) -> Floats:
    """Return the stable step 2/ω of the standing elements, the element that sets it, and its volume.

    No assembled mesh is faster than its fastest free element. A volume that is not positive ends the search with
    step 0.
    """
    fastest, slowest, smallest = 0.0, -1, 1.0
    for e in range(topology.hexes.shape[0]):
        if held(state, topology.slots[e], ALIVE) == 0.0:
            continue
        omega2, volume = frequency(topology, e, x, state, element_mass, lame, shear, memory)
        if not volume > 0.0:
            return 0.0, e, volume
        if omega2 > fastest:
            fastest, slowest, smallest = omega2, e, volume
    return 2.0 / sqrt(max(fastest, 1.0e-300)), slowest, smallest
