"""Estimate the computing time of a test on one core from its mesh, before the simulation."""

from dataclasses import replace
from functools import lru_cache
from math import inf

import numpy as np

from stemcal.cutting.build import mesh_size
from stemcal.cutting.parts import ShearTest
from stemcal.fem.material import Material
from stemcal.laboratory.build import LaboratoryTest, integration
from stemcal.solvers.laboratory_runs import AnyTest

# Computing time of one time step, and of one element in a step, on one core of a small machine, s.
_STEP, _ELEMENT = 10.0e-6, 0.055e-6
# Usual travel in stem diameters: until a stem fractures, and until it is cut through (between two supports, and next
# to a clamp, where the blade flattens the stem first).
_UNTIL_BROKEN, _UNTIL_SEVERED = 0.09, (0.6, 1.2)
_FLAT = 0.5  # stable time step of the smallest element, which is flat, over that of a cube with the same volume


def seconds(test: AnyTest) -> float:
    """Return the computing time (s). The smallest element sets the number of time steps; inf if a step is 0 s."""
    steps, elements = _laboratory_steps(test) if isinstance(test, LaboratoryTest) else _cutting_steps(test)
    return float(steps * (_STEP + _ELEMENT * elements))


def _cutting_steps(test: ShearTest) -> tuple[float, float]:
    how, material = test.discretisation, test.material
    size = mesh_size(test.stem, how)
    speed = (material.p_wave_modulus / (how.integration.mass_scaling * material.density)) ** 0.5
    step = max(how.integration.safety * _FLAT * size.smallest / speed, how.integration.time_step or 0.0)
    if step <= 0.0:
        return inf, size.elements
    until = _UNTIL_SEVERED[test.supports.kind != "span"] if test.parts else _UNTIL_BROKEN
    stroke, broken = test.loading.speed * test.loading.duration, until * test.stem.outer_diameter
    share = min(1.0, broken / stroke) if how.stop_after_peak else 1.0
    return test.loading.duration / step * share, size.elements


def _laboratory_steps(test: LaboratoryTest) -> tuple[float, float]:
    elements, smallest = _mesh_size(replace(test, material=_ANY))  # one material, so that the cache serves all
    how, material = integration(test), test.material
    speed = (material.p_wave_modulus / (how.mass_scaling * material.density)) ** 0.5
    return test.loading.duration * speed / (how.safety * smallest), elements


_ANY = Material(density=1.0e-9, elastic_modulus=1000.0, poisson_ratio=0.3)


@lru_cache(maxsize=64)
def _mesh_size(test: LaboratoryTest) -> tuple[int, float]:
    volumes = test.kind.mesh(test.stem, test.discretisation).volumes()
    return len(volumes), float(np.cbrt(volumes.min()))
