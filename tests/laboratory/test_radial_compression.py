"""A ring between plates against curved-beam theory with Hertz's dents, and its plastic collapse."""

from __future__ import annotations

from math import log, pi, sqrt

import numpy as np
import pytest
from pieces import E, material, piece

from stemcal.fem.material import Material
from stemcal.laboratory import LaboratoryTest, RadialCompression, perform


def ring(ratio: float, of: Material, travel: float, length: float = 0.6, **how: object) -> LaboratoryTest:
    mesh = {"through_wall": 8, "coarsening_around": 4.0, **how}
    return piece(RadialCompression(), of, length, travel, 0.13, ratio, **mesh)


def curved_beam(ratio: float) -> tuple[float, float]:
    """Return thin and thick compliance δE·b/F of a ring of 8 mm under opposite forces.

    Thin: (π/4 − 2/π) R³b/I = 0.149 R³b/I. Thick: R²b/(A e) (π k₁/4 − 2 k₂²/π) with e = R − w/ln(a/b), k₁ = 1 − e/R
    + 2.4 (1 + ν) e/R, k₂ = 1 − e/R (Roark's Formulas for Stress and Strain, table 9.2, case 1), ν = 0.
    """
    outer, inner = 4.0, 4.0 * ratio
    wall, radius = outer - inner, 0.5 * (outer + inner)
    thin = (pi / 4.0 - 2.0 / pi) * radius**3 * 12.0 / wall**3
    e = radius - wall / log(outer / inner)
    k1, k2 = 1.0 - e / radius + 2.4 * e / radius, 1.0 - e / radius
    return thin, radius**2 / (wall * e) * (pi * k1 / 4.0 - 2.0 * k2**2 / pi)


def dents(ratio: float, force: float) -> float:
    """Return by how much a force per length, N/mm, flattens the wall at both plates, mm; ν = 0.

    Each is 2 F/(πE) ln(2d/a), down to half the wall d, with Hertz's half width a = √(4 F R/πE) (Johnson, Contact
    Mechanics, eq. 5.56).
    """
    wall, half_width = 4.0 * (1.0 - ratio), sqrt(4.0 * force * 4.0 / (pi * E))
    return 2.0 * 2.0 * force / (pi * E) * log(wall / half_width)


def test_thick_and_thin_beam_agree_where_thin() -> None:
    thin, thick = curved_beam(0.99)
    assert thick == pytest.approx(thin, rel=0.01)
    assert thin == pytest.approx(0.149 * 3.98**3 * 12.0 / 0.04**3, rel=0.002)


@pytest.mark.parametrize("ratio", [0.6, 0.7, *(pytest.param(r, marks=pytest.mark.slow) for r in (0.8, 0.85, 0.9))])
def test_the_elastic_ring(ratio: float) -> None:
    """Travel at a force within 2 % of curved beam and dents; the dents are 16 to 1 % of it."""
    result = perform(ring(ratio, material(nu=0.0), travel=0.05))
    force, travel = result.history.force_filtered, result.history.travel
    row = int(np.argmax(force > 0.6 * force.max()))
    f = force[row] / 0.6
    assert travel[row] == pytest.approx(f / E * curved_beam(ratio)[1] + dents(ratio, f), rel=0.02)
    assert result.energy_drift_percent < 0.1


@pytest.mark.slow
def test_plastic_collapse() -> None:
    """A thin ring, long against its wall, collapses at 8 Mp/D, Mp = 2/√3 σ w²/4 per length: in plane strain."""
    ratio, stress, length = 0.9, 2.0, 12.0
    result = perform(ring(ratio, material(stress, nu=0.0), travel=0.6, length=length))
    wall, diameter = 4.0 * (1.0 - ratio), 4.0 * (1.0 + ratio)
    collapse = 8.0 * (2.0 / sqrt(3.0)) * stress * wall**2 / 4.0 / diameter * length
    assert float(np.interp(0.5, result.history.travel, result.history.force_filtered)) == pytest.approx(
        collapse, rel=0.05
    )


def test_a_quarter_is_the_whole() -> None:
    quarter, whole = (
        perform(ring(0.41, material(15.0), 0.4, 4.0, through_wall=4, coarsening_around=6.0, symmetry=symmetry))
        for symmetry in ("quarter", "none")
    )
    assert quarter.responses.keys() == whole.responses.keys()
    for name, value in quarter.responses.items():
        assert whole.responses[name] == pytest.approx(value, rel=1e-3), name
