"""The blade's edge meets the body between its nodes, and faces that erosion lays open."""

import numpy as np
import pytest
from driven import NO_VISCOSITY

from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate
from stemcal.fem.tools import Contact, Tool

ELASTIC = Material(1e-9, 1000.0, 0.0)
STEP = 1.0 / np.sqrt(1000.0 / 1e-9)


def wedge(x: float, height: float, speed: float = 0.0, edge: bool = True) -> Tool:
    """A sharp wedge of 30° with its lowest line at x: no node half an element beside it lies in it for 1.8 mm."""
    return Tool(((x, 0.01), (x + 2.7, 10.0), (x - 2.7, 10.0)), 0.01, height, speed, x if edge else None)


def plate() -> Mesh:
    """Return 3×3 elements in a layer, top at z = 0, the middle of the middle face at the origin."""
    mesh = brick((3.0, 3.0, 1.0), (3, 3, 1))
    return mesh.moved(mesh.nodes - np.array([1.5, 1.5, 1.0]))


@pytest.mark.parametrize("x", [0.0, 0.2, -0.35])
def test_edge_between_nodes_pushes_the_face(x: float) -> None:
    """All nodes held, edge 0.1 mm deep at ξ = 2x: every sample gives p m_s/Δt² δ, m_s = m_c/(4 ΣN²), m_c = m/8.

    12 samples over the three faces under it. Less half a step of the first; without the edge's own samples there is
    no force at all.
    """
    mesh = plate()
    model = Model(mesh, ELASTIC, tools=(wedge(x, -0.1),), held=np.ones(mesh.nodes.shape, dtype=bool),
                  contact=Contact(damping=0.0), integration=Integration(outputs=1, safety=0.8))  # fmt: skip
    history = simulate(model, 1e-3)
    eta = np.array([-0.75, -0.25, 0.25, 0.75])
    squares = 0.25 * (1.0 + (2.0 * x) ** 2) * (1.0 + eta**2)
    wanted = 3.0 * np.sum(0.25 * 0.125e-9 / (4.0 * squares) / STEP**2 * 0.1)
    assert history.force[1, 0, 2] == pytest.approx(wanted, rel=1e-3)
    np.testing.assert_allclose(history.force[1, 0, :2], 0.0, atol=1e-9 * wanted)
    blind = Model(mesh, ELASTIC, tools=(wedge(x, -0.1, edge=False),), held=np.ones(mesh.nodes.shape, dtype=bool),
                  contact=Contact(damping=0.0), integration=Integration(outputs=1, safety=0.8))  # fmt: skip
    assert simulate(blind, 1e-3).force[1, 0, 2] == 0.0


def test_the_four_nodes_share_by_the_shape_functions() -> None:
    """Free nodes, one step from rest: accelerations of the middle face's corners as (1 ± 2x)/2 along x.

    Every sample's mirror image in y is there too, so along y the shares are equal.
    """
    x = 0.2
    mesh = plate()
    model = Model(mesh, ELASTIC, tools=(wedge(x, -0.01),), contact=Contact(damping=0.0), viscosity=NO_VISCOSITY,
                  integration=Integration(outputs=1, safety=0.8))  # fmt: skip
    history = simulate(model, 0.5 * STEP)
    moved = history.x - mesh.nodes
    near = np.flatnonzero(
        (mesh.nodes[:, 2] == 0.0) & (np.abs(mesh.nodes[:, 1]) < 0.6) & (np.abs(mesh.nodes[:, 0]) < 0.6)
    )
    down = {tuple(mesh.nodes[n, :2]): moved[n, 2] for n in near}
    assert all(value < 0.0 for value in down.values())
    for y in (-0.5, 0.5):
        assert down[(0.5, y)] / down[(-0.5, y)] == pytest.approx((1.0 + 2.0 * x) / (1.0 - 2.0 * x), rel=1e-9)
    assert down[(0.5, -0.5)] == pytest.approx(down[(0.5, 0.5)], rel=1e-9)
    far = (np.abs(mesh.nodes[:, 0]) > 0.6) | (mesh.nodes[:, 2] < -0.5)
    assert np.all(moved[far] == 0.0)


def test_a_sharp_edge_indents_in_equilibrium() -> None:
    """Pressed by 0.05 mm into a plate that lies on a table, slowly: the table carries what the blade gives (2 %).

    And the blade feels no force along x or y beside it: it stays over the middle.
    """
    mesh = plate()
    table = Tool(((-50.0, -20.0), (50.0, -20.0), (50.0, -1.0), (-50.0, -1.0)), 1.0, height=-1.0)
    model = Model(mesh, ELASTIC, tools=(wedge(0.0, 0.0, -20.0), table), contact=Contact(0.15, 0.1),
                  integration=Integration(outputs=50, safety=0.8))  # fmt: skip
    history = simulate(model, 0.05 / 20.0)
    blade, below = history.force[-10:, 0].mean(axis=0), history.force[-10:, 1].mean(axis=0)
    assert blade[2] > 1.0
    assert below[2] == pytest.approx(-blade[2], rel=0.02)
    np.testing.assert_allclose(blade[:2], 0.0, atol=1e-6 * blade[2])
    assert history.drift_percent() < 0.5


def test_faces_laid_open_by_erosion_join_at_once() -> None:
    """Two layers, held at their foot; the blade cuts through the upper one and is met again by the lower.

    The force falls to nothing in between (the first row gone, the blade in its gap) and comes back.
    """
    mesh = brick((3.0, 1.0, 2.0), (3, 1, 2))
    mesh = mesh.moved(mesh.nodes - np.array([1.5, 0.5, 2.0]))
    held = np.repeat((mesh.nodes[:, 2] < -1.5)[:, None], 3, axis=1)
    material = Material(1e-9, 1000.0, 0.0, 5.0, 0.0, failure_strain=0.05)
    model = Model(mesh, material, tools=(wedge(0.0, 0.001, -50.0),), held=held, contact=Contact(0.1, 0.1),
                  integration=Integration(outputs=150, safety=0.5))  # fmt: skip
    history = simulate(model, 1.5 / 50.0)
    gone = history.deleted
    assert gone[-1] >= 2
    first = int(np.argmax(gone > 0))
    between = history.force[first + 1 :, 0, 2]
    assert history.force[: first + 1, 0, 2].max() > 1.0
    assert between.min() < 0.05 * history.force[:, 0, 2].max()
    assert between[np.argmin(between) :].max() > 1.0
    assert history.drift_percent() < 5.0
