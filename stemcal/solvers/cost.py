"""The cost of a run: its computing time on one core, estimated from its mesh before anything is computed."""

from dataclasses import replace
from functools import lru_cache
from math import inf

import numpy as np

from stemcal.cutting.build import mesh_size
from stemcal.cutting.parts import ShearTest
from stemcal.fem.material import Material
from stemcal.laboratory.build import LaboratoryTest, integration
from stemcal.solvers.laboratory_runs import AnyTest

# What a step takes on one core of a small machine, s, and an element in it; and the travel, of the diameter, at which a
# stem usually is broken, and cut through. For estimates only.
_STEP, _ELEMENT, _UNTIL_BROKEN, _UNTIL_SEVERED = 60.0e-6, 0.14e-6, 0.09, 0.5


def seconds(test: AnyTest) -> float:
    """Return the steps that the smallest element asks for, times what a step usually takes; inf if countless."""
    steps, elements = _laboratory_steps(test) if isinstance(test, LaboratoryTest) else _cutting_steps(test)
    return float(steps * (_STEP + _ELEMENT * elements))


def _cutting_steps(test: ShearTest) -> tuple[float, float]:
    """Return the steps of a cut until the stem usually is broken, and its elements."""
    how, material = test.discretisation, test.material
    size = mesh_size(test.stem, how)
    speed = (material.p_wave_modulus / (how.integration.mass_scaling * material.density)) ** 0.5
    step = max(how.integration.safety * size.smallest / speed, how.integration.time_step or 0.0)
    if step <= 0.0:
        return inf, size.elements
    until = _UNTIL_SEVERED if test.parts else _UNTIL_BROKEN
    stroke, broken = test.loading.speed * test.loading.duration, until * test.stem.outer_diameter
    share = min(1.0, broken / stroke) if how.stop_after_peak else 1.0
    return test.loading.duration / step * share, size.elements


def _laboratory_steps(test: LaboratoryTest) -> tuple[float, float]:
    """Return the steps of a laboratory test, and its elements."""
    elements, smallest = _mesh_size(replace(test, material=_ANY))  # the same at all levels
    how, material = integration(test), test.material
    speed = (material.p_wave_modulus / (how.mass_scaling * material.density)) ** 0.5
    return test.loading.duration * speed / (how.safety * smallest), elements


_ANY = Material(density=1.0e-9, elastic_modulus=1000.0, poisson_ratio=0.3)


@lru_cache(maxsize=64)
def _mesh_size(test: LaboratoryTest) -> tuple[int, float]:
    """Return the number of elements of a test's mesh, and the edge of a cube as large as the smallest."""
    volumes = test.kind.mesh(test.stem, test.discretisation).volumes()
    return len(volumes), float(np.cbrt(volumes.min()))
