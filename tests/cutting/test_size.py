"""What is foretold of a mesh against the mesh that is built."""

import tracemalloc
from dataclasses import replace
from itertools import product
from math import inf

import numpy as np
import pytest

from stemcal.cutting.build import build, mesh_size, stem_mesh
from stemcal.cutting.parts import Discretisation, ShearTest, Stem
from stemcal.fem.material import Material
from stemcal.fem.state import start

MATERIAL = Material(1.1e-9, 1000.0, 0.3, 15.0, 0.5, 0.05, strain_rate_c=90.0, strain_rate_p=8.0, failure_strain=0.03)


MESHES = [*product(("none", "half"), ("elements", "nodes")), ("quarter", "nodes")]


@pytest.mark.parametrize("coarse", [1.0, 4.0])
@pytest.mark.parametrize(("symmetry", "edge_over"), MESHES)
def test_the_number_of_elements_and_the_smallest_are_those_of_the_mesh(
    symmetry: str, edge_over: str, coarse: float
) -> None:
    for size, through in (1.0, None), (0.45, 3), (0.7, None):
        how = Discretisation(size, through, symmetry, edge_over, coarsening=coarse, coarsening_around=coarse)
        mesh = stem_mesh(Stem(8.0, 0.41, 30.0), how)
        told = mesh_size(Stem(8.0, 0.41, 30.0), how)
        assert told.elements == len(mesh.hexes)
        assert told.smallest == pytest.approx(float(np.cbrt(mesh.volumes().min())), rel=0.05)


@pytest.mark.parametrize("symmetry", ["none", "half", "quarter"])
@pytest.mark.parametrize("divisor", [8.0, 16.0, 32.0])
def test_a_solid_stem_has_the_elements_that_are_told(symmetry: str, divisor: float) -> None:
    how = Discretisation(8.0 / divisor, None, symmetry, "nodes", coarsening=6.0, coarsening_around=2.0)
    mesh, told = stem_mesh(Stem(8.0, 0.0, 50.0), how), mesh_size(Stem(8.0, 0.0, 50.0), how)
    assert told.elements == len(mesh.hexes)
    assert told.smallest == pytest.approx(float(np.cbrt(mesh.volumes().min())), rel=0.25)


def test_the_memory_is_what_building_a_model_takes() -> None:
    how = Discretisation(0.3, coarsening=3.0, coarsening_around=3.0)
    test = replace(ShearTest(replace(MATERIAL, internal_length=1.8)), discretisation=how)
    start(build(test))  # what is loaded and compiled once is not the mesh's
    tracemalloc.start()
    start(build(test))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert mesh_size(test.stem, how).memory == pytest.approx(most, rel=0.2)


@pytest.mark.parametrize("size", [1e-4, 1e-150, 1e-320])
def test_countless_elements_are_told_at_once(size: float) -> None:
    assert mesh_size(Stem(8.0, 0.41, 1e9), Discretisation(size)).elements > 1e18
    assert mesh_size(Stem(1e300, 0.41, 1e300), Discretisation(1e-320)).memory == inf
