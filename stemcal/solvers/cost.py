"""The cost of a run: its computing time on one core, estimated from its mesh before anything is computed."""

from dataclasses import replace
from functools import lru_cache
from math import inf

import numpy as np

from stemcal import cutting
from stemcal.fem.material import Material
from stemcal.laboratory.build import LaboratoryTest, integration
from stemcal.solvers.laboratory_runs import AnyTest

# What a step takes on one core of a small machine, s, and an element in it; and the travel, of the diameter, at which a
# stem usually is broken. For estimates only.
_STEP, _ELEMENT, _UNTIL_BROKEN = 60.0e-6, 0.14e-6, 0.09
# How long a run is tried to see how fast this machine is, s, and with how many elements at most.
TRIED_S, _TRIED_ELEMENTS = 0.5, 20_000


def seconds(test: AnyTest) -> float:
    """Return the steps that the smallest element asks for, times what a step usually takes; inf if countless."""
    if isinstance(test, LaboratoryTest):
        return _laboratory_seconds(test)
    how, material = test.discretisation, test.material
    size = cutting.mesh_size(test.stem, how)
    speed = (material.p_wave_modulus / (how.integration.mass_scaling * material.density)) ** 0.5
    step = max(how.integration.safety * size.smallest / speed, how.integration.time_step or 0.0)
    return test.loading.duration / step * share(test) * (_STEP + _ELEMENT * size.elements) if step > 0.0 else inf


def share(test: cutting.ShearTest) -> float:
    """Return the share of the stroke that a run usually takes."""
    stroke, broken = test.loading.speed * test.loading.duration, _UNTIL_BROKEN * test.stem.outer_diameter
    return min(1.0, broken / stroke) if test.discretisation.stop_after_peak else 1.0


def small_enough(test: cutting.ShearTest) -> cutting.ShearTest | None:
    """Return the test with elements so large that it is built in a moment; None if no size makes it so."""
    how = test.discretisation
    excess = cutting.mesh_size(test.stem, how).elements / _TRIED_ELEMENTS
    if excess <= 1.0:
        return test
    coarse = replace(how, element_size=how.element_size * excess ** (1.0 / 3.0))
    is_small = cutting.mesh_size(test.stem, coarse).elements < 3 * _TRIED_ELEMENTS
    return replace(test, discretisation=coarse) if is_small else None


def _laboratory_seconds(test: LaboratoryTest) -> float:
    """Return the same of a laboratory test."""
    elements, smallest = _mesh_size(replace(test, material=_ANY))  # the same at all levels
    how, material = integration(test), test.material
    speed = (material.p_wave_modulus / (how.mass_scaling * material.density)) ** 0.5
    steps = test.loading.duration * speed / (how.safety * smallest)
    return float(steps * (_STEP + _ELEMENT * elements))


_ANY = Material(density=1.0e-9, elastic_modulus=1000.0, poisson_ratio=0.3)


@lru_cache(maxsize=64)
def _mesh_size(test: LaboratoryTest) -> tuple[int, float]:
    """Return how many elements a test's mesh has, and the edge of a cube as large as the smallest."""
    volumes = test.kind.mesh(test.stem, test.discretisation).volumes()
    return len(volumes), float(np.cbrt(volumes.min()))
