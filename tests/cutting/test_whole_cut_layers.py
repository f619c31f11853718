"""Whole cuts of stems with layers and with fibres: they part, conserve energy, and a stronger skin takes more of it."""

from dataclasses import replace
from functools import cache

import pytest
from test_whole_cut import cut

from stemcal.cutting.parts import ShearTest
from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import shear
from stemcal.fem import state
from stemcal.fem.kernels.march import STEP_LIFE
from stemcal.fem.material import Transverse
from stemcal.fem.warm import warm

FIBRES = Transverse(200.0, 100.0, 0.3, 8.0, 5.0)
SAME = Transverse(1000.0, 1000.0 / 2.6, 0.3, 20.0, 20.0 / 3.0**0.5)


def stem(kind: str) -> ShearTest:
    """Return a cut of a stem of 8 mm: hollow or solid, isotropic, with a skin, with fibres, or with a skin of them."""
    test = cut(diameter=8.0, speed=500.0)
    if "hollow" in kind:
        test = replace(test, stem=replace(test.stem, diameter_ratio=0.4))
    if "skin" in kind:
        skin = replace(test.material, elastic_modulus=2000.0, yield_stress=40.0)
        skin = replace(skin, transverse=FIBRES) if "fibrous" in kind else skin
        return replace(test, stem=replace(test.stem, layers=(0.6,)), outer=(skin,))
    law = {"fibres": FIBRES, "same": SAME}.get(kind.split()[-1])
    return replace(test, material=replace(test.material, transverse=law))


@cache
def result_of(kind: str) -> CuttingResult:
    warm(layered=True)
    return shear(stem(kind))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["solid skin", "hollow skin", "solid fibrous skin", "solid fibres", "hollow fibres"])
def test_energy_is_conserved(kind: str) -> None:
    """Severed within the stroke; balance within 0.5 % of the work, contact only takes, hourglass energy below 10 %."""
    result = result_of(kind)
    assert result.severed and result.stroke_was_enough and result.history.deleted[-1] == 0
    assert result.energy_drift_percent < 0.5
    assert result.contact_energy_percent >= 0.0
    assert result.hourglass_ratio_percent < 10.0


@pytest.mark.slow
def test_a_skin_takes_more_and_fibres_less_than_the_wood_alone() -> None:
    wood, skin, fibres = (result_of(f"solid {kind}").cutting_energy for kind in ("wood", "skin", "fibres"))
    assert wood is not None and skin is not None and fibres is not None
    assert skin > 1.1 * wood and fibres < 0.9 * wood


@pytest.mark.slow
def test_fibres_without_direction_are_the_isotropic_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the surface under the edge computed as often as for an isotropic stem."""
    monkeypatch.setattr(state, "SOFT_LIFE", STEP_LIFE)
    same, wood = result_of("solid same"), result_of("solid wood")
    assert same.peak_force == pytest.approx(wood.peak_force, rel=1e-3)
    assert same.cutting_energy == pytest.approx(wood.cutting_energy, rel=1e-3)
