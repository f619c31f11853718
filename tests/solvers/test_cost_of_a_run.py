"""The estimated computing time of a test, computed again from its mesh, its wave speed and its stroke."""

from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stemcal.cutting.build import mesh_size
from stemcal.cutting.parts import ShearTest
from stemcal.laboratory.build import integration
from stemcal.solvers.cost import seconds
from stemcal.solvers.embedded import Embedded, meshed_as, shear_test
from stemcal.solvers.laboratory_runs import laboratory_test
from stemcal.solvers.protocol import Request
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
STUDY = load_study(CONFIGS / "three-tests.yaml")
CUT = shear_test(STUDY, STUDY.midlevels(), 8.0)


def per_step(elements: float) -> float:
    """10 µs a step and 0.055 µs for each element in it."""
    return 10.0e-6 + 0.055e-6 * elements


def changed(test: ShearTest, loading: dict[str, Any] | None = None, **integration: Any) -> ShearTest:
    """Return a test with other loading and integration settings."""
    how = test.discretisation
    how = replace(how, integration=replace(how.integration, **integration))
    return replace(test, loading=replace(test.loading, **(loading or {})), discretisation=how)


def stable_step(test: ShearTest) -> float:
    """0.9 times half the size of the smallest element over the speed of sound with scaled masses, s."""
    how, law = test.discretisation, test.material
    elastic = law.elastic_modulus * (1.0 - law.poisson_ratio) / (1.0 + law.poisson_ratio)
    wave_modulus = elastic / (1.0 - 2.0 * law.poisson_ratio)
    speed = (wave_modulus / (how.integration.mass_scaling * law.density)) ** 0.5
    return 0.9 * 0.5 * mesh_size(test.stem, how).smallest / speed


@pytest.mark.parametrize("time_step", [None, 1.0, 1e-12])
def test_steps_of_a_cut_are_those_until_it_fractures(time_step: float | None) -> None:
    """A stem between two supports fractures at 0.09 of its diameter: 0.72 of the stroke of 1 mm."""
    test = changed(CUT, {"speed": 2.0, "duration": 0.5}, time_step=time_step, mass_scaling=4.0)
    step = max(stable_step(test), time_step or 0.0)
    elements = mesh_size(test.stem, test.discretisation).elements
    assert seconds(test) == pytest.approx(0.72 * 0.5 / step * per_step(elements), rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "until", "share"),
    [
        ("span", "first_fracture", 0.09 * 8.0 / 20.0),
        ("span", "severed", 0.6 * 8.0 / 20.0),
        ("clamped", "severed", 1.2 * 8.0 / 20.0),
    ],
)
def test_a_whole_cut_takes_longer_and_next_to_a_clamp_longest(kind: Any, until: Any, share: float) -> None:
    """Stems are cut through at 0.6 of the diameter, next to a clamp at 1.2; the stroke is 20 mm."""
    test = changed(CUT, {"speed": 10.0, "duration": 2.0, "until": until})
    test = replace(test, supports=replace(test.supports, kind=kind))
    size = mesh_size(test.stem, test.discretisation)
    step = max(stable_step(test), test.discretisation.integration.time_step or 0.0)
    assert seconds(test) == pytest.approx(share * 2.0 / step * per_step(size.elements), rel=1e-9)


def test_a_short_stroke_and_a_test_without_an_early_end_last_their_whole_duration() -> None:
    short = changed(CUT, {"speed": 1.0, "duration": 0.5})
    going_on = changed(CUT, {"speed": 10.0, "duration": 0.5})
    going_on = replace(going_on, discretisation=replace(going_on.discretisation, stop_after_peak=False))
    assert seconds(short) == pytest.approx(seconds(going_on), rel=1e-12)


def test_a_step_of_zero_takes_for_ever() -> None:
    assert seconds(changed(CUT, time_step=None, safety=0.0)) == inf
    assert seconds(changed(CUT, time_step=1e-3, safety=0.0)) < inf


def test_steps_of_a_laboratory_test_are_those_of_its_smallest_element() -> None:
    bending = laboratory_test(STUDY.tests[0], CUT)
    volumes = bending.kind.mesh(bending.stem, bending.discretisation).volumes()
    law, how = bending.material, integration(bending)
    assert how.mass_scaling > 1.0
    speed = (law.p_wave_modulus / (how.mass_scaling * law.density)) ** 0.5
    step = 0.9 * float(np.cbrt(volumes.min())) / speed
    assert seconds(bending) == pytest.approx(bending.loading.duration / step * per_step(len(volumes)), rel=1e-9)


def test_memory_is_that_of_a_process_and_of_the_largest_mesh() -> None:
    """250 MB without a mesh; a further cut of the same stem adds nothing."""
    memory = Embedded(STUDY).memory_estimate(Request("rsm", 0, STUDY.midlevels(), 8.0))
    assert memory == 250.0e6 + mesh_size(CUT.stem, CUT.discretisation).memory


def test_another_element_size_takes_time_step_and_elements_through_the_wall_with_it() -> None:
    """From 8/16 mm to 1.2 mm: a step of 4e-5 s · 2.4, and 5/2.4 = 2.08 elements, but never fewer than one."""
    study = load_study(CONFIGS / "smoke.yaml", solver={"element_size": "d/16", "elements_through_wall": 5})
    options = meshed_as(study, 1.2).solver
    assert (options.element_size.at(8.0), options.elements_through_wall) == (1.2, 2)
    assert options.time_step == pytest.approx(study.solver.time_step * 2.4, rel=1e-12)
    assert meshed_as(study, 12.0).solver.elements_through_wall == 1
    bare = load_study(CONFIGS / "smoke.yaml", solver={"time_step": None})
    assert (meshed_as(bare, 1.2).solver.time_step, meshed_as(bare, 1.2).solver.elements_through_wall) == (None, None)
