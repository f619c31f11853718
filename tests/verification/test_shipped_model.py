"""Mirror planes, momentum and energy of the model as shipped (spread edge, failure in the mean, graded mesh)."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from stemcal.cutting.build import build
from stemcal.cutting.parts import Blade, Discretisation, Loading, ShearTest, Stem, Supports
from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import shear
from stemcal.fem.material import Material
from stemcal.fem.model import Integration
from stemcal.fem.state import State
from stemcal.fem.stepper import simulate

MATERIAL = Material(1.1e-9, 1000.0, 0.3, 15.0, 0.5, 0.05, 90.0, 8.0, 0.03, "paper", internal_length=8.0 / 4.5)
SHIPPED = ShearTest(
    MATERIAL,
    blade=Blade(edge_spread=8.0 / 9.5),
    loading=Loading(duration=1.2),
    discretisation=Discretisation(
        element_size=8.0 / 12.0,
        edge_over="nodes",
        coarsening=6.0,
        coarsening_around=2.0,
        hourglass=0.01,
        integration=Integration(1.0e4, outputs=600, time_step=53.0e-6),
    ),
)


def changed(blade: Any = None, material: Any = None, **parts: Any) -> ShearTest:
    """Return the shipped test with changes of its blade, its material and whole parts."""
    return replace(
        SHIPPED,
        blade=replace(SHIPPED.blade, **(blade or {})),
        material=replace(SHIPPED.material, **(material or {})),
        **parts,
    )


ODD = {
    "hard": changed(material={"yield_stress": 60.0}),
    "soft, brittle": changed(material={"yield_stress": 5.0, "elastic_modulus": 400.0, "failure_strain": 0.01}),
    "blunt blade": changed(blade={"edge_angle": 60.0, "edge_radius": 0.5}),
    "thick wall, close supports": changed(stem=Stem(8.0, 0.2, 30.0), supports=Supports(clearance=5.0)),
    "thin wall, rate law, isotropic": changed(
        stem=Stem(8.0, 0.6, 60.0),
        material={"rate_law": "cowper_symonds", "rate_filter": 0.048, "hardening_parameter": 1.0},
    ),
}


@cache
def run(name: str, symmetry: Any, precision: Any = "double") -> CuttingResult:
    how = ODD[name].discretisation
    integration = replace(how.integration, precision=precision)
    return shear(replace(ODD[name], discretisation=replace(how, symmetry=symmetry, integration=integration)))


def apart(whole: CuttingResult, part: CuttingResult) -> float:
    """Return the largest difference of two filtered curves up to the peak, of the peak; so the peaks count too."""
    until = int(np.argmax(part.history.force_filtered)) + 1
    off = np.abs(whole.history.force_filtered[:until] - part.history.force_filtered[:until])
    return float(max(off.max(), abs(whole.peak_force - part.peak_force)) / part.peak_force)


@pytest.mark.slow
@pytest.mark.parametrize("symmetry", ["half", "none"])
@pytest.mark.parametrize("name", ODD)
def test_a_mirror_plane_leaves_out_an_image_only(name: str, symmetry: Any) -> None:
    """Quarter, half and full model give one curve and fail in the same step.

    Most agree to 1e-12; where rows of the edge stick and slip, one sweep more or less leaves 1e-5.
    """
    for precision in ("double", "mixed"):
        whole, part = run(name, symmetry, precision), run(name, "quarter", precision)
        assert part.history.deleted[-1] > 0
        assert apart(whole, part) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", ODD)
def test_energy_is_kept_and_contact_only_takes(name: str) -> None:
    """Over the whole run, the failure of the first elements in it."""
    result = run(name, "none")
    assert result.energy_drift_percent < 1.0
    assert result.contact_energy_percent > 0.0


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if i else ()) for i, name in enumerate(ODD)]
)
def test_the_impulse_of_the_tools_is_the_momentum_of_the_stem(name: str) -> None:
    """Σ m v = −∫ Σ F dt over blade and supports, in all three directions: contact acts on both sides alike."""
    test = replace(ODD[name], discretisation=replace(ODD[name].discretisation, symmetry="none"))
    momenta: list[NDArray[np.float64]] = []

    def inspect(_: float, state: State) -> None:
        body = state.body
        momenta.append((body.mass[:, None] * body.v[: len(body.mass)]).sum(axis=0))

    history = simulate(build(test), 0.3, inspect=inspect)
    stands = history.deleted == 0  # nodes that lose their last element stop
    impulse = np.cumsum(history.force.sum(axis=1) * np.diff(history.time, prepend=0.0)[:, None], axis=0)
    scale = np.abs(impulse).max()
    assert stands.sum() > 50
    np.testing.assert_allclose(np.array(momenta)[stands], -impulse[stands], rtol=0.0, atol=1e-6 * scale)
