"""The largest stable time step of central differences, from the elements as they are now."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import sqrt
from numpy.typing import NDArray

from stemcal.fem.kernels.compile import inlined, kernel
from stemcal.fem.kernels.element import ALIVE, HOURGLASS_STIFFNESS, LANES
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
def gradient_norm(bx: Floats, by: Floats, bz: Floats, volume: float) -> float:
    """Return a bound of the largest eigenvalue of Bᵢ·Bⱼ, the 3×3 products of the nodal gradients (Gershgorin's)."""
    scale = 1.0 / (8.0 * volume * volume)
    xy, yz, zx = abs(dot6(bx, by)), abs(dot6(by, bz)), abs(dot6(bz, bx))
    return scale * max(dot6(bx, bx) + xy + zx, max(dot6(by, by) + xy + yz, dot6(bz, bz) + yz + zx))


@kernel
def stable_step(hexes: Any, x: Array, state: Array, element_mass: Array, modulus: float, memory: float) -> Floats:
    """Return the stable step 2/ω of the standing elements, the element that sets it, and its volume.

    ω² ≤ 8 (λ+2μ) V ‖BBᵀ‖ / m for the element's uniform strain (Flanagan and Belytschko, 1981); its stiffness
    hourglass modes have ω² = k/m. A volume that is not positive ends the search with step 0.
    """
    fastest, slowest, smallest = 0.0, -1, 1.0
    for e in range(hexes.shape[0]):
        block, lane = e // LANES, e % LANES
        if state[block, ALIVE, lane] == 0.0:
            continue
        mx, my, mz = (
            modes(element_coordinates(hexes, e, x, 0)),
            modes(element_coordinates(hexes, e, x, 1)),
            modes(element_coordinates(hexes, e, x, 2)),
        )
        bx, by, bz = minor_derivatives(my, mz), minor_derivatives(mz, mx), minor_derivatives(mx, my)
        volume = contract(mx, bx)
        if not volume > 0.0:
            return 0.0, e, volume
        uniform = 8.0 * modulus * volume * gradient_norm(bx, by, bz, volume)
        hourglass = memory * state[block, HOURGLASS_STIFFNESS, lane]
        omega2 = max(uniform, hourglass) / element_mass[e]
        if omega2 > fastest:
            fastest, slowest, smallest = omega2, e, volume
    return 2.0 / sqrt(max(fastest, 1.0e-300)), slowest, smallest
