"""Transversely isotropic plastic kinematic material of one element: wood, bark, stems with fibres.

The axis a is the edge ζ of the element, which turns and stretches with the material. The elastic law, in the invariants
of Spencer (Continuum Theory of the Mechanics of Fibre-Reinforced Composites, CISM 282, 1984), needs no local frame:

    C:e = λ tr e I + 2μ_T e + α (e_a I + tr e aa) + 2(μ_L − μ_T)(a ea + ea a) + β e_a aa,   e_a = a·e a.

Hill's equivalent stress q (Proc. R. Soc. A 193, 281-297, 1948), isotropic across the axis, of ξ = dev σ − back stress:

    q² = h₁ ξ:ξ + h₂ |ξa|² + h₃ (a·ξa)²,   normalised so that q = |σ| in uniaxial stress σ along the axis.

With h = (3/2, 0, 0), q is von Mises' stress, and the law is that of `plasticity`.
"""

from typing import NamedTuple

from numpy import sqrt

from stemcal.arrays import Floats
from stemcal.fem.kernels.compile import HALF, ONE, TINY, TWO, ZERO, inlined, like
from stemcal.fem.kernels.plasticity import add_scaled, double_dot, shifted_deviator


class TransverseNumbers(NamedTuple):
    """Constants of a transversely isotropic material for the kernels; created by `Material.transverse_numbers`."""

    hill_1: float
    hill_2: float
    hill_3: float
    bound_lame: float  # λ of λ tr e I + 2μ e + κ e_a aa, a law that is at least as stiff (`Material._bound`)
    bound_shear: float  # its μ
    bound_axial: float  # its κ
    yield_stress: float
    plastic_modulus: float
    beta: float
    rate_c: float
    rate_exponent: float
    rate_filter: float
    density: float
    sound_speed: float
    viscosity_linear: float
    viscosity_quadratic: float
    lame: float  # λ
    twice_shear: float  # 2μ_T
    coupling: float  # α
    shear_gap: float  # 2(μ_L − μ_T)
    axial: float  # β


@inlined
def _dot(a: Floats, b: Floats) -> Floats:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _times(s: Floats, a: Floats) -> Floats:
    """Return the vector s a of a symmetric tensor s."""
    return (
        s[0] * a[0] + s[3] * a[1] + s[5] * a[2],
        s[3] * a[0] + s[1] * a[1] + s[4] * a[2],
        s[5] * a[0] + s[4] * a[1] + s[2] * a[2],
    )


@inlined
def _combined(factor: Floats, e: Floats, spherical: Floats, a: Floats, w: Floats) -> Floats:
    """Return the tensor factor·e + spherical·I + a⊗w + w⊗a."""
    return (
        factor * e[0] + spherical + TWO * a[0] * w[0],
        factor * e[1] + spherical + TWO * a[1] * w[1],
        factor * e[2] + spherical + TWO * a[2] * w[2],
        factor * e[3] + a[0] * w[1] + a[1] * w[0],
        factor * e[4] + a[1] * w[2] + a[2] * w[1],
        factor * e[5] + a[2] * w[0] + a[0] * w[2],
    )


@inlined
def _weighted(f: Floats, v: Floats, g: Floats, a: Floats) -> Floats:
    return f * v[0] + g * a[0], f * v[1] + g * a[1], f * v[2] + g * a[2]


@inlined
def _elastic_stress(e: Floats, a: Floats, material: Floats) -> Floats:
    ea = _times(e, a)
    along, trace = _dot(ea, a), e[0] + e[1] + e[2]
    w = _weighted(material.shear_gap, ea, HALF * (material.coupling * trace + material.axial * along), a)
    return _combined(material.twice_shear, e, material.lame * trace + material.coupling * along, a, w)


@inlined
def unit(edge: Floats) -> Floats:
    """Return the unit vector along an edge; zeros for an edge of zero length."""
    per_length = ONE / sqrt(max(_dot(edge, edge), TINY))
    return per_length * edge[0], per_length * edge[1], per_length * edge[2]


@inlined
def transverse_return(
    old: Floats, back: Floats, de: Floats, plastic_strain: float, rate_factor: float, a: Floats, material: Floats
) -> Floats:
    """Return stress, back stress, plastic strain, trial q and static yield stress σ₀ after a strain increment.

    One iteration of the cutting-plane algorithm of Ortiz and Simo (Int. J. Numer. Meth. Eng. 23, 353-366, 1986). q is
    convex, so the new stress is on or outside the yield surface, and closer after further steps (s: rate factor):

        n = ∂q/∂σ,   Δεp = (q − s σ₀) / (n:C:n + (1−β)Eₚ + s β Eₚ),   σ ← σ − Δεp C:n,   back ← back + (1−β)Eₚ Δεp ξ/q

    The back stress moves along ξ (Ziegler's rule), so it reduces q by exactly (1−β)Eₚ Δεp for every direction of ξ.
    """
    trial = add_scaled(old, ONE, _elastic_stress(de, a, material))
    xi = shifted_deviator(trial, back)
    xi_a = _times(xi, a)
    along = _dot(xi_a, a)
    h1, h2, h3 = material.hill_1, material.hill_2, material.hill_3
    q = sqrt(max(h1 * double_dot(xi, xi) + h2 * _dot(xi_a, xi_a) + h3 * along * along, ZERO))
    static_yield = material.yield_stress + material.beta * material.plastic_modulus * plastic_strain

    # the deviator of q n, n = ∂q/∂σ
    w = _weighted(HALF * h2, xi_a, HALF * h3 * along, a)
    normal = _combined(h1, xi, -like(along, 1.0 / 3.0) * (h2 + h3) * along, a, w)
    stiff = _elastic_stress(normal, a, material)
    kinematic = (ONE - material.beta) * material.plastic_modulus
    slope = kinematic + rate_factor * material.beta * material.plastic_modulus
    excess = max(q - rate_factor * static_yield, ZERO)
    per_q = excess * q / max(double_dot(normal, stiff) + slope * q * q, TINY)
    back = add_scaled(back, kinematic * per_q, xi)
    return add_scaled(trial, -per_q, stiff), back, plastic_strain + per_q * q, q, static_yield
