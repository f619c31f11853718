"""The model as shipped: a spread edge and an internal length, elements of d/12."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from stemcal.cutting.parts import Blade, Discretisation, Loading, ShearTest
from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import shear
from stemcal.fem.material import Material
from stemcal.fem.model import Integration

MATERIAL = Material(1.1e-9, 1000.0, 0.3, 15.0, 0.5, 0.05, 90.0, 8.0, 0.03, "paper", internal_length=8.0 / 4.5)


def cut_of(material: Material = MATERIAL, mass_scaling: float = 1.0e4, duration: float = 0.5, **mesh: Any) -> ShearTest:
    """Return a test of an 8 mm stem; its time step is 53 µs with mass scaling 1e4 and goes with its root."""
    step = 53.0e-6 * (mass_scaling / 1.0e4) ** 0.5
    how = Discretisation(
        element_size=8.0 / 12.0,
        edge_over="nodes",
        coarsening=6.0,
        coarsening_around=2.0,
        integration=Integration(mass_scaling, outputs=500, time_step=step, precision="mixed"),
    )
    return ShearTest(
        material, blade=Blade(edge_spread=1.0), loading=Loading(duration=duration), discretisation=replace(how, **mesh)
    )


@cache
def centre() -> CuttingResult:
    return shear(cut_of())


def test_hard_and_soft_stems_shake_nothing_loose() -> None:
    """With yield stress 60 MPa the edge presses elements to several hundred MPa.

    Without the resistance that grows with the stress they shake: kinetic energy is 20 to 35 % of internal energy then,
    the force a third lower, and contact creates up to the whole work of the blade.
    """
    result = shear(cut_of(replace(MATERIAL, yield_stress=60.0), duration=1.0))
    assert result.contact_energy_percent > 0.0
    assert result.kinetic_ratio_percent < 1.0
    assert result.hourglass_ratio_percent < 5.0
    assert result.energy_drift_percent < 1.0


def test_what_contact_holds_is_told_apart() -> None:
    """Edge, flanks, supports and friction add up; friction and the supports' damping only take, up to the break."""
    curve = centre().history
    parts = (curve.contact_edge, curve.contact_flanks, curve.contact_supports, curve.contact_friction)
    np.testing.assert_allclose(sum(parts), curve.contact, rtol=0.0, atol=1e-12 * curve.external.max())
    assert all(part.min() > -1e-3 * curve.external.max() for part in parts)
    assert centre().contact_energy_percent > 0.0


def test_vibration_is_no_rate() -> None:
    """Cowper and Symonds' law gives one force with mass scaling 1e4 and 1e3; rates of single steps gave 205 and 183."""
    law = replace(MATERIAL, rate_law="cowper_symonds", rate_filter=0.048)
    forces = [shear(cut_of(law, scale)).peak_force for scale in (1.0e4, 1.0e3)]
    assert forces[0] == pytest.approx(forces[1], rel=0.005)
    assert forces[0] > 1.3 * centre().peak_force


@pytest.mark.slow
def test_fine_meshes_break_as_coarse_ones_do() -> None:
    """A soft stem, elements of d/12 and d/32: it breaks within 10 µm of travel of its first failure.

    Were strains of failed elements left out of the mean, it would bear on for 130 µm and more with d/32.
    """
    soft = replace(MATERIAL, elastic_modulus=1500.0, poisson_ratio=0.25, yield_stress=12.0, failure_strain=0.045)
    how = cut_of().discretisation.integration
    fine = {"element_size": 8.0 / 32.0, "integration": replace(how, time_step=20.0e-6)}
    peaks = []
    for mesh in ({}, fine):
        result = shear(cut_of(soft, **mesh))
        failed = result.history.travel[int(np.argmax(result.history.deleted > 0))]
        assert result.break_travel is not None
        assert result.break_travel - failed < 0.01
        peaks.append(result.peak_force)
    assert peaks[1] == pytest.approx(peaks[0], rel=0.1)


@pytest.mark.parametrize("symmetry", ["half", pytest.param("none", marks=pytest.mark.slow)])
def test_mirror_planes_leave_out_images_only(symmetry: Any) -> None:
    """The whole curve until the first element fails, to 1e-4 of its peak."""
    whole, part = shear(cut_of(symmetry=symmetry, stop_after_peak=True)), centre()
    until = int(np.argmax(part.history.deleted > 0)) or len(part.history.time)
    off = np.abs(whole.history.force[:until] - part.history.force[:until]).max() / part.peak_force
    assert off < 1e-4
    assert whole.peak_force == pytest.approx(part.peak_force, rel=1e-4)
