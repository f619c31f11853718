"""The picture of the cut stem: the right faces, deleted elements gone, the shape kept whole in a record."""

import json

import numpy as np
import pytest

from stemcal.cutting.end_state import Shape
from stemcal.cutting.parts import Discretisation, ShearTest, Stem
from stemcal.cutting.simulate import shear
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration
from stemcal.report.fracture import _faces, _section_faces, _side_faces, fracture


def box(counts: tuple[int, int, int] = (4, 2, 2), symmetry: str = "none") -> Shape:
    """A box of unit elements centred on y = 0, its plastic strain the number of the element."""
    mesh = brick(tuple(float(n) for n in counts), counts)
    nodes = mesh.nodes - [0.0, counts[1] / 2 if symmetry == "none" else 0.0, 0.0]
    count = len(mesh.hexes)
    return Shape(nodes, nodes, mesh.hexes, np.ones(count, bool), np.arange(count) / count, (), symmetry)


def test_surface_of_a_box() -> None:
    corners, owner = _faces(box().hexes, box().standing)
    assert len(corners) == 2 * (4 * 2 + 4 * 2 + 2 * 2)
    assert set(owner) == set(range(16))


def test_a_deleted_element_opens_its_neighbours() -> None:
    whole = box((3, 3, 3))
    standing = whole.standing.copy()
    standing[13] = False  # the middle one
    assert len(_faces(whole.hexes, standing)[0]) == 54 + 6
    assert 13 not in _faces(whole.hexes, standing)[1]


@pytest.mark.parametrize("symmetry", ["none", "half"])
def test_section_is_the_plane_of_symmetry(symmetry: str) -> None:
    polygons, strain = _section_faces(box(symmetry=symmetry))
    assert len(polygons) == len(strain) == 4 * 2
    across = polygons - np.roll(polygons, 1, axis=1)
    x, z = polygons[..., 0], polygons[..., 1]
    area = 0.5 * np.abs(np.sum(x * np.roll(z, -1, 1) - z * np.roll(x, -1, 1), axis=1))
    assert area.sum() == pytest.approx(8.0)
    assert np.abs(across).max() == pytest.approx(1.0)


def test_side_shows_the_near_side_only() -> None:
    polygons, _ = _side_faces(box())
    assert len(polygons) == 4 * 2


def test_shape_of_a_cut_stem_survives_packing() -> None:
    material = Material(1.1e-9, 1000.0, 0.3, 12.0, 0.5, 0.05, failure_strain=0.02)
    how = Discretisation(element_size=1.5, integration=Integration(mass_scaling=1e6, outputs=100))
    result = shear(ShearTest(material, Stem(8.0, 0.41, 30.0), discretisation=how))
    shape = result.shape
    assert shape is not None
    assert np.count_nonzero(~shape.standing) == result.history.deleted[-1] > 0
    travel = result.history.travel[-1]
    assert shape.tools[0][:, 1].min() == pytest.approx(4.0 - travel, abs=1e-6)
    again = Shape.unpacked(json.loads(json.dumps(shape.packed())))
    assert np.array_equal(again.standing, shape.standing)
    assert np.array_equal(again.hexes, shape.hexes)
    assert again.nodes == pytest.approx(shape.nodes, abs=1e-5)
    assert len(json.dumps(shape.packed())) < 60_000
    figure = fracture(again)
    drawn = figure.axes[0].collections[0].get_array()
    assert len(drawn) == len(_side_faces(again)[0]) > 50
    gone = set(np.flatnonzero(~shape.standing))
    assert not gone & set(_faces(again.hexes, again.standing)[1])
