"""Stiffness and damping of the one-point hexahedron against its four hourglass modes, m = 4…7 of `hexahedron`.

These modes cause no strain at the integration point. Their rate q̇ₘ is the modal velocity without the part of the
uniform velocity gradient L, and their force Qₘ acts on the same combination, so that it is zero for rigid motions and
uniform strains. In sums over the corners (eight times the amplitudes; R is the rotation of the step):

    q̇ₘ = Vₘ − L Xₘ,     Q ← R Q + a q̇ dt

Stress reduces the stiffness of the modes, because an element's forces Vσ·B rotate as its corners move. For a cube of
edge l under pressure p, the volume has the second-order terms (4l/3)(g_ζξ h_ηζ − g_ηζ h_ζξ) in the amplitudes g, h of
two patterns along x and y, so the forces amplify these patterns for p > 48a/l. Under a greater pressure, as below a
wedge, elements would vibrate with growing amplitude; a therefore increases with the stress.

To damp vibrations in these modes, the force is extrapolated by βΔt to Q + β a q̇ Δt.

Flanagan and Belytschko, Int. J. Numer. Meth. Eng. 17, 679-706 (1981), in modal form.
"""

from numpy import sqrt

from stemcal.arrays import Floats
from stemcal.fem.kernels.compile import inlined, like
from stemcal.fem.kernels.hexahedron import rotate_vector

# Ratio of the least stiffness to that which a pressure removes from a cube (l p/48). With ratios below three, the
# patterns still grow under combined pressure and shear.
_TIMES = 3.0
# β, the number of steps by which the force is extrapolated. Under stress these modes grow by some 1e-4 per step, which
# is negligible in tests of 10,000 steps with added mass, but dominant in tests of a million steps with the true mass.
# β = 1/4 damps them by β(ωΔt)²/2 per step, a hundred times that growth, and does not affect slow loads.
DAMPING = 0.25


@inlined
def dot3(a: Floats, b: Floats) -> Floats:
    """Return a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def modal_rate(m: int, u: Floats, v: Floats, w: Floats, x: Floats, y: Floats, z: Floats, L: Floats) -> Floats:
    """Return the rate q̇ₘ = Vₘ − L Xₘ of mode m."""
    return (
        u[m] - (L[0] * x[m] + L[1] * y[m] + L[2] * z[m]),
        v[m] - (L[3] * x[m] + L[4] * y[m] + L[5] * z[m]),
        w[m] - (L[6] * x[m] + L[7] * y[m] + L[8] * z[m]),
    )


@inlined
def taken_by_stress(squared: float, length: float) -> Floats:
    """Return the least stiffness a = 3 l|σ|/(48√3) of an element of length l, with `squared` = σ:σ."""
    return like(length, _TIMES / (48.0 * 3.0**0.5)) * length * sqrt(squared)


@inlined
def resist(old: Floats, rate: Floats, R: Floats, gain: float) -> Floats:
    """Return the force Q = R Q_old + a Δt q̇ on one mode, `gain` = a Δt; R is zero for an element that is not alive."""
    turned = rotate_vector(R, old)
    return turned[0] + gain * rate[0], turned[1] + gain * rate[1], turned[2] + gain * rate[2]


@inlined
def damped(force: Floats, rate: Floats, gain: float) -> Floats:
    """Return the extrapolated force Q + β a Δt q̇, with `gain` = a Δt."""
    share = like(gain, DAMPING) * gain
    return force[0] + share * rate[0], force[1] + share * rate[1], force[2] + share * rate[2]


@inlined
def taken_from_stress(a: Floats, b: Floats, c: Floats, d: Floats, i: int, x: Floats, y: Floats, z: Floats) -> Floats:
    """Return row i of Σ Qₘ⊗Xₘ; this sum, divided by V, is subtracted from the stress, so that Q acts on q̇ₘ alone."""
    return (
        a[i] * x[4] + b[i] * x[5] + c[i] * x[6] + d[i] * x[7],
        a[i] * y[4] + b[i] * y[5] + c[i] * y[6] + d[i] * y[7],
        a[i] * z[4] + b[i] * z[5] + c[i] * z[6] + d[i] * z[7],
    )
