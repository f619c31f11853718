"""Resistance of the one-point hexahedron to its four hourglass modes, m = 4…7 of `hexahedron`.

A uniform strain cannot see these modes. Their rate is what is left of a modal velocity once the uniform gradient is
taken out, and their force acts on the same combination, so that neither a rigid motion nor a uniform strain meets it.
In the sums over the corners, eight times the amplitudes:

    q̇ₘ = Vₘ − L Xₘ,     Q ← R Q + a q̇ dt

Stress takes stiffness from the modes: an element's forces Vσ·B turn as its corners move. Of a cube of edge l under
pressure p the volume has the second-order terms (4l/3)(a_ζξ b_ηζ − a_ηζ b_ζξ) in the amplitudes a, b of two patterns
along x and y, so the forces push these apart from p = 48a/l on. Where the wedge presses harder than that, elements
shake until they have stored enough: a must grow with the stress.

The force acts βΔt ahead, Q + β a q̇ Δt, and so damps what swings in these modes.

Flanagan and Belytschko, Int. J. Numer. Meth. Eng. 17, 679-706 (1981), in modal form.
"""

from typing import Any

from numpy import sqrt

from stemcal.fem.kernels.compile import inlined, like
from stemcal.fem.kernels.hexahedron import rotate_vector

Floats = Any
# How many times what a pressure takes from a cube an element resists with: the fully integrated element is stable, and
# with less than three the patterns still grow where pressure and shear meet.
_TIMES = 3.0
# β: how many steps ahead the force acts. Under stress these modes swing up by some 1e-4 a step: nothing where
# added mass leaves 10,000 steps a test, the whole force where the true mass takes a million. A quarter damps them by
# β(ωΔt)²/2, a hundred times that, and slow loads are not affected.
DAMPING = 0.25


@inlined
def dot3(a: Floats, b: Floats) -> Floats:
    """Return a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def modal_rate(m: int, u: Floats, v: Floats, w: Floats, x: Floats, y: Floats, z: Floats, L: Floats) -> Floats:
    """Return q̇ₘ = Vₘ − L Xₘ."""
    return (
        u[m] - (L[0] * x[m] + L[1] * y[m] + L[2] * z[m]),
        v[m] - (L[3] * x[m] + L[4] * y[m] + L[5] * z[m]),
        w[m] - (L[6] * x[m] + L[7] * y[m] + L[8] * z[m]),
    )


@inlined
def taken_by_stress(squared: float, length: float) -> Floats:
    """Return the least a for a stress of the given σ:σ in an element of the given length: three times l|σ|/48√3."""
    return like(length, _TIMES / (48.0 * 3.0**0.5)) * length * sqrt(squared)


@inlined
def resist(old: Floats, rate: Floats, R: Floats, gain: float) -> Floats:
    """Return the force Q = R Q_old + gain · q̇ on one mode; R is zero for an element that is not alive."""
    turned = rotate_vector(R, old)
    return turned[0] + gain * rate[0], turned[1] + gain * rate[1], turned[2] + gain * rate[2]


@inlined
def damped(force: Floats, rate: Floats, gain: float) -> Floats:
    """Return Q + β a Δt q̇, `gain` being a Δt."""
    share = like(gain, DAMPING) * gain
    return force[0] + share * rate[0], force[1] + share * rate[1], force[2] + share * rate[2]


@inlined
def taken_from_stress(a: Floats, b: Floats, c: Floats, d: Floats, i: int, x: Floats, y: Floats, z: Floats) -> Floats:
    """Return row i of Σ Qₘ⊗Xₘ: over the volume, the stress that keeps the modes orthogonal to uniform strain."""
    return (
        a[i] * x[4] + b[i] * x[5] + c[i] * x[6] + d[i] * x[7],
        a[i] * y[4] + b[i] * y[5] + c[i] * y[6] + d[i] * y[7],
        a[i] * z[4] + b[i] * z[5] + c[i] * z[6] + d[i] * z[7],
    )
