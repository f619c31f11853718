"""Pieces of a stem of 8 mm and known materials for laboratory tests."""

from math import inf
from typing import Any

from stemcal.cutting.parts import Discretisation, Loading, Stem
from stemcal.fem.material import Material
from stemcal.fem.model import Integration
from stemcal.fem.tools import Contact
from stemcal.laboratory import Kind
from stemcal.laboratory.build import LaboratoryTest

E, RATIO = 1000.0, 0.41


def material(yield_stress: float = inf, tangent: float = 0.0, nu: float = 0.3, failure: float = inf) -> Material:
    """Return a material without rate dependence."""
    return Material(1.1e-9, E, nu, yield_stress, tangent, 1.0, failure_strain=failure)


def piece(
    kind: Kind, of: Material, length: float, travel: float, size: float, ratio: float = RATIO, **how: Any
) -> LaboratoryTest:
    """Return a test without friction that takes a second."""
    mesh = Discretisation(
        size, edge_over="nodes", hourglass=0.03, integration=Integration(outputs=400), filter_window=0.01, **how
    )
    return LaboratoryTest(kind, of, Stem(8.0, ratio, length), Loading(travel, 1.0, 0.0), Contact(), mesh)
