"""The plastic kinematic material (LS-DYNA's *MAT_003) and how an element resists its hourglass modes."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import Literal

from stemcal.fem.kernels.element import MaterialNumbers

RateLaw = Literal["paper", "cowper_symonds"]

# The exponent that each law puts on ε̇/C, given the parameter P.
RATE_EXPONENTS = {"paper": lambda p: p, "cowper_symonds": lambda p: 1.0 / p}

# Stiffness a against each hourglass pattern Γ = ±1 of the corners, as a share of (λ+2μ) V^⅓, at coefficient 1: as
# OpenRadioss takes the coefficient of LS-DYNA's types 4 and 5 (its routine s_hg5). At 0.55 it is a cube's own bending.
HOURGLASS_SHARE = 0.038


@dataclass(frozen=True)
class Material:
    """Isotropic elastic-plastic material with mixed linear hardening, rate dependence and failure.

    Parameters
    ----------
    density : float
        ρ, t/mm³.
    elastic_modulus, poisson_ratio : float
        E in MPa, ν.
    yield_stress, tangent_modulus : float
        σ_y and E_t in MPa, E_t < E; the plastic modulus is Eₚ = E E_t / (E − E_t).
    hardening_parameter : float
        β, 0 for kinematic and 1 for isotropic hardening.
    strain_rate_c, strain_rate_p : float
        C in 1/s and P of the rate law; C = 0 switches it off.
    failure_strain : float
        Effective plastic strain at which an element is eroded.
    rate_law : str
        ``cowper_symonds`` scales yield by 1 + (ε̇/C)^(1/P), ``paper`` by 1 + (ε̇/C)^P.
    rate_filter : float
        Time over which the plastic strain rate is smoothed before it enters the law, s. With 0 the rate is that of each
        step by itself, in which every vibration counts.
    internal_length : float
        ℓ of the weight exp(−r²/ℓ²) over which the plastic strain is averaged before it is held against the failure
        strain, mm; 0 takes each element by itself. See `kernels.nonlocal_mean`.
    """

    density: float
    elastic_modulus: float
    poisson_ratio: float
    yield_stress: float = inf
    tangent_modulus: float = 0.0
    hardening_parameter: float = 0.0
    strain_rate_c: float = 0.0
    strain_rate_p: float = 1.0
    failure_strain: float = inf
    rate_law: RateLaw = "cowper_symonds"
    rate_filter: float = 0.0
    internal_length: float = 0.0

    @property
    def own_failure_strain(self) -> float:
        """The strain at which an element fails by itself; none with an internal length, where mean strains decide."""
        return inf if self.internal_length > 0.0 else self.failure_strain

    @property
    def bulk_modulus(self) -> float:
        """K = E / 3(1 − 2ν), MPa."""
        return self.elastic_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))

    @property
    def shear_modulus(self) -> float:
        """G = E / 2(1 + ν), MPa."""
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lame_modulus(self) -> float:
        """λ = K − ⅔ G, MPa."""
        return self.bulk_modulus - 2.0 / 3.0 * self.shear_modulus

    @property
    def p_wave_modulus(self) -> float:
        """λ + 2μ = K + 4/3 G, MPa."""
        return self.bulk_modulus + 4.0 / 3.0 * self.shear_modulus

    @property
    def plastic_modulus(self) -> float:
        """Eₚ = E E_t / (E − E_t), MPa."""
        return self.elastic_modulus * self.tangent_modulus / (self.elastic_modulus - self.tangent_modulus)

    def numbers(self, mass_scaling: float, viscosity: BulkViscosity) -> MaterialNumbers:
        """Return what the kernels need, with the density scaled."""
        density = mass_scaling * self.density
        return MaterialNumbers(
            bulk=self.bulk_modulus,
            shear=self.shear_modulus,
            yield_stress=min(self.yield_stress, 1.0e30),
            plastic_modulus=self.plastic_modulus,
            beta=float(self.hardening_parameter),
            rate_c=float(self.strain_rate_c),
            rate_exponent=RATE_EXPONENTS[self.rate_law](float(self.strain_rate_p)),
            rate_filter=self.rate_filter,
            density=density,
            sound_speed=sqrt(self.p_wave_modulus / density),
            viscosity_linear=viscosity.linear,
            viscosity_quadratic=viscosity.quadratic,
        )


@dataclass(frozen=True)
class BulkViscosity:
    """Pressure that smears shocks over elements: q = ρ l (quadratic · l ε̇ᵥ² + linear · c |ε̇ᵥ|) in compression."""

    linear: float = 0.06
    quadratic: float = 1.5
