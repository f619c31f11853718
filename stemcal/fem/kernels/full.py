"""The fully integrated hexahedron: eight points for the deviator, the element's mean for the dilatation.

Selective reduced integration in the form of a mean dilatation (Nagtegaal, Parks and Rice, Comput. Methods Appl. Mech.
Eng. 4, 153-177, 1974; Hughes' B̄): it has no hourglass modes and does not lock in volume. It is the reference that
the one-point element is held against, and costs about ten times as much.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.block import (
    ALIVE,
    FAILURE_STRAIN,
    INTERNAL_ENERGY,
    LANES,
    PLASTIC_STRAIN,
    VISCOUS_LENGTH,
    VISCOUS_PRESSURE,
)
from stemcal.fem.kernels.compile import entry, inlined
from stemcal.fem.kernels.element import bulk_viscosity
from stemcal.fem.kernels.hexahedron import (
    at_midstep,
    contract,
    corners,
    minor_derivatives,
    modes,
    rotate_tensor,
    spin_rotation,
    strain_increment,
    velocity_gradient,
)
from stemcal.fem.kernels.hourglass import dot3
from stemcal.fem.kernels.plasticity import (
    double_dot,
    elastic_trial,
    equivalent_rate,
    radial_return,
    rate_factor,
    smoothed,
)
from stemcal.fem.kernels.timestep import element_coordinates

Floats = Any
Array = NDArray[np.float64]

# What each of an element's eight points keeps: stress, back stress, plastic strain, rate factor, smoothed rate.
POINT_STRESS = slice(0, 6)
POINT_PLASTIC_STRAIN = 12
POINT_RATE_FACTOR = 13
POINT_PLASTIC_RATE = 14
POINT_ROWS = 15
_GAUSS = 1.0 / np.sqrt(3.0)
SIGNS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    dtype=np.float64,
)
POINTS = _GAUSS * SIGNS


@inlined
def reference_gradient(f: Floats, xi: float, eta: float, zeta: float) -> Floats:
    """Return (∂f/∂ξ, ∂f/∂η, ∂f/∂ζ) of a field given by its modes."""
    return (
        f[1] + f[5] * zeta + f[6] * eta + f[7] * eta * zeta,
        f[2] + f[4] * zeta + f[6] * xi + f[7] * xi * zeta,
        f[3] + f[4] * eta + f[5] * xi + f[7] * xi * eta,
    )


@inlined
def inverse(a: Floats, b: Floats, c: Floats) -> Floats:
    """Return the determinant of the Jacobian with rows ∂x/∂ξ etc. given as gradients of x, y, z, and the cofactors."""
    cx = (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0])
    cy = (c[1] * a[2] - c[2] * a[1], c[2] * a[0] - c[0] * a[2], c[0] * a[1] - c[1] * a[0])
    cz = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return a[0] * cx[0] + a[1] * cx[1] + a[2] * cx[2], cx, cy, cz


@inlined
def point_gradient(u: Floats, v: Floats, w: Floats, cx: Floats, cy: Floats, cz: Floats, det: float) -> Floats:
    """Return the velocity gradient at a point from the reference gradients of the velocity and the cofactors."""
    s = 1.0 / det
    return (
        s * dot3(u, cx), s * dot3(u, cy), s * dot3(u, cz),
        s * dot3(v, cx), s * dot3(v, cy), s * dot3(v, cz),
        s * dot3(w, cx), s * dot3(w, cy), s * dot3(w, cz),
    )  # fmt: skip


@inlined
def with_trace(L: Floats, trace: float) -> Floats:
    """Return the gradient with its trace replaced."""
    shift = (trace - L[0] - L[4] - L[8]) / 3.0
    return L[0] + shift, L[1], L[2], L[3], L[4] + shift, L[5], L[6], L[7], L[8] + shift


@inlined
def read6(row: Array, first: int) -> Floats:
    """Return six successive values."""
    return row[first], row[first + 1], row[first + 2], row[first + 3], row[first + 4], row[first + 5]


@inlined
def write6(row: Array, first: int, values: Floats) -> None:
    """Store six successive values."""
    for i in range(6):
        row[first + i] = values[i]


@inlined
def update_point(row: Array, L: Floats, dt: float, material: Floats) -> Floats:
    """Advance the state of one point by one step; returns its stress and its work per volume."""
    Lm = at_midstep(L, dt)
    de, R = strain_increment(Lm, dt), spin_rotation(Lm, dt)
    old = rotate_tensor(R, read6(row, 0))
    trial = elastic_trial(old, de, material.bulk, material.shear)
    before = row[POINT_PLASTIC_STRAIN]
    stress, back, strain, q, static_yield = radial_return(
        trial, rotate_tensor(R, read6(row, 6)), before, row[POINT_RATE_FACTOR], material
    )
    write6(row, 0, stress)
    write6(row, 6, back)
    row[POINT_PLASTIC_STRAIN] = strain
    row[POINT_PLASTIC_RATE] = smoothed(row[POINT_PLASTIC_RATE], strain - before, dt, material.rate_filter)
    at_once = equivalent_rate(de, dt) if q > static_yield else 0.0
    rate = row[POINT_PLASTIC_RATE] if material.rate_filter > 0.0 else at_once
    row[POINT_RATE_FACTOR] = rate_factor(rate, material.rate_c, material.rate_exponent)
    return stress, 0.5 * (double_dot(old, de) + double_dot(stress, de))


@entry
def add_full_internal_forces(
    topology: Floats, points: Array, x: Array, v: Array, state: Array, f: Array, dt: float, material: Floats
) -> None:
    """Subtract the internal forces of fully integrated elements and advance the state of their points.

    An element fails when the mean plastic strain of its points reaches the failure strain.
    """
    hexes, slots = topology.hexes, topology.slots
    for e in range(hexes.shape[0]):
        block, lane = slots[e] // LANES, slots[e] % LANES
        if state[block, ALIVE, lane] == 0.0:
            continue
        mx, my, mz = (
            modes(element_coordinates(hexes, e, x, 0)),
            modes(element_coordinates(hexes, e, x, 1)),
            modes(element_coordinates(hexes, e, x, 2)),
        )
        mu, mv, mw = (
            modes(element_coordinates(hexes, e, v, 0)),
            modes(element_coordinates(hexes, e, v, 1)),
            modes(element_coordinates(hexes, e, v, 2)),
        )
        bx, by, bz = minor_derivatives(my, mz), minor_derivatives(mz, mx), minor_derivatives(mx, my)
        volume = contract(mx, bx)
        mean = velocity_gradient(mu, mv, mw, bx, by, bz, 1.0 / volume)
        trace = mean[0] + mean[4] + mean[8]
        # modal forces of the deviator, summed over the points
        fu, fv, fw = np.zeros(8), np.zeros(8), np.zeros(8)
        pressure, energy, strain, weights = 0.0, 0.0, 0.0, 0.0
        for g in range(8):
            xi, eta, zeta = POINTS[g, 0], POINTS[g, 1], POINTS[g, 2]
            det, cx, cy, cz = inverse(
                reference_gradient(mx, xi, eta, zeta),
                reference_gradient(my, xi, eta, zeta),
                reference_gradient(mz, xi, eta, zeta),
            )
            L = point_gradient(
                reference_gradient(mu, xi, eta, zeta),
                reference_gradient(mv, xi, eta, zeta),
                reference_gradient(mw, xi, eta, zeta),
                cx, cy, cz, det,
            )  # fmt: skip
            stress, work = update_point(points[e, g], with_trace(L, trace), dt, material)
            p = (stress[0] + stress[1] + stress[2]) / 3.0
            add_point_force(fu, xi, eta, zeta, stress[0] - p, stress[3], stress[5], cx, cy, cz)
            add_point_force(fv, xi, eta, zeta, stress[3], stress[1] - p, stress[4], cx, cy, cz)
            add_point_force(fw, xi, eta, zeta, stress[5], stress[4], stress[2] - p, cx, cy, cz)
            pressure += det * p
            energy += det * work
            strain += det * points[e, g, POINT_PLASTIC_STRAIN]
            weights += det
        de = strain_increment(at_midstep(mean, dt), dt)
        q = bulk_viscosity(de, dt, state[block, VISCOUS_LENGTH, lane], material)
        pressure = pressure / volume - q
        state[block, PLASTIC_STRAIN, lane] = strain / weights
        if strain / weights >= state[block, FAILURE_STRAIN, lane]:
            state[block, ALIVE, lane] = 0.0
            continue
        mean_q = 0.5 * (state[block, VISCOUS_PRESSURE, lane] + q)
        state[block, VISCOUS_PRESSURE, lane] = q
        state[block, INTERNAL_ENERGY, lane] += energy - mean_q * volume * (de[0] + de[1] + de[2])
        for m in range(6):
            fu[m + 1] += pressure * bx[m]
            fv[m + 1] += pressure * by[m]
            fw[m + 1] += pressure * bz[m]
        cu, cv, cw = corners(fu), corners(fv), corners(fw)
        for a in range(8):
            n = hexes[e, a]
            f[n, 0] -= cu[a]
            f[n, 1] -= cv[a]
            f[n, 2] -= cw[a]


@inlined
def add_point_force(
    modal: Array,
    xi: float,
    eta: float,
    zeta: float,
    tx: float,
    ty: float,
    tz: float,
    cx: Floats,
    cy: Floats,
    cz: Floats,
) -> None:
    """Add what a stress row (tx, ty, tz) at a point gives to the modal forces, Fₘ += t·∂φₘ/∂x det J.

    The modes' reference gradients are those of ξ, η, ζ, ηζ, ξζ, ξη, ξηζ.
    """
    a = tx * cx[0] + ty * cy[0] + tz * cz[0]
    b = tx * cx[1] + ty * cy[1] + tz * cz[1]
    c = tx * cx[2] + ty * cy[2] + tz * cz[2]
    modal[1] += a
    modal[2] += b
    modal[3] += c
    modal[4] += b * zeta + c * eta
    modal[5] += a * zeta + c * xi
    modal[6] += a * eta + b * xi
    modal[7] += a * eta * zeta + b * xi * zeta + c * xi * eta
