"""The stem cut through by toughness, on coarse meshes; `benchmarks/toughness.py` has the finer ones."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import pi
from pathlib import Path

import numpy as np
import pytest

from stemcal.cutting import CuttingResult, ShearTest, shear
from stemcal.solvers.embedded import shear_test
from stemcal.study.reading import load_study

SPEC = Path(__file__).resolve().parent.parent / "cases" / "good" / "toughness.yaml"
# The section of the mesh: polygons of d/8 have 97.1 % of the round one.
SECTION = 0.971 * 0.25 * pi * 8.0**2 * (1.0 - 0.41**2)


def toughness_test(**changes: object) -> ShearTest:
    """Return the test of the spec at mid-level, 8 mm: toughness 2 kJ/m², strength 15 MPa."""
    study = load_study(SPEC)
    return replace(shear_test(study, study.midlevels(), 8.0), **changes)


@cache
def cut(toughness: float = 2.0, angle: float = 37.5, radius: float = 0.1) -> CuttingResult:
    """Return the whole cut with one thing changed."""
    test = toughness_test()
    assert test.failure is not None
    blade = replace(test.blade, edge_angle=angle, edge_radius=radius)
    loading = replace(test.loading, duration=0.95)  # blunt edges part the stem late
    return shear(replace(test, blade=blade, loading=loading, failure=replace(test.failure, toughness=toughness)))


def test_the_stem_is_cut_through_and_the_energy_is_accounted_for() -> None:
    """Cohesion and edge take toughness times area together."""
    result = cut()
    assert result.cut_area_percent == pytest.approx(100.0, abs=0.2)
    assert result.stroke_end == "broken" and result.deleted_elements == 0
    assert result.energy_drift_percent < 0.5
    history = result.history
    parting = history.cohesion[-1] + history.contact_edge[-1]
    assert parting == pytest.approx(2.0 * SECTION, rel=0.05)
    assert result.work_of_cutting == pytest.approx(history.external[-1], rel=0.01)
    assert np.trapezoid(history.force, history.travel) == pytest.approx(history.external[-1], rel=0.02)


def test_the_share_that_is_parted_never_falls() -> None:
    assert np.all(np.diff(cut().history.parted) >= 0.0)


@pytest.mark.slow
def test_twice_the_toughness_is_found_again_in_the_work_that_parts() -> None:
    once, twice = (r.history.cohesion[-1] + r.history.contact_edge[-1] for r in (cut(), cut(toughness=4.0)))
    assert twice - once == pytest.approx(2.0 * SECTION, rel=0.03)


@pytest.mark.slow
def test_force_rises_with_angle_and_radius() -> None:
    """The mean over the first 2.5 mm, before bending has a say."""

    def mean(result: CuttingResult) -> float:
        history = result.history
        return float(history.force[(history.travel > 0.0) & (history.travel < 2.5)].mean())

    sharp, shipped, blunt = mean(cut(angle=20.0)), mean(cut()), mean(cut(angle=60.0))
    assert sharp < 0.95 * shipped and shipped < 0.95 * blunt
    keen, dull = mean(cut(radius=0.02)), mean(cut(radius=0.5))
    assert keen < 0.95 * shipped and shipped < 0.9 * dull


def test_a_blunt_edge_parts_the_stem_and_does_not_crush_its_way_down() -> None:
    """Its rounding asks for 15 N/mm beside the 2 N/mm of toughness, and bears over half an element."""
    blunt = cut(radius=0.5)
    assert blunt.cut_area_percent == pytest.approx(100.0, abs=0.2)
    parting = blunt.history.cohesion[-1] + blunt.history.contact_edge[-1]
    assert parting == pytest.approx(2.0 * SECTION, rel=0.05)


def test_only_a_quarter_model_over_nodes_opens() -> None:
    test = toughness_test()
    for change in ({"symmetry": "half"}, {"edge_over": "elements"}):
        with pytest.raises(ValueError, match="quarter model with its edge over nodes"):
            shear(replace(test, discretisation=replace(test.discretisation, **change)))
