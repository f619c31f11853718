"""The plastic kinematic material (LS-DYNA's *MAT_003), the bulk viscosity and the hourglass stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.fibres import TransverseNumbers
from stemcal.fem.kernels.plasticity import MaterialNumbers

RateLaw = Literal["paper", "cowper_symonds"]

# Exponent of ε̇/C in each rate law, as a function of its parameter P.
_RATE_EXPONENTS = {"paper": lambda p: p, "cowper_symonds": lambda p: 1.0 / p}

# Stiffness a of each hourglass pattern Γ = ±1 of the corners, as a share of (λ+2μ) V^⅓ at coefficient 1. OpenRadioss
# interprets the coefficient of LS-DYNA's types 4 and 5 in this way (routine s_hg5). At coefficient 0.55, the bending
# stiffness of a cube with ν = 0 is exact.
HOURGLASS_SHARE = 0.038

# Yield stress of a material that never yields, MPa, finite also in single precision.
_NEVER = 1.0e30


@dataclass(frozen=True)
class Transverse:
    """Properties of a material across its axis (L along, T across); the values in `Material` then apply along the axis.

    elastic_modulus, shear_modulus: E_T across the axis, G_LT between the axis and a direction across it, MPa.
    poisson_ratio: ν_TT between two directions across the axis; the material's ν_LT is for tension along the axis.
    yield_stress, shear_yield_stress: Yield stresses in tension across the axis, and in shear between the axis and a
        direction across it, MPa.
    """

    elastic_modulus: float
    shear_modulus: float
    poisson_ratio: float
    yield_stress: float = inf
    shear_yield_stress: float = inf


@dataclass(frozen=True)
class Material:
    """Elastic-plastic material with mixed linear hardening, rate dependence and failure.

    It is isotropic, or with `transverse` transversely isotropic about the element edge ζ: then E, ν, yield stress, E_t
    and failure strain are those of tension along this axis.

    density: ρ, t/mm³.
    elastic_modulus, poisson_ratio: E in MPa, ν.
    yield_stress, tangent_modulus: σ_y and E_t in MPa, E_t < E; the plastic modulus is Eₚ = E E_t / (E − E_t).
    hardening_parameter: β, 0 for kinematic and 1 for isotropic hardening.
    strain_rate_c, strain_rate_p: C in 1/s and P of the rate law; C = 0 switches it off.
    failure_strain: Effective plastic strain at which an element is eroded.
    rate_law: ``cowper_symonds`` scales yield by 1 + (ε̇/C)^(1/P), ``paper`` by 1 + (ε̇/C)^P.
    rate_filter: Time over which the plastic strain rate is smoothed before it enters the rate law, s. With 0 the rate
        is that of the single step, which includes vibrations.
    internal_length: ℓ of the weight exp(−r²/ℓ²) with which the plastic strain is averaged before it is compared with
        the failure strain, mm; with 0, each element fails by its own strain. See `kernels.nonlocal_mean`.
    transverse: Properties across the axis; isotropic if None.
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
    transverse: Transverse | None = None

    @property
    def own_failure_strain(self) -> float:
        """Plastic strain at which an element fails by its own strain; infinite if a mean strain decides instead."""
        return inf if self.internal_length > 0.0 else self.failure_strain

    @property
    def bulk_modulus(self) -> float:
        """Bulk modulus K = E / 3(1 − 2ν), MPa."""
        return self.elastic_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G = E / 2(1 + ν), MPa."""
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lame_modulus(self) -> float:
        """Lamé's first parameter λ = K − ⅔ G, MPa."""
        return self.bulk_modulus - 2.0 / 3.0 * self.shear_modulus

    @property
    def p_wave_modulus(self) -> float:
        """P-wave modulus λ + 2μ = K + 4/3 G, MPa; if transversely isotropic, C_TT of waves across the axis."""
        if self.transverse is not None:
            return self._moduli[1]
        return self.bulk_modulus + 4.0 / 3.0 * self.shear_modulus

    @property
    def plastic_modulus(self) -> float:
        """Plastic modulus Eₚ = E E_t / (E − E_t), MPa."""
        return self.elastic_modulus * self.tangent_modulus / (self.elastic_modulus - self.tangent_modulus)

    def numbers(self, mass_scaling: float, viscosity: BulkViscosity) -> MaterialNumbers:
        """Return the constants of an isotropic material for the kernels; the density is times `mass_scaling`."""
        common = self._common(mass_scaling, viscosity)
        return MaterialNumbers(bulk=self.bulk_modulus, shear=self.shear_modulus, lame=self.lame_modulus, **common)

    def transverse_numbers(self, mass_scaling: float, viscosity: BulkViscosity) -> TransverseNumbers:
        """Return the constants of a transversely isotropic (or isotropic) material, as in `numbers`."""
        _, _, coupled, lame, across = self._moduli
        along = self._across.shear_modulus
        coupling = coupled - lame
        return TransverseNumbers(
            *self._hill,
            *self._bound,
            **self._common(mass_scaling, viscosity),
            lame=lame,
            twice_shear=2.0 * across,
            coupling=coupling,
            shear_gap=2.0 * (along - across),
            axial=self._moduli[0] - lame - 2.0 * coupling - 4.0 * along + 2.0 * across,
        )

    def _common(self, mass_scaling: float, viscosity: BulkViscosity) -> dict[str, Any]:
        density = mass_scaling * self.density
        return {
            "yield_stress": min(self.yield_stress, _NEVER),
            "plastic_modulus": self.plastic_modulus,
            "beta": float(self.hardening_parameter),
            "rate_c": float(self.strain_rate_c),
            "rate_exponent": _RATE_EXPONENTS[self.rate_law](float(self.strain_rate_p)),
            "rate_filter": self.rate_filter,
            "density": density,
            "sound_speed": sqrt(self.p_wave_modulus / density),
            "viscosity_linear": viscosity.linear,
            "viscosity_quadratic": viscosity.quadratic,
        }

    @property
    def _across(self) -> Transverse:
        """Properties across the axis; for an isotropic material, its isotropic properties."""
        if self.transverse is not None:
            return self.transverse
        return Transverse(
            self.elastic_modulus, self.shear_modulus, self.poisson_ratio, self.yield_stress, self.yield_stress / 3**0.5
        )

    @property
    def _moduli(self) -> tuple[float, float, float, float, float]:
        """Stiffnesses C_LL, C_TT, C_LT, C_TT′, μ_T = (C_TT − C_TT′)/2, MPa (Lekhnitskii, Theory of Elasticity)."""
        across, nu = self._across, self.poisson_ratio
        E, nu_t = across.elastic_modulus, across.poisson_ratio
        squared = nu * nu * E / self.elastic_modulus
        stiffening = 1.0 - nu_t - 2.0 * squared
        mu = E / (2.0 * (1.0 + nu_t))
        along = self.elastic_modulus * (1.0 - nu_t) / stiffening
        other = 2.0 * mu * (nu_t + squared) / stiffening
        return along, other + 2.0 * mu, nu * E / stiffening, other, mu

    @property
    def _hill(self) -> tuple[float, float, float]:
        """Coefficients h₁, h₂, h₃ of Hill's equivalent stress q (see `kernels.fibres`) from the yield stresses.

        q² is (⅔ h₁ + (h₂ + h₃)/9) σ² in tension across the axis, (2h₁ + h₂) τ² in axial shear, and
        (⅔ h₁ + 4/9 (h₂ + h₃)) σ² = σ² in axial tension; at yield, q is the axial yield stress in each case.
        """
        across, along = self._across, min(self.yield_stress, _NEVER)
        if along == _NEVER:
            return 1.5, 0.0, 0.0
        ratio, shear_ratio = along / across.yield_stress, along / across.shear_yield_stress
        hill_1 = 2.0 * ratio**2 - 0.5
        hill_2 = shear_ratio**2 - 2.0 * hill_1
        return hill_1, hill_2, 3.0 * (1.0 - ratio**2) - hill_2

    @property
    def _bound(self) -> tuple[float, float, float]:
        """λ, μ and κ of a law C:e = λ tr e I + 2μ e + κ e_a aa that is at least as stiff as this one, MPa.

        Shear requires μ ≥ μ_L and μ ≥ μ_T. For normal strains (e_a, e, e) the difference d of the two laws must be
        positive semidefinite: d_ap² ≤ d_aa d_pp with d_ap = √2 (λ − C_LT) and d_pp = 2 (λ − λ₀). The smallest bound
        has λ = C_LT, or λ = 2λ₀ − C_LT if C_LT is less than λ₀.
        """
        along, _, coupled, other, across = self._moduli
        mu = max(across, self._across.shear_modulus)
        least = other + across - mu
        lame = max(coupled, 2.0 * least - coupled)
        more = 4.0 * max(least - coupled, 0.0)
        return lame, mu, max(along - lame - 2.0 * mu + more, 0.0)


@dataclass(frozen=True)
class Layers:
    """Several materials in one body; `of` has the index of each element's material (E,)."""

    materials: tuple[Material, ...]
    of: NDArray[np.int_]

    def each(self, values: Any) -> Any:
        """Return one value per element (E, …) from one value per material."""
        return np.array(list(values), dtype=float)[self.of]


@dataclass(frozen=True)
class BulkViscosity:
    """Bulk viscosity, which spreads shocks over elements: q = ρ l (quadratic l ε̇² + linear c |ε̇|) in compression."""

    linear: float = 0.06
    quadratic: float = 1.5
