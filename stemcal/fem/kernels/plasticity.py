"""Plastic kinematic material of one isotropic element: elastic law, mixed hardening, rate factor, radial return.

*MAT_PLASTIC_KINEMATIC of LS-DYNA (material 3), after Krieg and Key, "Implementation of a time dependent plasticity
theory into structural computer programs" (ASME AMD 20, 1976). Stresses are symmetric tensors (xx, yy, zz, xy, yz, zx).
"""

from typing import NamedTuple

from numpy import sqrt

from stemcal.arrays import Floats
from stemcal.fem.kernels.compile import ONE, THREE, THREE_HALVES, TINY, TWO, ZERO, inlined, like


class MaterialNumbers(NamedTuple):
    """Constants of an isotropic material for the kernels, from `stemcal.fem.material.Material.numbers`."""

    bulk: float
    shear: float
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
    lame: float


@inlined
def double_dot(a: Floats, b: Floats) -> Floats:
    """Return a:b of two symmetric tensors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + TWO * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])


@inlined
def elastic_trial(s: Floats, de: Floats, bulk: float, shear: float) -> Floats:
    """Return the elastic trial stress σ + (K − ⅔G) tr(Δε) I + 2G Δε, with bulk modulus K and shear modulus G."""
    volumetric = (bulk - TWO * shear / THREE) * (de[0] + de[1] + de[2])
    twice = TWO * shear
    return (
        s[0] + volumetric + twice * de[0],
        s[1] + volumetric + twice * de[1],
        s[2] + volumetric + twice * de[2],
        s[3] + twice * de[3],
        s[4] + twice * de[4],
        s[5] + twice * de[5],
    )


@inlined
def shifted_deviator(s: Floats, back: Floats) -> Floats:
    """Return ξ = dev σ − α, the deviator of the stress minus the back stress."""
    mean = like(s[0], 1.0 / 3.0) * (s[0] + s[1] + s[2])
    return (
        s[0] - mean - back[0],
        s[1] - mean - back[1],
        s[2] - mean - back[2],
        s[3] - back[3],
        s[4] - back[4],
        s[5] - back[5],
    )


@inlined
def add_scaled(a: Floats, factor: float, b: Floats) -> Floats:
    """Return a + factor·b of two symmetric tensors."""
    return (
        a[0] + factor * b[0],
        a[1] + factor * b[1],
        a[2] + factor * b[2],
        a[3] + factor * b[3],
        a[4] + factor * b[4],
        a[5] + factor * b[5],
    )


@inlined
def _plastic_increment(q: float, static_yield: float, rate_factor: float, material: Floats) -> Floats:
    """Return the plastic strain increment Δεp that returns the trial stress q to the yield surface, and Δεp/q.

    Δεp = (q − s σ₀) / (3G + (1−β)Eₚ + s β Eₚ),   0 for q < s σ₀;   σ₀ = σ_y + β Eₚ εp,   s the rate factor
    """
    beta_hardening = material.beta * material.plastic_modulus
    excess = max(q - rate_factor * static_yield, ZERO)
    slope = THREE * material.shear + (ONE - material.beta) * material.plastic_modulus + rate_factor * beta_hardening
    per_q = excess / (slope * max(q, TINY))  # a single division, because it takes as long as twenty products
    return per_q * q, per_q


@inlined
def radial_return(trial: Floats, back: Floats, plastic_strain: float, rate_factor: float, material: Floats) -> Floats:
    """Return stress, back stress, plastic strain, trial q and static yield stress after the plastic correction.

    n = 3/2 ξ/q,   σ ← σ − 2G Δεp n,   back stress α ← α + ⅔(1−β)Eₚ Δεp n,   q = √(3/2 ξ:ξ)
    """
    xi = shifted_deviator(trial, back)
    q = sqrt(THREE_HALVES * double_dot(xi, xi))
    static_yield = material.yield_stress + material.beta * material.plastic_modulus * plastic_strain
    increment, per_q = _plastic_increment(q, static_yield, rate_factor, material)
    flow = THREE_HALVES * per_q
    stress = add_scaled(trial, -TWO * material.shear * flow, xi)
    kinematic = TWO * (ONE - material.beta) * material.plastic_modulus / THREE
    return stress, add_scaled(back, kinematic * flow, xi), plastic_strain + increment, q, static_yield


@inlined
def smoothed(rate: Floats, increment: Floats, dt: Floats, time: Floats) -> Floats:
    """Return the smoothed plastic strain rate r after a step: first-order filter τ ṙ = ε̇ₚ − r, implicit in time."""
    whole: Floats = max(time + dt, TINY)
    return rate + (increment - dt * rate) / whole


@inlined
def rate_factor(rate: float, c: float, exponent: float) -> Floats:
    """Return the rate factor on the yield stress, 1 + (ε̇/C)^exponent; 1 if C = 0.

    The exponent is 1/P in the law of Cowper and Symonds, P in that of the published study. The rate is √(ε̇:ε̇) of a
    step, or the smoothed plastic strain rate, which excludes vibrations.
    """
    if c <= 0.0 or rate <= 0.0:
        return ONE
    return ONE + (rate / c) ** exponent
