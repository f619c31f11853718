"""Meshes: counts, volumes, neighbours and the lists that contact lives on."""

from math import pi, sin

import numpy as np
import pytest
from called import called

from stemcal.fem.kernels import erosion
from stemcal.fem.kernels.block import ALIVE
from stemcal.fem.kernels.search import FACES
from stemcal.fem.material import BulkViscosity, Material
from stemcal.fem.mesh import brick, hollow_cylinder, solid_cylinder, square_of_solid
from stemcal.fem.model import Model
from stemcal.fem.state import start


def test_brick_fills_its_box() -> None:
    mesh = brick((2.0, 3.0, 5.0), (2, 4, 3))
    assert (len(mesh.nodes), len(mesh.hexes)) == (3 * 5 * 4, 24)
    np.testing.assert_allclose(mesh.volumes(), 30.0 / 24.0)
    np.testing.assert_allclose(mesh.nodes.max(axis=0), [2.0, 3.0, 5.0])


def test_neighbours_of_a_brick() -> None:
    """Six neighbours in the middle of 3×3×3, each of which knows it back; 54 faces outside."""
    mesh = brick((3.0, 3.0, 3.0), (3, 3, 3))
    neighbours = mesh.neighbours()
    assert np.all(neighbours[13] >= 0)
    assert np.sum(neighbours < 0) == 54
    for e, row in enumerate(neighbours):
        for face, other in enumerate(row):
            if other >= 0:
                shared = set(mesh.hexes[e, FACES[face]])
                assert shared == set(mesh.hexes[e]) & set(mesh.hexes[other])
                assert e in neighbours[other]


def test_faces_point_outwards() -> None:
    """(b − a) × (c − b) of each face points away from the element's middle: counter-clockwise seen from outside."""
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    middle = mesh.nodes.mean(axis=0)
    for face in FACES:
        a, b, c, _ = mesh.nodes[mesh.hexes[0, face]]
        assert np.cross(b - a, c - b) @ (a - middle) > 0.4


@pytest.mark.parametrize(("around", "through"), [(4, 1), (24, 3), (25, 2)])
def test_hollow_cylinder_closes(around: int, through: int) -> None:
    """Volume of a ring of regular polygons, ½ n (R² − r²) sin(2π/n) L; no face open around the turn."""
    mesh = hollow_cylinder(1.64, 4.0, np.linspace(0.0, 10.0, 6), (around, through))
    area = 0.5 * around * (4.0**2 - 1.64**2) * sin(2.0 * pi / around)
    assert mesh.volumes().min() > 0.0
    assert mesh.volumes().sum() == pytest.approx(area * 10.0, rel=1e-12)
    assert np.sum(mesh.neighbours() < 0) == 2 * around * 5 + 2 * around * through
    assert len(mesh.nodes) == 6 * around * (through + 1)


def test_half_cylinder_has_nodes_on_its_mirror_plane() -> None:
    mesh = hollow_cylinder(1.0, 2.0, np.linspace(0.0, 4.0, 5), (8, 2), (-pi / 2, pi / 2))
    assert np.sum(mesh.nodes[:, 1] == 0.0) == 5 * 2 * 3
    assert mesh.nodes[:, 1].min() == 0.0
    assert mesh.volumes().sum() == pytest.approx(0.5 * 0.5 * 16 * 3.0 * sin(2 * pi / 16) * 4.0)


@pytest.mark.parametrize(("around", "through"), [(4, 1), (17, 4), (34, 8)])
def test_a_solid_cylinder_has_no_axis_of_its_own(around: int, through: int) -> None:
    """Half and whole: the polygon's area, every face shared but those outside, none thinner than a third of another."""
    widths = np.linspace(2.0, 1.0, around)
    turns = pi * widths / widths.sum()
    area = 0.5 * 4.0**2 * np.sin(turns).sum()
    up, across = square_of_solid(around)
    for share, whole in ((1, False), (2, True)):
        mesh = solid_cylinder(4.0, np.linspace(0.0, 10.0, 6), through, widths, whole)
        section = share * (around * through + up * across)
        assert len(mesh.hexes) == 5 * section
        assert mesh.volumes().sum() == pytest.approx(share * area * 10.0, rel=1e-12)
        outside = share * 5 * around + (0 if whole else 5 * (2 * through + up)) + 2 * section
        assert np.sum(mesh.neighbours() < 0) == outside
        assert mesh.volumes().min() > mesh.volumes().max() / 30.0
        assert len(np.unique(mesh.nodes.round(9), axis=0)) == len(mesh.nodes)


def test_a_solid_cylinder_turns_about_its_axis() -> None:
    widths = np.ones(8)
    straight, turned = (solid_cylinder(4.0, np.arange(3.0), 2, widths, True, turn) for turn in (0.0, pi / 2))
    np.testing.assert_allclose(turned.nodes[:, 1], -straight.nodes[:, 2], atol=1e-12)
    np.testing.assert_allclose(turned.nodes[:, 2], straight.nodes[:, 1], atol=1e-12)


def test_erosion_takes_an_element_out_of_the_topology() -> None:
    """Once: live counts of its corners fall by one; a node with none left stops, massless for forces."""
    mesh = brick((3.0, 1.0, 1.0), (3, 1, 1))
    state = start(Model(mesh, Material(1e-9, 100.0, 0.3), velocity=np.full_like(mesh.nodes, 2.0)))
    body, topology = state.body, state.topology
    np.testing.assert_array_equal(topology.live, [1] * 4 + [2] * 8 + [1] * 4)
    body.state[0, ALIVE, 0] = 0.0
    erode = called(erosion.erode)
    count, energy = erode(topology, body.state, body.v, body.mass, body.inverse_mass)
    assert count == 1
    assert energy == pytest.approx(4 * 0.5 * 0.125e-9 * 12.0)
    np.testing.assert_array_equal(topology.standing, [False, True, True])
    np.testing.assert_array_equal(topology.live, [0] * 4 + [1] * 4 + [2] * 4 + [1] * 4)
    assert np.all(body.v[:4] == 0.0)
    assert np.all(body.inverse_mass[:4] == 0.0)
    assert erode(topology, body.state, body.v, body.mass, body.inverse_mass) == (0, 0.0)


def test_material_constants() -> None:
    """E = 9KG/(3K+G), ν = (3K−2G)/(6K+2G); Eₚ = E E_t/(E − E_t); c = √((K + 4G/3)/ρ) with the scaled density."""
    material = Material(1e-9, 900.0, 0.35, 12.0, 90.0)
    K, G = material.bulk_modulus, material.shear_modulus
    np.testing.assert_allclose(9 * K * G / (3 * K + G), 900.0)
    np.testing.assert_allclose((3 * K - 2 * G) / (6 * K + 2 * G), 0.35)
    assert material.plastic_modulus == pytest.approx(100.0)
    assert material.p_wave_modulus == pytest.approx(900.0 * 0.65 / (1.35 * 0.3))
    numbers = material.numbers(100.0, BulkViscosity())
    assert numbers.density == pytest.approx(1e-7)
    assert numbers.sound_speed == pytest.approx(np.sqrt((K + 4 * G / 3) / 1e-7))
