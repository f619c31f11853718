"""Kinematics of the 8-node hexahedron with one integration point, written in its modes.

A field given at the corners is the sum of eight modes over the reference cube,

    f(ξ,η,ζ) = f₀ + f₁ξ + f₂η + f₃ζ + f₄ηζ + f₅ξζ + f₆ξη + f₇ξηζ,

one constant, three linear and four hourglass modes. In modal form the volume is

    V = 8 ( [x₁,x₂,x₃] + ⅓[x₅,x₄,x₃] + ⅓[x₆,x₂,x₄] + ⅓[x₁,x₆,x₅] ),   [a,b,c] = a·(b×c),

and its derivatives bₘ = ∂V/∂xₘ give the volume mean of any gradient, ⟨∂v/∂x⟩ = Σ vₘ⊗bₘ / V. The element loop uses
unscaled sums over the corners, Xₘ = 8 xₘ, with Bₘ = 8 bₘ, Σ Xₘ Bₘ = 64 V and ⟨∂v/∂x⟩ = Σ Vₘ⊗Bₘ / 64 V. This is the
uniform gradient of Flanagan and Belytschko (Int. J. Numer. Meth. Eng. 17, 679-706, 1981). It is exact for any shape of
the element, so distorted meshes pass the patch test.

Corners are numbered as in LS-DYNA: 1-4 around the face ζ = −1, 5-8 above them.
"""

from stemcal.arrays import Floats
from stemcal.fem.kernels.compile import HALF, ONE, QUARTER, ZERO, inlined, like


@inlined
def modal_sums(f: Floats) -> Floats:
    """Return Hᵀf, eight times the modal amplitudes (1, ξ, η, ζ, ηζ, ξζ, ξη, ξηζ) of eight corner values."""
    # pairs along ξ: sums s and differences d
    s1, d1 = f[1] + f[0], f[1] - f[0]
    s2, d2 = f[2] + f[3], f[2] - f[3]
    s3, d3 = f[5] + f[4], f[5] - f[4]
    s4, d4 = f[6] + f[7], f[6] - f[7]
    # pairs along η
    ss1, sd1, ds1, dd1 = s2 + s1, s2 - s1, d2 + d1, d2 - d1
    ss2, sd2, ds2, dd2 = s4 + s3, s4 - s3, d4 + d3, d4 - d3
    # pairs along ζ
    return ss2 + ss1, ds2 + ds1, sd2 + sd1, ss2 - ss1, sd2 - sd1, ds2 - ds1, dd2 + dd1, dd2 - dd1


@inlined
def spread(m: Floats) -> Floats:
    """Return the corner forces H m that are equivalent to forces m on the modal sums (transpose of `modal_sums`)."""
    # undo ζ
    ss1, ss2 = m[0] - m[3], m[0] + m[3]
    ds1, ds2 = m[1] - m[5], m[1] + m[5]
    sd1, sd2 = m[2] - m[4], m[2] + m[4]
    dd1, dd2 = m[6] - m[7], m[6] + m[7]
    # undo η
    s1, s2, d1, d2 = ss1 - sd1, ss1 + sd1, ds1 - dd1, ds1 + dd1
    s3, s4, d3, d4 = ss2 - sd2, ss2 + sd2, ds2 - dd2, ds2 + dd2
    # undo ξ
    return s1 - d1, s1 + d1, s2 + d2, s2 - d2, s3 - d3, s3 + d3, s4 + d4, s4 - d4


@inlined
def minors(p: Floats, q: Floats) -> Floats:
    """Return one component of Bₘ, m = 1…6, from the modal sums p, q of the other two coordinates in cyclic order.

    For the x component, p and q are the modal sums of y and z; for y, of z and x; for z, of x and y:

        B₁ = X₂×X₃ + ⅓ X₆×X₅    B₄ = ⅓ (X₃×X₅ + X₆×X₂)
        B₂ = X₃×X₁ + ⅓ X₄×X₆    B₅ = ⅓ (X₄×X₃ + X₁×X₆)
        B₃ = X₁×X₂ + ⅓ X₅×X₄    B₆ = ⅓ (X₂×X₄ + X₅×X₁)
    """
    third = like(p[1], 1.0 / 3.0)
    p4, p5, p6 = third * p[4], third * p[5], third * p[6]
    q4, q5, q6 = third * q[4], third * q[5], third * q[6]
    return (
        p[2] * q[3] - q[2] * p[3] + p6 * q[5] - q6 * p[5],
        p[3] * q[1] - q[3] * p[1] + p4 * q[6] - q4 * p[6],
        p[1] * q[2] - q[1] * p[2] + p5 * q[4] - q5 * p[4],
        p[3] * q5 - q[3] * p5 + p6 * q[2] - q6 * p[2],
        p4 * q[3] - q4 * p[3] + p[1] * q6 - q[1] * p6,
        p[2] * q4 - q[2] * p4 + p5 * q[1] - q5 * p[1],
    )


@inlined
def contract(m: Floats, b: Floats) -> Floats:
    """Return Σ fₘ bₘ over the modes m = 1…6; for a coordinate of the element it is V, or 64 V with unscaled sums."""
    return m[1] * b[0] + m[2] * b[1] + m[3] * b[2] + m[4] * b[3] + m[5] * b[4] + m[6] * b[5]


@inlined
def velocity_gradient(u: Floats, v: Floats, w: Floats, bx: Floats, by: Floats, bz: Floats, per_volume: float) -> Floats:
    """Return L = Σ vₘ⊗bₘ / V row by row (∂u/∂x, ∂u/∂y, …); `per_volume` is 1/V, or 1/64 V with unscaled sums."""
    return (
        contract(u, bx) * per_volume,
        contract(u, by) * per_volume,
        contract(u, bz) * per_volume,
        contract(v, bx) * per_volume,
        contract(v, by) * per_volume,
        contract(v, bz) * per_volume,
        contract(w, bx) * per_volume,
        contract(w, by) * per_volume,
        contract(w, bz) * per_volume,
    )


@inlined
def at_midstep(L: Floats, dt: float) -> Floats:
    """Return the velocity gradient in the middle of a step from that at its end, L½ = L + ½dt L².

    With L½, a rigid rotation by θ in one step causes a strain of O(θ⁴) instead of O(θ²).
    """
    h = HALF * dt
    return (
        L[0] + h * (L[0] * L[0] + L[1] * L[3] + L[2] * L[6]),
        L[1] + h * (L[0] * L[1] + L[1] * L[4] + L[2] * L[7]),
        L[2] + h * (L[0] * L[2] + L[1] * L[5] + L[2] * L[8]),
        L[3] + h * (L[3] * L[0] + L[4] * L[3] + L[5] * L[6]),
        L[4] + h * (L[3] * L[1] + L[4] * L[4] + L[5] * L[7]),
        L[5] + h * (L[3] * L[2] + L[4] * L[5] + L[5] * L[8]),
        L[6] + h * (L[6] * L[0] + L[7] * L[3] + L[8] * L[6]),
        L[7] + h * (L[6] * L[1] + L[7] * L[4] + L[8] * L[7]),
        L[8] + h * (L[6] * L[2] + L[7] * L[5] + L[8] * L[8]),
    )


@inlined
def strain_increment(L: Floats, dt: float) -> Floats:
    """Return dt·sym(L) as tensor components (xx, yy, zz, xy, yz, zx)."""
    h = HALF * dt
    return (dt * L[0], dt * L[4], dt * L[8], h * (L[1] + L[3]), h * (L[5] + L[7]), h * (L[2] + L[6]))


@inlined
def spin_rotation(L: Floats, dt: float) -> Floats:
    """Return the rotation R of the step, row by row, from ω = ½ dt curl v.

        R = I + (ω̂ + ½ω̂²) / (1 + ¼|ω|²)

    Hughes and Winget, Int. J. Numer. Meth. Eng. 15, 1862-1867 (1980): orthogonal to round-off.
    """
    h = HALF * dt
    a, b, c = h * (L[7] - L[5]), h * (L[2] - L[6]), h * (L[3] - L[1])
    s = ONE / (ONE + QUARTER * (a * a + b * b + c * c))
    t = HALF * s
    return (
        ONE - t * (b * b + c * c),
        t * a * b - s * c,
        t * a * c + s * b,
        t * a * b + s * c,
        ONE - t * (a * a + c * c),
        t * b * c - s * a,
        t * a * c - s * b,
        t * b * c + s * a,
        ONE - t * (a * a + b * b),
    )


@inlined
def rotate_vector(R: Floats, v: Floats) -> Floats:
    """Return R v for a matrix R given row by row."""
    return (
        R[0] * v[0] + R[1] * v[1] + R[2] * v[2],
        R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
        R[6] * v[0] + R[7] * v[1] + R[8] * v[2],
    )


@inlined
def rotate_tensor(R: Floats, s: Floats) -> Floats:
    """Return R s Rᵀ for a symmetric tensor (xx, yy, zz, xy, yz, zx)."""
    x = rotate_vector(R, (s[0], s[3], s[5]))
    y = rotate_vector(R, (s[3], s[1], s[4]))
    z = rotate_vector(R, (s[5], s[4], s[2]))
    # x, y, z are the columns of R s
    return (
        R[0] * x[0] + R[1] * y[0] + R[2] * z[0],
        R[3] * x[1] + R[4] * y[1] + R[5] * z[1],
        R[6] * x[2] + R[7] * y[2] + R[8] * z[2],
        R[3] * x[0] + R[4] * y[0] + R[5] * z[0],
        R[6] * x[1] + R[7] * y[1] + R[8] * z[1],
        R[0] * x[2] + R[1] * y[2] + R[2] * z[2],
    )


@inlined
def modal_forces(t: Floats, hourglass: Floats, bx: Floats, by: Floats, bz: Floats) -> Floats:
    """Return one component of the modal forces: Fₘ = t·bₘ with the stress row t, plus Qₘ for the modes 4…7.

    A rigid translation does no work, so F₀ = 0.
    """
    return (
        ZERO,
        t[0] * bx[0] + t[1] * by[0] + t[2] * bz[0],
        t[0] * bx[1] + t[1] * by[1] + t[2] * bz[1],
        t[0] * bx[2] + t[1] * by[2] + t[2] * bz[2],
        t[0] * bx[3] + t[1] * by[3] + t[2] * bz[3] + hourglass[0],
        t[0] * bx[4] + t[1] * by[4] + t[2] * bz[4] + hourglass[1],
        t[0] * bx[5] + t[1] * by[5] + t[2] * bz[5] + hourglass[2],
        hourglass[3],
    )
