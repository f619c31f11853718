"""Contact kernels against plain geometry and their NumPy twins, and the tools that users write."""

from math import pi

import numpy as np
import oracle
import pytest
from called import called
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stemcal.fem.kernels import contact
from stemcal.fem.kernels.contact import EdgeArrays
from stemcal.fem.mesh import Mesh
from stemcal.fem.parting import cut_plane
from stemcal.fem.state import _no_pushes
from stemcal.fem.tools import Contact, Tool, edge_arrays, spread_edge, tool_arrays

contact_force, friction_limit = called(contact.contact_force), called(contact.friction_limit)
face_modes, face_normal = called(contact.face_modes), called(contact.face_normal)
locate_in_face, outline_distance = called(contact.locate_in_face), called(contact.outline_distance)
push_faces_out, push_nodes_out = called(contact.push_faces_out), called(contact.push_nodes_out)
push_skin_out = called(contact.push_skin_out)
LAW = Contact(0.4, 0.1, 0.05, 0.2, 0.5).numbers()
seeds = st.integers(0, 2**32 - 1)


def convex_polygon(random: np.random.Generator, corners: int) -> np.ndarray:
    """Return corners on an ellipse, counter-clockwise."""
    angles = np.sort(random.uniform(0.0, 2.0 * pi, corners))
    return np.stack([random.uniform(0.5, 3.0) * np.cos(angles), random.uniform(0.5, 3.0) * np.sin(angles)], axis=1)


@given(seeds, st.integers(3, 7), st.booleans())
@settings(max_examples=150, deadline=None)
def test_outline_distance_against_brute_force(seed: int, count: int, repeated: bool) -> None:
    """Distance to the nearest of all sides, sign by the winding angle; the normal is the distance's gradient.

    A repeated last corner, which fills shorter polygons, changes nothing. Tolerance: round-off.
    """
    random = np.random.default_rng(seed)
    polygon = convex_polygon(random, count)
    assume(np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1).min() > 0.05)
    point = random.uniform(-4.0, 4.0, 2)
    corners = np.vstack([polygon, polygon[-1:], polygon[-1:]]) if repeated else polygon
    gap, nx, nz = outline_distance(point[0], point[1], corners)
    wanted, nearest = oracle.polygon_distance(point, polygon)
    assume(abs(wanted) > 1e-6)
    assert gap == pytest.approx(wanted, abs=1e-12)
    np.testing.assert_allclose([nx, nz], (point - nearest) / wanted, atol=1e-8)
    assert np.hypot(nx, nz) == pytest.approx(1.0, abs=1e-12)


def test_outline_distance_of_a_square() -> None:
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    assert outline_distance(1.0, -0.5, square) == pytest.approx((0.5, 0.0, -1.0))
    assert outline_distance(1.0, 0.25, square) == pytest.approx((-0.25, 0.0, -1.0))
    gap, nx, nz = outline_distance(5.0, 6.0, square)
    assert (gap, nx, nz) == pytest.approx((5.0, 0.6, 0.8))
    assert outline_distance(1.0, 0.0, square) == pytest.approx((0.0, 0.0, -1.0))


@given(seeds)
@settings(max_examples=100, deadline=None)
def test_contact_force_equals_its_twin(seed: int) -> None:
    random = np.random.default_rng(seed)
    normal = random.normal(size=3)
    normal /= np.linalg.norm(normal)
    velocity, spring = random.uniform(-50.0, 50.0, 3), random.uniform(-1.0, 1.0, 3)
    depth, mass, dt0, dt = random.uniform(0.0, 0.1), random.uniform(1e-9, 1e-8), 1e-6, random.uniform(0.5e-6, 1e-6)
    found = contact_force(depth, tuple(normal), tuple(velocity), tuple(spring), mass, dt0, dt, LAW)
    wanted = oracle.contact_force(depth, normal, velocity, spring, mass, dt0, dt, LAW)
    for one, two in zip(found, wanted, strict=True):
        np.testing.assert_allclose(one, two, atol=1e-10 * max(np.abs(two).max(), 1.0))


@pytest.mark.parametrize("speed", [0.0, 3.0, 1000.0])
@pytest.mark.parametrize("decay", [0.0, 0.05])
def test_friction_limit(decay: float, speed: float) -> None:
    """μ = μ_d + (μ_s − μ_d) exp(−DC |v|)."""
    law = Contact(0.4, 0.1, decay).numbers()
    assert friction_limit(7.0, speed, law) == pytest.approx(7.0 * (0.1 + 0.3 * np.exp(-decay * speed)))


def test_nodes_are_pushed_out_of_all_tools() -> None:
    """Forces on listed nodes only, the opposite on the tools, springs kept for nodes inside and dropped outside."""
    random = np.random.default_rng(3)
    wedge = Tool(((0.0, 0.2), (1.0, 3.0), (-1.0, 3.0)), 0.2, height=-1.0, speed=-5.0)
    table = Tool(((-9.0, -9.0), (9.0, -9.0), (9.0, -1.0), (-9.0, -1.0)), 0.5, height=0.4)
    x, v = random.uniform(-2.0, 2.0, (60, 3)), random.uniform(-30.0, 30.0, (60, 3))
    mass = random.uniform(1e-9, 2e-9, 60)
    tools = tool_arrays((wedge, table), 60)
    tools.traction[:] = random.uniform(-1.0, 1.0, tools.traction.shape)
    old, pushes = tools.traction.copy(), _no_pushes(60, 2)
    near = np.tile(np.arange(60, dtype=np.int32), (2, 1))
    counts = np.array([50, 60], dtype=np.int32)
    nothing = np.zeros((0, 8), dtype=np.int32)
    no_plane = cut_plane((), Mesh(x, nothing), spread_edge((), x, nothing, 1.0))
    push_nodes_out(tools, near, counts, x, v, mass, pushes, 1e-6, 0.8e-6, LAW, no_plane)
    wanted, on_tools, inside = np.zeros((60, 3)), np.zeros((2, 3)), 0
    for t, tool in enumerate((wedge, table)):
        for n in range(counts[t]):
            place = x[n, [0, 2]] - [0.0, tool.height]
            gap, nearest = oracle.polygon_distance(place, np.array(tool.corners))
            spring = np.zeros(3)
            if gap < tool.radius:
                inside += 1
                normal = np.array([place[0] - nearest[0], 0.0, place[1] - nearest[1]]) / gap
                relative = v[n] - [0.0, 0.0, tool.speed]
                force, spring = oracle.contact_force(
                    tool.radius - gap, normal, relative, old[t, n], mass[n], 1e-6, 0.8e-6, LAW
                )
                wanted[n] += force
                on_tools[t] -= force
            np.testing.assert_allclose(tools.traction[t, n], spring, atol=1e-9)
    np.testing.assert_array_equal(tools.traction[0, 50:], old[0, 50:])
    assert inside > 30
    np.testing.assert_allclose(pushes.force.sum(axis=0), wanted, atol=1e-10 * np.abs(wanted).max())
    for s, many in enumerate(pushes.many):
        listed = set(np.flatnonzero(pushes.listed[s]))
        assert set(pushes.nodes[s, :many]) == listed >= set(np.flatnonzero(pushes.force[s, :, 0]))
    # normal forces apart from friction, which is what the springs have
    np.testing.assert_allclose(pushes.force[4][pushes.listed[4]], tools.traction[0][pushes.listed[4]], atol=1e-9)
    np.testing.assert_allclose(tools.force, on_tools, atol=1e-10 * np.abs(on_tools).max())


@given(seeds)
@settings(max_examples=50, deadline=None)
def test_locating_a_point_in_a_face(seed: int) -> None:
    """x(ξ, η), y(ξ, η) → (ξ, η): Newton's steps come back to a known point of a distorted face."""
    random = np.random.default_rng(seed)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) + random.uniform(-0.15, 0.15, (4, 2))
    xi, eta = random.uniform(-1.0, 1.0, 2)
    px, py = oracle.bilinear(xi, eta) @ corners
    found = locate_in_face(px, py, face_modes(*corners[:, 0]), face_modes(*corners[:, 1]))
    np.testing.assert_allclose(found, [xi, eta], atol=1e-4)


def test_normal_of_a_face() -> None:
    """A plane face through z = 2x − y has the normal (−2, 1, 1)/√6 everywhere."""
    corners = np.array([[0.0, 0.0], [1.2, 0.1], [1.0, 1.0], [-0.1, 0.9]])
    z = 2.0 * corners[:, 0] - corners[:, 1]
    modes = face_modes(*corners[:, 0]), face_modes(*corners[:, 1]), face_modes(*z)
    for xi, eta in [(0.0, 0.0), (0.7, -0.3)]:
        np.testing.assert_allclose(face_normal(*modes, xi, eta), np.array([-2.0, 1.0, 1.0]) / np.sqrt(6.0), atol=1e-12)


def edge(tools: tuple[Tool, ...], samples: list[float]) -> EdgeArrays:
    return EdgeArrays(0, float(tools[0].edge or 0.0), np.array(samples), 4.0, np.zeros((2 * len(samples), 3)), 1.0)


def test_edge_pushes_a_face_between_its_nodes() -> None:
    """The force of each sample is that of its point, shared out by the shape functions, and the tool gets the opposite.

    An inclined, distorted face under an edge at x = 0.1, samples at y = 0.3 and 0.6 (and one outside, at 2): written
    out with `oracle.bilinear` and its inverse by brute force.
    """
    random = np.random.default_rng(5)
    tool = Tool(((0.1, 0.05), (1.0, 3.0), (-1.0, 3.0)), 0.05, height=0.9, speed=-20.0, edge=0.1)
    x = np.array([[-0.5, 0.0, 1.0], [0.6, -0.1, 1.1], [0.5, 1.0, 0.95], [-0.55, 0.9, 1.05]])
    v = random.uniform(-20.0, 20.0, (4, 3))
    tools, pushes = tool_arrays((tool,), 4), _no_pushes(4, 1)
    arrays = edge((tool,), [0.3, 0.6, 2.0])
    faces, corner_mass = np.array([[0, 1, 2, 3]], dtype=np.int32), np.array([0.5e-9])
    push_faces_out(tools, arrays, faces, corner_mass, 1, x, v, pushes, 1e-6, 0.8e-6, LAW)
    wanted = np.zeros((4, 3))
    for y in (0.3, 0.6):
        grid = np.linspace(-1.0, 1.0, 2001)
        xi, eta = 0.0, 0.0
        for _ in range(60):  # alternate: the line through x for this η, then η for this ξ
            xi = grid[np.argmin([abs(oracle.bilinear(g, eta) @ x[:, 0] - 0.1) for g in grid])] if _ == 0 else xi
            xi -= (oracle.bilinear(xi, eta) @ x[:, 0] - 0.1) / (0.5 * (x[1, 0] - x[0, 0]))
            eta -= (oracle.bilinear(xi, eta) @ x[:, 1] - y) / (0.5 * (x[3, 1] - x[0, 1]))
        share = oracle.bilinear(xi, eta)
        along_xi = (oracle.bilinear(1.0, eta) - oracle.bilinear(-1.0, eta)) @ x
        along_eta = (oracle.bilinear(xi, 1.0) - oracle.bilinear(xi, -1.0)) @ x
        normal = np.cross(along_xi, along_eta)
        normal /= np.linalg.norm(normal)
        depth = (share @ x[:, 2] - 0.9) * normal[2]
        relative = share @ v - [0.0, 0.0, -20.0]
        sample_mass = 0.5e-9 / (4.0 * share @ share)
        force, _ = oracle.contact_force(depth, -normal, relative, np.zeros(3), sample_mass, 1e-6, 0.8e-6, LAW)
        wanted += np.outer(share, force)
    np.testing.assert_allclose(pushes.force.sum(axis=0), wanted, atol=1e-6 * np.abs(wanted).max())
    np.testing.assert_allclose(tools.force[0], -pushes.force.sum(axis=(0, 1)), atol=1e-12 * np.abs(wanted).max())
    assert np.all(arrays.traction[4:] == 0.0)


@pytest.mark.parametrize("axis", [0.125, 0.75, 1.875])
def test_a_roller_bears_on_a_face_where_it_touches(axis: float) -> None:
    """A roller 0.004 mm deep in a face of 2 by 1 mm, with its axis over x: so acts its force, not at the nearest nodes.

    Of 16 spaces along the face those within √(2rδ) bear, with what k = p m/Δt² of their share of the mass m of one
    node gives, p = 0.25: Σ k (δ − x²/2r) without friction.
    """
    radius, deep = 2.0, 0.004
    tool = Tool(((axis - 1e-6, 0.0), (axis + 1e-6, 0.0), (axis, 1e-6)), radius, 1.0 + radius - deep, faces=True)
    x = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0], [0.0, 1.0, 1.0]])
    tools, pushes = tool_arrays((tool,), 4), _no_pushes(4, 1)
    tools = tools._replace(
        skin=np.array([[0, 1, 2, 3, 0]], dtype=np.int32),
        crowns=np.zeros(1),
        skin_mass=np.full((1, 4), 0.5e-9),
        skin_traction=np.zeros((1, 1, contact.SAMPLES, 3)),
    )
    near, counts = np.zeros((1, 1), dtype=np.int32), np.ones(1, dtype=np.int32)
    push_skin_out(tools, near, counts, x, np.zeros((4, 3)), pushes, 1e-6, 1e-6, Contact().numbers())
    force = pushes.force.sum(axis=0)
    at = np.linspace(0.0, 2.0, 17)
    depth = np.maximum(deep - (at - axis) ** 2 / (2.0 * radius), 0.0)
    share = np.where((at == 0.0) | (at == 2.0), 0.5, 1.0) / 16.0
    assert force[:, 2].sum() == pytest.approx(-0.25 * 2e-9 / 1e-12 * float(share @ depth), rel=2e-3)
    bears_at = float(share @ (depth * at)) / float(share @ depth)
    assert float(force[:, 2] @ x[:, 0]) / force[:, 2].sum() == pytest.approx(bears_at, abs=1e-4)
    assert bears_at == pytest.approx(axis, abs=0.01)
    assert tools.sunk[0, 0] / tools.sunk[0, 1] == pytest.approx(share @ depth**2 / (share @ depth), rel=2e-3)
    np.testing.assert_allclose(tools.force[0], -force.sum(axis=0), atol=1e-12)


@pytest.mark.parametrize(
    "corners",
    [((0.0, 0.0), (0.0, 1.0), (1.0, 0.0)), ((0.0, 0.0), (2.0, 0.0), (0.5, 0.5), (0.0, 2.0))],
    ids=["clockwise", "not convex"],
)
def test_tool_refuses_other_than_convex_counter_clockwise(corners: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(ValueError, match="convex"):
        Tool(corners, 0.1)


def test_edge_samples_lie_symmetric_and_reach_past_the_body() -> None:
    """Four to an element of 0.5 mm over a body from −2 to 2 mm: spacing 0.125 mm, mirrored in y = 0."""
    tool = Tool(((0.0, 0.1), (1.0, 3.0), (-1.0, 3.0)), 0.1, edge=0.25)
    arrays = edge_arrays(
        (Tool(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)), 0.1), tool), np.array([[0, -2, 0], [0, 2.0, 0]]), 0.5
    )
    assert (arrays.tool, arrays.x, arrays.per_face) == (1, 0.25, 4.0)
    np.testing.assert_allclose(np.diff(arrays.y), 0.125)
    np.testing.assert_allclose(arrays.y, -arrays.y[::-1])
    assert arrays.y[0] < -2.4
    assert arrays.y[-1] > 2.4
    assert edge_arrays((), np.zeros((1, 3)), 0.5).tool == -1
