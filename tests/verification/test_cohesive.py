"""The plane of the cut against closed forms: cohesion alone, and a wedge with flanks and an edge."""

from __future__ import annotations

from math import atan, radians, tan
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from stemcal.cutting.blade import Blade
from stemcal.fem.cohesive import Cohesion
from stemcal.fem.contact import Contact, Tool
from stemcal.fem.history import History
from stemcal.fem.kernels.cohesive import bear, cohesion
from stemcal.fem.kernels.nodes import COHESION, EDGE, FRICTION, SURFACE
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate

Array = NDArray[np.float64]

E, STRENGTH, TOUGHNESS = 1000.0, 20.0, 0.5
CRITICAL = 2.0 * TOUGHNESS / STRENGTH
ELASTIC = Material(1e-9, E, 0.0)


def blade(angle: float, thickness: float, height: float, speed: float) -> Tool:
    """Return a sharp blade whose edge comes down the plane x = 0."""
    outline = Blade(thickness=thickness, width=1000.0, edge_angle=angle, edge_radius=0.0).outline()
    return Tool(outline, 0.0, height, -speed, edge=0.0, parts=True)


ABOVE = blade(30.0, 1.0, 1000.0, 0.0)


def test_a_block_pulled_apart_takes_toughness_times_area() -> None:
    """σ_c at first, then a triangle over the opening; with both halves G·A.

    The half block hardly stretches, σ_c L/E ≪ w_c/2, so its end shows the opening.
    """
    stiff = 1.0e5
    mesh = brick((1.0, 2.0, 3.0), (2, 2, 3))
    end = mesh.nodes[:, 0] > 1.0 - 1e-9
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[end] = True
    velocity = np.where(end[:, None], [1.0, 0.0, 0.0], 0.0)
    model = Model(mesh, Material(1e-6, stiff, 0.0), (ABOVE,), held=held, velocity=velocity,
                  integration=Integration(outputs=200), cohesion=Cohesion(STRENGTH, TOUGHNESS))  # fmt: skip
    history = simulate(model, 0.04)
    pulled_by = np.diff(history.external) / np.diff(history.time)  # N, at 1 mm/s
    # opening of the half: the end's way less the stretch of the block
    way = 0.5 * (history.time[1:] + history.time[:-1])
    stress = pulled_by / 6.0
    opening = 2.0 * (way - stress * 1.0 / stiff)
    soft = (opening > 0.1 * CRITICAL) & (opening < 0.9 * CRITICAL)
    np.testing.assert_allclose(stress[soft], STRENGTH * (1 - opening[soft] / CRITICAL), atol=0.02 * STRENGTH)
    assert stress.max() == pytest.approx(STRENGTH, rel=0.03)
    assert 2.0 * history.held[-1, COHESION, 0] == pytest.approx(TOUGHNESS * 6.0, rel=0.005)
    assert history.parted[-1] == 1.0 and history.drift_percent() < 0.1


class Law(NamedTuple):
    strength: float
    toughness: float
    widest: Array
    area: Array


@pytest.mark.parametrize("widest", [0.0, 0.2, 0.9, 1.0])
@pytest.mark.parametrize("opening", [-0.01, 0.0, 1e-4, 0.1, 0.25, 0.6, 0.95, 1.5])
def test_the_force_belongs_to_the_opening_of_the_step(widest: float, opening: float) -> None:
    """f = (opening − w)/give is A σ on the line of the law that w lies on; further, half way."""
    give, area = 1.0e-4, 3.0
    law = Law(STRENGTH, TOUGHNESS, np.array([widest * CRITICAL]), np.array([area]))
    force = -cohesion.py_func(law, 0, opening * CRITICAL, give)
    w = (opening * CRITICAL - give * force) / CRITICAL
    assert w >= -1e-12
    if opening <= 0.0:
        assert w == pytest.approx(0.0, abs=1e-12) and force <= 0.0
    elif w > max(widest, 1e-12):
        assert force == pytest.approx(area * STRENGTH * max(1.0 - 0.5 * (widest + w), 0.0), abs=1e-9)
    elif widest > 0.0:
        assert force == pytest.approx(area * STRENGTH * (1.0 - widest) * w / widest, abs=1e-9)
    else:
        assert 0.0 <= force <= area * STRENGTH


ARM, LONG = 3.0, 45.0
BENDING = E * ARM**3 / 12.0  # E I of one arm, one unit wide


def arm(through: int = 2, along: int = 90) -> Mesh:
    """Return one arm of a split beam, from the plane x = 0 outwards, its upper end at z = 0, one unit wide."""
    mesh = brick((ARM, 1.0, LONG), (through, 1, along))
    return mesh.moved(mesh.nodes - [0.0, 0.0, LONG])


def split(tool: Tool, time: float, friction: float = 0.0, velocity: Array | None = None) -> History:
    """Split a beam from its upper end; its lower end is held."""
    mesh = arm()
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 1] = True  # as thin as it is, the arm would buckle
    held[mesh.nodes[:, 2] < -LONG + 1e-9] = True
    if velocity is not None:
        held |= velocity != 0.0
    model = Model(mesh, ELASTIC, (tool,), Contact(friction, friction), "full", held=held, velocity=velocity,
                  integration=Integration(mass_scaling=1.0e4, outputs=300),
                  cohesion=Cohesion(STRENGTH, TOUGHNESS))  # fmt: skip
    return simulate(model, time)


@pytest.mark.slow
def test_a_split_beam_opens_as_beam_theory_says() -> None:
    """Double cantilever: G = P²a²/(b E I) and δ = P a³/(3 E I) leave P^(4/3) δ^(2/3) = G b E I/(3 E I)^(2/3).

    The length of the crack drops out, and with it the correction for the root (Williams, J. Strain Anal. 24, 1989).
    """
    mesh = arm()
    end = (np.abs(mesh.nodes[:, 2]) < 1e-9) & (np.abs(mesh.nodes[:, 0] - 0.5 * ARM) < 1e-9)
    velocity = np.where(end[:, None], [1.0, 0.0, 0.0], 0.0)
    history = split(ABOVE, 1.5, velocity=velocity)
    way = history.time
    force = np.gradient(history.external, way)
    expected = (TOUGHNESS * BENDING) ** 0.75 / (3.0 * BENDING) ** 0.5 / way[1:] ** 0.5
    late = way[1:] > 0.6
    assert (force[1:][late] / expected[late]).mean() == pytest.approx(1.0, abs=0.05)
    assert 2.0 * history.held[-1, COHESION, 0] == pytest.approx(TOUGHNESS * LONG * history.parted[-1], rel=0.1)


def wedge_force(depth: float, half: float, rubbing: float) -> float:
    """Return the force on a wedge that splits a beam, by beam theory; half angle and angle of friction in radians.

    The ends of the arms ride on the flanks, δ = depth · tan(half) apart from the middle. P across each arm follows as
    for the double cantilever, F = 2 P tan(half + rubbing). That the arms turn and that F presses on their inner faces
    makes 0.01 % without friction and 2 % with 0.2.
    """
    across = (TOUGHNESS * BENDING) ** 0.75 / (3.0 * BENDING) ** 0.5 / (depth * tan(half)) ** 0.5
    return float(2.0 * across * tan(half + rubbing))


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "friction"), [(20.0, 0.0), (40.0, 0.0), (40.0, 0.2)])
def test_a_wedge_splits_a_beam_with_the_force_of_beam_theory(angle: float, friction: float) -> None:
    """Angle, friction and toughness in one closed form: F = 2 P tan(angle/2 + ρ); the crack runs ahead of the edge."""
    half = radians(0.5 * angle)
    depths = 1.0 / tan(half)
    history = split(blade(angle, 100.0, 0.0, 0.5 * depths), 2.0, friction)
    late = history.height[:, 0] < -0.5 * depths
    expected = [wedge_force(-z, half, atan(friction)) for z in history.height[late, 0]]
    force = 2.0 * history.force[late, 0, 2]  # both arms
    assert force.mean() == pytest.approx(np.mean(expected), rel=0.05)
    assert history.drift_percent() < 0.5
    if friction == 0.0:
        assert history.held[-1, FRICTION].sum() == 0.0


def yielding_wedge_force(opening: Array, half: float, modulus: float, strength: float) -> Array:
    """Return the force on a wedge that splits a beam whose arms yield without hardening, by beam theory.

    With Mₑ and κₑ at first yield an arm bends by κ/κₑ = m = M/Mₑ up to 1 and by 1/√(3 − 2m) beyond. Behind the root it
    unloads elastically and stays bent by κ − M/EI. The root is no clamp but turns as if the crack were longer by
    D = 0.673 times the height of an arm (Li, Wang and Thouless, J. Mech. Phys. Solids 52, 193-214, 2004). So

        G = 2 ∫ κ dM + (M²/EI) ((1 + D/a)² − 1),   δ = ∫ (κ − M/EI) x dx + P (a + D)³/3EI,   F = 2 P tan(half)

    with P = M/a, the integrals over the moment at the root and over the crack (the first as in Rice, J. Appl. Mech. 35,
    379, 1968). Both follow from M: the first gives a.
    """
    turning, stiffness, moment = 0.673 * ARM, modulus * ARM**3 / 12.0, strength * ARM**2 / 6.0
    energy = moment**2 / stiffness  # Mₑκₑ
    most = min(np.sqrt(TOUGHNESS / energy), 0.5 * (3.0 - (1.5 - 0.5 * TOUGHNESS / energy) ** 2))
    m = np.linspace(0.01, 0.999, 4000) * most
    yields = m > 1.0
    root = np.sqrt(3.0 - 2.0 * np.where(yields, m, 1.0))
    bending = energy * np.where(yields, 3.0 - 2.0 * root, m**2)
    a = turning / (np.sqrt(1.0 + (TOUGHNESS - bending) / (energy * m**2)) - 1.0)
    stays = np.where(yields, 1.0 / root - m, 0.0) * moment / stiffness
    across = m * moment / a
    bent = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(a) * (stays * a)[1:] + 0.5 * np.diff(a) * (stays * a)[:-1])])
    apart = bent + across * (a + turning) ** 3 / (3.0 * stiffness)
    return np.asarray(2.0 * np.tan(half) * np.interp(opening, apart, across))


def test_the_theory_of_a_yielding_wedge_without_yield_is_that_of_the_elastic_one() -> None:
    half, opening = radians(10.0), np.array([0.5, 1.0])
    elastic = [wedge_force(apart / tan(half), half, 0.0) for apart in opening]
    np.testing.assert_allclose(yielding_wedge_force(opening, half, E, 1e3), elastic, rtol=1e-5)


# E, yield stress, strength of cohesion, MPa; how wide the wedge opens the beam, mm; force over that of elastic arms.
YIELDING = ((E, 17.76, 10.0, 1.0, 1.0003), (E, 15.4, 10.0, 1.0, 1.009), (4.0 * E, 28.0, 20.0, 3.0, 1.165))


def split_yielding(
    modulus: float, strength: float, cohesive: float, widest: float, through: int = 4
) -> tuple[History, NDArray[np.bool_]]:
    """Split a beam whose arms yield by a wedge of 20°; also returns the rows of the second half of the opening."""
    depths = widest / tan(radians(10.0))
    mesh = arm(through, 120)
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[mesh.nodes[:, 1] < 1e-9, 1] = True  # free to become thicker: stress along the arm alone
    held[mesh.nodes[:, 2] < -LONG + 1e-9] = True
    material, tool = Material(1e-9, modulus, 0.0, strength), blade(20.0, 100.0, 0.0, 0.5 * depths)
    model = Model(mesh, material, (tool,), element="full", held=held,
                  integration=Integration(mass_scaling=10.0 * modulus, outputs=300),
                  cohesion=Cohesion(cohesive, TOUGHNESS))  # fmt: skip
    history = simulate(model, 2.0)
    return history, history.height[:, 0] < -0.5 * depths


@pytest.mark.slow
@pytest.mark.parametrize(("modulus", "strength", "cohesive", "widest", "more"), YIELDING[1:])
def test_a_wedge_splits_a_beam_that_yields(
    modulus: float, strength: float, cohesive: float, widest: float, more: float
) -> None:
    """Arms that yield ask for `more` times the force by theory; were their root clamped, for 1.31 and 1.78 times."""
    half = radians(10.0)
    history, late = split_yielding(modulus, strength, cohesive, widest)
    opening = -history.height[late, 0] * tan(half)
    expected = yielding_wedge_force(opening, half, modulus, strength)
    elastic = yielding_wedge_force(opening, half, modulus, 1e3)
    assert expected.mean() == pytest.approx(more * elastic.mean(), rel=0.005)
    assert 2.0 * history.force[late, 0, 2].mean() == pytest.approx(expected.mean(), rel=0.06)
    assert history.drift_percent() < 0.5


class Station(NamedTuple):
    shape: Array
    bearing: Array
    rounding: Array
    nose_width: float
    places: NDArray[np.int32]
    columns: NDArray[np.int32]


class Nodes(NamedTuple):
    x: Array


@pytest.mark.parametrize(
    ("width", "rows"),
    [(0.2, [0.9, 0.1, 0.0]), (1.0, [0.5, 0.5, 0.0]), (2.0, [0.25, 0.625, 0.125]), (9.0, [1 / 6, 0.5, 1 / 3])],
)
def test_the_rounding_bears_evenly_from_the_plane_to_half_its_width(width: float, rows: list[float]) -> None:
    """Rows at 0, 0.5 and 1.5 mm bear ∫ N dx / b over 0 < x < b, none beyond the last; the line stays on the plane."""
    nodes = np.zeros((12, 3))
    nodes[:, 0] = np.tile([0.0, 0.5, 1.5], 4)
    shape, places = np.array([[0.1, 0.2, 0.3, 0.4]]), np.arange(4, dtype=np.int32)[None]
    columns = np.arange(12, dtype=np.int32).reshape(4, 3)
    cut = Station(shape, np.ones((1, 3)), np.array([0.75]), width, places, columns)
    bear.py_func(cut, Nodes(nodes), 0, 0)
    np.testing.assert_allclose(cut.bearing[0], 0.75 * np.array(rows) + [0.25, 0.0, 0.0], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("nose", [0.0, 1.0])
def test_a_blade_without_thickness_bears_toughness_and_rounding_alone(nose: float) -> None:
    """Nothing opens: F = (G + F_nose) b over the whole way, and the edge's work is G times the area of 1 × 4 mm²."""
    mesh = brick((2.0, 1.0, 4.0), (8, 4, 16))
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[mesh.nodes[:, 2] < 1e-9] = True
    law = Cohesion(STRENGTH, TOUGHNESS, nose, 1.0)
    model = Model(mesh, ELASTIC, (blade(30.0, 1e-3, 4.001, 2.0),), held=held, cohesion=law,
                  integration=Integration(mass_scaling=1.0e4, outputs=200))  # fmt: skip
    history = simulate(model, 2.0)
    inside = (history.height[:, 0] < 3.5) & (history.height[:, 0] > 0.5)
    assert 2.0 * history.force[inside, 0, 2].mean() == pytest.approx(TOUGHNESS + nose, rel=0.02)
    work = 2.0 * history.held[-1, :, 0]
    assert work[EDGE] + work[COHESION] == pytest.approx(TOUGHNESS * 4.0, rel=0.02)
    assert work[SURFACE] == pytest.approx(nose * 4.0, rel=0.02, abs=0.01)
    assert history.drift_percent() < 0.5


def test_a_thick_blade_shares_the_toughness_with_the_opening_ahead_of_it() -> None:
    """Part by tension and the rest by the edge, G times the area together."""
    mesh = brick((2.0, 1.0, 4.0), (8, 4, 16))
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 1] = True
    held[mesh.nodes[:, 2] < 1e-9, 2] = True
    model = Model(mesh, ELASTIC, (blade(30.0, 0.1, 4.001, 2.0),), held=held, cohesion=Cohesion(STRENGTH, TOUGHNESS),
                  integration=Integration(mass_scaling=1.0e4, outputs=200))  # fmt: skip
    history = simulate(model, 2.2)
    by_edge, by_tension = 2.0 * history.held[-1, EDGE, 0], 2.0 * history.held[-1, COHESION, 0]
    assert by_edge + by_tension == pytest.approx(TOUGHNESS * 4.0, rel=0.03)
    assert min(by_edge, by_tension) > 0.2 * (by_edge + by_tension)
    assert history.parted[-1] == pytest.approx(1.0, abs=1e-3)
