"""Parting on the plane under an edge: what parts, where the front is, and what flanks push, against closed forms."""

from dataclasses import replace
from math import radians, tan
from typing import Any

import numpy as np
import oracle
import pytest
from called import called
from numpy.typing import NDArray

from stemcal.fem.kernels import contact, parting
from stemcal.fem.kernels.block import PLASTIC_STRAIN, STRESS
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.parting import doubled, joined, spared
from stemcal.fem.state import State, start
from stemcal.fem.stepper import History, simulate
from stemcal.fem.tools import Contact, Tool

Array = NDArray[np.float64]
STEEL = Material(1e-9, 1000.0, 0.0)
flank_distance, find_front = called(contact.flank_distance), called(parting.find_front)
close_plane, tie = called(parting.close_plane), called(parting.tie)


def wedge(angle: float = 60.0, thickness: float = 2.0, height: float = 0.0, **more: Any) -> Tool:
    """Return a sharp blade, its edge on x = 0."""
    half = 0.5 * thickness
    rise = half / tan(radians(0.5 * angle))
    corners = ((0.0, 0.0), (half, rise), (half, rise + 20.0), (-half, rise + 20.0), (-half, rise))
    return Tool(corners, 0.0, height=height, edge=0.0, **{"spread": 0.5, "parts": True, **more})


def block(sides: int, layers: int = 6, h: float = 0.5) -> Mesh:
    """Return a block below z = 0 on one side of the plane x = 0, or on both with two nodes at each place of it."""
    along = np.arange(layers + 1) * h
    along = along if sides == 1 else np.concatenate([-along[::-1], along])
    mesh = brick((1.0, 1.0, 4 * h), (len(along) - 1, 2, 4))
    layer = np.arange(len(mesh.nodes)) // (len(mesh.nodes) // len(along))
    nodes = np.column_stack([along[layer], mesh.nodes[:, 1], mesh.nodes[:, 2] - 4 * h])
    return doubled(mesh.moved(nodes))


def held_at_plane(mesh: Mesh) -> NDArray[np.bool_]:
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[np.abs(mesh.nodes[:, 0]) < 1e-9, 0] = True
    return held


def state_of(sides: int, **more: Any) -> State:
    mesh = block(sides)
    held = held_at_plane(mesh) if sides == 1 else None
    return start(Model(mesh, STEEL, tools=(wedge(**more),), held=held))


# ---- the plane


@pytest.mark.parametrize("sides", [1, 2])
def test_nodes_of_the_plane(sides: int) -> None:
    """Every place on the plane once, its twin on the other side, the layers behind it in order."""
    state = state_of(sides)
    cut, x = state.spread.cut, state.body.x
    on = np.flatnonzero(np.abs(x[:, 0]) < 1e-9)
    assert len(on) == sides * 15
    assert set(cut.nodes) | set(cut.twins) == set(on) and len(cut.twins) == (sides - 1) * 15
    assert set(np.flatnonzero(cut.number >= 0)) == set(on)
    np.testing.assert_array_equal(x[cut.columns, 0], np.tile(cut.layers, (15, 1)))
    assert np.ptp(x[cut.columns][..., 1:], axis=1).max() == 0.0
    assert cut.layers[-1] >= np.abs(state.spread.across).max() and np.all(np.diff(cut.layers) >= 0.0)
    centres = x[state.topology.hexes].mean(axis=1)
    np.testing.assert_array_equal(cut.side[state.topology.hexes[:, 0]], np.sign(centres[:, 0]))
    assert len(cut.faces) == sides * 8 and cut.around.sum() == 4 * len(cut.faces)


def test_strain_spreads_across_the_plane() -> None:
    """The doubled mesh has the neighbours of the same block in one piece."""
    mesh, tools = block(2), (wedge(),)
    whole = brick((6.0, 1.0, 2.0), (12, 2, 4))
    order = np.lexsort(np.round(mesh.nodes[mesh.hexes].mean(axis=1), 6).T)
    same = np.lexsort(np.round(whole.nodes[whole.hexes].mean(axis=1), 6).T)
    rank, position = np.argsort(order), np.argsort(same)
    found = joined(mesh, tools).neighbours()[order]
    wanted = whole.neighbours()[same]
    np.testing.assert_array_equal(np.where(found < 0, -1, rank[found]), np.where(wanted < 0, -1, position[wanted]))


def test_elements_near_the_plane_are_spared() -> None:
    """Within half the thickness, 1 mm, and two internal lengths or half the height, 1 mm, nothing is deleted."""
    mesh = block(2)
    away = np.abs(mesh.nodes[mesh.hexes, 0].mean(axis=1))
    np.testing.assert_array_equal(spared(mesh, (wedge(),), 0.4), away < 2.0)
    np.testing.assert_array_equal(spared(mesh, (wedge(),), 0.7), away < 2.4)
    assert not spared(mesh, (replace(wedge(), parts=False),), 0.4).any()


# ---- the front


@pytest.mark.parametrize("sides", [1, 2])
@pytest.mark.parametrize("depth", [0.3, 0.8, 1.35])
def test_front_moves_between_nodes(sides: int, depth: float) -> None:
    """Where the strain falls in proportion to the depth below the top, the front is where it equals the limit."""
    state = state_of(sides)
    cut, x = state.spread.cut, state.body.x
    z = x[cut.nodes, 2]
    cut.strain[:] = 1.0 + (z + depth) / 2.0
    cut.parted[:] = z >= -depth
    lines = np.array([0.13, 0.5, 0.87])
    find_front(cut, lines, x, -depth, 0.5)
    np.testing.assert_allclose(cut.front[:3], -depth, atol=1e-12)
    held = np.einsum("lk,lki->li", cut.shares[:3], x[cut.nodes[cut.ends[:3]]])
    np.testing.assert_allclose(held[:, 1:], np.column_stack([lines, np.full(3, -depth)]), atol=1e-12)
    find_front(cut, lines, x, 0.6 - depth, 0.5)
    assert np.all(cut.front[:3] == parting.NO_FRONT)  # too far below the edge
    cut.parted[:] = False
    find_front(cut, lines, x, 0.0, 0.5)
    assert np.all(cut.front[:3] == parting.SKIN)


# ---- the flanks


def test_flanks_are_a_sharp_wedge_continued_beyond_the_plane() -> None:
    """Depth (x·cos β − z·sin β) of a flank z = x/tan β below its shoulder; mirrored on the left; less the offset."""
    state = state_of(2, angle=50.0)
    cut, beta = state.spread.cut, radians(25.0)
    right, left = int(cut.nodes[0]), int(cut.twins[0])
    for px, pz in ((0.3, 0.9), (0.3, 0.2), (-0.1, 0.1)):
        wanted = px * np.cos(beta) - pz * np.sin(beta)
        for n, sign in ((right, 1.0), (left, -1.0)):
            gap, nx, nz = flank_distance(cut, n, sign * px, pz)
            assert gap == pytest.approx(wanted, abs=1e-9)
            assert (nx, nz) == pytest.approx((sign * np.cos(beta), -np.sin(beta)), abs=1e-9)
    cut.offset[right] = 0.25
    assert flank_distance(cut, right, 0.3, 0.9)[0] == pytest.approx(0.3 * np.cos(beta) - 0.9 * np.sin(beta) + 0.25)
    shoulder, outline = 1.0 / tan(beta), np.array(wedge(50.0).corners)
    inside = np.array([0.8, shoulder + 2.0])
    assert flank_distance(cut, left, -inside[0], inside[1])[0] == pytest.approx(
        oracle.polygon_distance(inside, outline)[0], abs=1e-9
    )


def arms(angle: float, friction: float = 0.0) -> tuple[History, float]:
    """Drive a wedge between two arms of a plate that have parted; returns the history and how far they are opened.

    Arms 2 mm high and 1 mm thick, free over 24 mm above the place that holds together, seen from one side.
    """
    mesh = brick((2.0, 0.5, 40.0), (4, 1, 80))
    mesh = mesh.moved(mesh.nodes - [0.0, 0.0, 40.0])
    held = held_at_plane(mesh)
    held[np.abs(mesh.nodes[:, 2] + 40.0) < 1e-9, 2] = True
    tool = replace(wedge(angle, 0.8, 0.05), speed=-20.0, spread=0.25)
    model = Model(
        mesh, STEEL, tools=(tool,), held=held, contact=Contact(friction, friction), settling=0.02,
        integration=Integration(outputs=400),
    )  # fmt: skip

    def part_above(time: float, state: State) -> None:
        cut = state.spread.cut
        free = cut.nodes[state.body.x[cut.nodes, 2] > -24.1] if time == 0.0 else cut.nodes[:0]
        cut.parted[cut.number[free]] = True
        state.body.free[free, 0] = True

    history = simulate(model, 0.02, inspect=part_above)
    top = np.argmax(mesh.nodes[:, 2] - mesh.nodes[:, 0])
    return history, float(history.x[top, 0])


@pytest.mark.parametrize(("angle", "friction"), [(30.0, 0.0), (60.0, 0.0), (60.0, 0.15)])
def test_wedge_opens_two_cantilevers(angle: float, friction: float) -> None:
    """P = 3 E I δ/(a + χh)³ with Williams's χ = 0.605 for the root, F_z/P = (tan β + μ)/(1 − μ tan β).

    n layers of elements with one point each have (1 − 1/n²) of the bending stiffness; a is the length to the first
    node that holds (J. G. Williams, J. Strain Anal. 24, 207-214, 1989).
    """
    history, opened = arms(angle, friction)
    across, along = history.force[-20:, 0, 0].mean(), history.force[-20:, 0, 2].mean()
    slope = tan(radians(0.5 * angle))
    assert along / -across == pytest.approx((slope + friction) / (1.0 - friction * slope), rel=1e-6)
    stiffness = 1000.0 * 0.5 * 2.0**3 / 12.0 * (1.0 - 1.0 / 4**2)
    assert -across == pytest.approx(3.0 * stiffness * opened / (24.5 + 0.605 * 2.0) ** 3, rel=0.05)
    assert history.drift_percent() < 0.1
    assert history.held[-1].sum() > 0.0


def test_a_node_that_parts_inside_the_flank_is_not_pushed_at_once() -> None:
    """Its depth then is noted: pushed out it would receive energy from nowhere."""
    state = state_of(2, height=-0.4)
    cut, body = state.spread.cut, state.body
    state.exchange.mean[:] = 2.0 * STEEL.failure_strain if np.isfinite(STEEL.failure_strain) else np.inf
    called(parting.part)(
        cut, state.exchange._replace(failure_strain=np.ones(len(state.exchange.mean))), body, state.tools
    )
    assert cut.parted.all()
    for nodes in (cut.nodes, cut.twins):
        inside = body.x[nodes, 2] > -0.4 + 1e-9
        depth = (body.x[nodes, 2] + 0.4) * np.sin(radians(30.0))
        np.testing.assert_allclose(cut.offset[nodes], np.where(inside, depth, 0.0), atol=1e-9)


# ---- two faces


@pytest.mark.parametrize("sides", [1, 2])
def test_parted_faces_close_with_damped_penalty(sides: int) -> None:
    """Mirrored at the plane or against their twins: f = p m/Δt²·δ − 2ζ√(k m)·v per side, no force apart."""
    state = state_of(sides)
    cut, body, law = state.spread.cut, state.body, Contact(penalty=0.25, damping=0.5).numbers()
    random = np.random.default_rng(1)
    cut.parted[:] = random.random(15) < 0.7
    gap, rate = random.uniform(-0.01, 0.01, 15), random.uniform(-5.0, 5.0, 15)
    body.x[cut.nodes, 0], body.v[cut.nodes, 0] = gap, rate
    if sides == 2:
        body.x[cut.twins, 0], body.v[cut.twins, 0] = -gap, -rate
    close_plane(cut, 0.0, body.x, body.v, body.mass, body.pushes, 1e-6, law)
    mass = body.mass[cut.nodes]
    k = 0.25 * mass / 1e-12
    wanted = np.maximum(-k * gap - np.sqrt(k * mass) * rate, 0.0) * (cut.parted & (gap < 0.0))
    np.testing.assert_allclose(body.pushes.force[:, cut.nodes, 0].sum(axis=0), wanted, rtol=1e-12)
    assert (wanted > 0.0).sum() > 2
    if sides == 2:
        np.testing.assert_allclose(body.pushes.force[:, cut.twins, 0].sum(axis=0), -wanted, rtol=1e-12)


def test_twins_move_as_one_until_they_part() -> None:
    """Common momentum, also of unequal masses; those that have parted keep their velocities."""
    state = state_of(2)
    cut, body = state.spread.cut, state.body
    random = np.random.default_rng(5)
    body.mass[:] = random.uniform(1.0, 2.0, len(body.mass))
    body.v[:] = random.normal(size=body.v.shape)
    cut.parted[:] = random.random(15) < 0.3
    momentum, before = body.mass @ body.v, body.v.copy()
    tie(cut, body.mass, body.v, False)
    np.testing.assert_allclose(body.mass @ body.v, momentum, rtol=1e-12)
    tied = ~cut.parted
    np.testing.assert_array_equal(body.v[cut.nodes[tied]], body.v[cut.twins[tied]])
    np.testing.assert_array_equal(body.v[cut.nodes[~tied]], before[cut.nodes[~tied]])


def pulled(sides: int, unequal: bool = False) -> tuple[History, Model, list[tuple[float, float, bool]]]:
    """Pull a block apart at a steady strain rate; returns stress, plastic strain and whether it holds, at all times."""
    mesh = block(sides, layers=3)
    if unequal:
        mesh = mesh.moved(np.where(mesh.nodes[:, :1] < 0.0, [0.5, 1.0, 1.0], [1.0, 1.0, 1.0]) * mesh.nodes)
    x = mesh.nodes[:, 0]
    held = held_at_plane(mesh) if sides == 1 else np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 0] |= np.abs(x) > np.abs(x).max() - 1e-9 if not unequal else (x == x.max()) | (x == x.min())
    velocity = np.where(np.arange(3) == 0, 10.0 * mesh.nodes, 0.0)
    law = Material(1e-9, 1000.0, 0.0, 10.0, 50.0, 1.0, failure_strain=0.02, internal_length=0.3)
    far = wedge(height=50.0)
    model = Model(
        mesh, law, tools=(far,), held=held, velocity=velocity, integration=Integration(1.0, outputs=100, threads=1)
    )
    seen = []

    def look(time: float, state: State) -> None:
        rows = state.lanes.gathered(state.body.state)
        seen.append(
            (float(rows[:, STRESS].mean()), float(rows[:, PLASTIC_STRAIN].mean()), not state.spread.cut.parted.any())
        )

    return simulate(model, 4e-3, inspect=look), model, seen


@pytest.mark.parametrize(("sides", "unequal"), [(1, False), (2, False), (2, True)])
def test_a_pulled_bar_parts_at_the_failure_strain(sides: int, unequal: bool) -> None:
    """σ = σ_y + E_p ε_f when ε = ε_f + σ/E; from there on it is free of stress, and nothing is deleted."""
    history, model, seen = pulled(sides, unequal)
    law = model.material
    stress, strain, holds = (np.array(column) for column in zip(*seen, strict=True))
    last = int(np.argmin(holds)) - 1
    assert 0 < last < len(holds) - 20
    assert strain[last] == pytest.approx(0.02, rel=0.03) and strain.max() < 0.0215
    assert stress[last] == pytest.approx(law.yield_stress + law.plastic_modulus * 0.02, rel=0.01)
    total = np.log1p(10.0 * history.time[last])
    assert strain[last] == pytest.approx(total - stress[last] / 1000.0, rel=0.03)
    assert abs(stress[-20:].mean()) < 0.05 * stress[last]
    assert history.parted[-1] == 15 and history.deleted[-1] == 0
    assert history.drift_percent() < 0.1
