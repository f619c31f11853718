"""A spread edge on an elastic block, held against a static solution that shares no code with the solver."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import History, simulate
from stemcal.fem.tools import Contact, Tool, _gap_beside, _reach_beside

Array = NDArray[np.float64]

E, NU = 1000.0, 0.3
WIDE, HIGH, LONG = 12.0, 6.0, 2.0
SPREAD = 1.0
TOOL = Tool(((0.0, 0.1), (1.0, 4.0), (-1.0, 4.0)), 0.1, height=0.0, speed=-0.2, edge=0.0, spread=SPREAD)
REACH = _reach_beside(TOOL)[1]


def bell(s: Array) -> Array:
    return np.maximum(1.0 - (_gap_beside(TOOL, s) / SPREAD) ** 2, 0.0) ** 2


def widening(h: float) -> float:
    """Return how many times as wide the bell is on elements of h: its variance is larger by ((0.56 a)² − h²)/6."""
    s = np.linspace(-REACH, REACH, 2001)
    return float(np.sqrt(1.0 + ((0.56 * SPREAD) ** 2 - h * h) / 6.0 / np.average(s * s, weights=bell(s))))


@cache
def static_compliance(h: float = 0.1) -> float:
    """Return mean indentation under the bell per force per length of edge, mm/(N/mm), in plane strain.

    Four-node quadrilaterals on a block held at its foot, loaded by the bell's consistent nodal forces.
    """
    nx, nz = round(WIDE / h), round(HIGH / h)
    number = np.arange((nx + 1) * (nz + 1)).reshape(nx + 1, nz + 1)
    c = E / ((1 + NU) * (1 - 2 * NU)) * np.array([[1 - NU, NU, 0], [NU, 1 - NU, 0], [0, 0, (1 - 2 * NU) / 2]])
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    ke = np.zeros((8, 8))
    for xi, eta in signs / np.sqrt(3.0):
        gradient = np.array([[sx * (1 + sz * eta), sz * (1 + sx * xi)] for sx, sz in signs]) / 4 * 2 / h
        b = np.zeros((3, 8))
        b[0, ::2], b[1, 1::2], b[2, ::2], b[2, 1::2] = gradient[:, 0], gradient[:, 1], gradient[:, 1], gradient[:, 0]
        ke += b.T @ c @ b * h * h / 4
    corners = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    freedoms = np.stack([2 * corners, 2 * corners + 1], axis=-1).reshape(-1, 8)
    rows, columns = np.repeat(freedoms, 8, axis=1).ravel(), np.tile(freedoms, (1, 8)).ravel()
    k = coo_matrix((np.tile(ke.ravel(), len(corners)), (rows, columns))).tocsr()
    s = (np.arange(2000) + 0.5) / 1000.0 * REACH - REACH
    weight = bell(s) / bell(s).sum()
    place = (s * widening(h) + WIDE / 2) / h
    left = np.floor(place).astype(int)
    load = np.zeros(2 * number.size)
    np.add.at(load, 2 * number[left, -1] + 1, weight * (1 - (place - left)))
    np.add.at(load, 2 * number[left + 1, -1] + 1, weight * (place - left))
    free = np.setdiff1d(np.arange(2 * number.size), np.concatenate([2 * number[:, 0], 2 * number[:, 0] + 1]))
    u = np.zeros_like(load)
    u[free] = spsolve(k[free][:, free].tocsc(), load[free])
    return float(load @ u)


def block(h: float, shift: float = 0.0) -> Mesh:
    """Return a block about x = 0 with its top at z = 0, its nodes shifted along x by a share of an element."""
    mesh = brick((WIDE, LONG, HIGH), (round(WIDE / h), round(LONG / h), round(HIGH / h)))
    inner = (mesh.nodes[:, 0] > 1e-9) & (mesh.nodes[:, 0] < WIDE - 1e-9)
    return mesh.moved(mesh.nodes - np.array([WIDE / 2, 0.0, HIGH]) + np.outer(inner * shift * h, [1.0, 0.0, 0.0]))


@cache
def pressed(h: float, shift: float = 0.0, mass_scaling: float = 1.0e4) -> History:
    """Press the edge 0.02 mm into the block, plane strain, slowly."""
    mesh = block(h, shift)
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 1] = True
    held[mesh.nodes[:, 2] < -HIGH + 1e-9] = True
    how = Integration(mass_scaling=mass_scaling, outputs=100)
    return simulate(Model(mesh, Material(1e-9, E, NU), (TOOL,), Contact(), integration=how, held=held), 0.1)


def stiffness(history: History) -> float:
    """Return force over travel per length of edge over the second half of the way, N/mm²."""
    half = len(history.time) // 2
    return float(np.polyfit(-history.height[half:, 0], history.force[half:, 0, 2], 1)[0]) / LONG


@pytest.mark.parametrize(("h", "tolerance"), [(0.5, 0.05), pytest.param(0.25, 0.015, marks=pytest.mark.slow)])
def test_slope_of_the_static_solution(h: float, tolerance: float) -> None:
    """Nothing but the block gives way: the slope is that of the block under the bell, closer with finer elements.

    One-point elements of a/2 are 4 % too soft here, those of a/4 1 %.
    """
    assert stiffness(pressed(h)) == pytest.approx(1.0 / static_compliance(), rel=tolerance)


@pytest.mark.slow
def test_slope_whatever_the_place_of_the_mesh() -> None:
    """Over nodes and over elements."""
    assert stiffness(pressed(0.5, 0.5)) == pytest.approx(stiffness(pressed(0.5)), rel=0.01)


@pytest.mark.slow
def test_slope_between_nodes_and_elements_and_with_a_tenth_of_the_mass() -> None:
    over_nodes = stiffness(pressed(0.5))
    assert stiffness(pressed(0.5, 0.25)) == pytest.approx(over_nodes, rel=0.01)
    assert stiffness(pressed(0.5, 0.0, 1.0e3)) == pytest.approx(over_nodes, rel=0.005)


def test_the_surface_stays_under_the_edge() -> None:
    """The mean height under the bell is the edge's: its own stiffness has no share in the travel, 0.02 mm."""
    history, mesh = pressed(0.5), block(0.5)
    top = np.abs(mesh.nodes[:, 2]) < 1e-9
    x, sunk = mesh.nodes[top, 0], history.x[top, 2]
    line = np.unique(x)
    y = mesh.nodes[top, 1]
    depth = np.array([np.trapezoid(sunk[np.isclose(x, v)], y[np.isclose(x, v)]) / LONG for v in line])
    s = (np.arange(200) + 0.5) / 100.0 * REACH - REACH
    mean = np.sum(bell(s) * np.interp(s * widening(0.5), line, depth)) / bell(s).sum()
    assert mean == pytest.approx(history.height[-1, 0], abs=5e-5)


def test_work_and_energy_balance() -> None:
    history = pressed(0.5)
    assert history.external[-1] == pytest.approx(history.internal[-1] + history.hourglass[-1], rel=0.03)
    assert history.drift_percent() < 0.5
