"""Hourglass control: the four hourglass modes meet resistance, rigid and uniform ones do not."""

from collections.abc import Callable

import numpy as np
import oracle
import pytest
from driven import NO_VISCOSITY, advance, distorted, row, stresses
from exact import EXACT
from hypothesis import given, settings
from hypothesis import strategies as st

from stemcal.fem.kernels.block import HOURGLASS_ENERGY, HOURGLASS_FORCE, STRESS
from stemcal.fem.kernels.hourglass import DAMPING
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Model
from stemcal.fem.state import State, start

ELASTIC = Material(1e-9, 100.0, 0.3)
SMALL = 1e-6


# What moving there in one step takes over what is stored: ½ a q² is stored, β a q² goes into damping.
AT_ONCE = 1.0 + 2.0 * DAMPING


def at_rest(state: State, x: np.ndarray) -> np.ndarray:
    """Move every node to x in one step and stay for another: without motion nothing is damped."""
    advance(state, x)
    return advance(state, x)


def stiffness_matrix(mesh: Mesh, **kind: object) -> np.ndarray:
    """Return the element's 24×24 tangent stiffness, by a small displacement of every corner in turn."""
    columns = []
    for corner in range(8):
        for i in range(3):
            state = start(Model(mesh, ELASTIC, viscosity=NO_VISCOSITY, **kind))
            x = mesh.nodes.copy()
            x[mesh.hexes[0, corner], i] += SMALL
            columns.append(-advance(state, x)[mesh.hexes[0]].ravel() / SMALL)
    return np.array(columns).T


@pytest.mark.parametrize(
    ("kind", "zeros"), [({"hourglass": 0.1}, 6), ({"hourglass": 0.0}, 18)], ids=["with hourglass control", "without"]
)
def test_rank_of_the_stiffness(kind: dict[str, object], zeros: int) -> None:
    """24 − 6 rigid modes = 18 for a sound element; the bare one-point element has 12 hourglass modes more to lose.

    Zero means below 1e-5 of the largest eigenvalue: the difference quotient is good to its step, 1e-6.
    """
    values = np.linalg.eigvals(stiffness_matrix(distorted((1, 1, 1), 0.2, seed=4), **kind))
    assert np.sum(np.abs(values) < 1e-5 * np.abs(values).max()) == zeros
    assert np.all(values.real > -1e-5 * np.abs(values).max())


@pytest.mark.parametrize("coefficient", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("mode", range(4))
def test_stiffness_force_on_a_cube(mode: int, coefficient: float) -> None:
    """OpenRadioss, s_hg5.F: f = 0.038 · coefficient · (λ+2μ) V^⅓ (Γ·u) Γ, and Γ·Γ = 8 for u = aΓ."""
    h, a = 2.0, 1e-6
    wave_modulus = 100.0 * 0.7 / (1.3 * 0.4)
    mesh = brick((h, h, h), (1, 1, 1))
    for axis in range(3):
        state = start(Model(mesh, ELASTIC, hourglass=coefficient, viscosity=NO_VISCOSITY))
        x = mesh.nodes.copy()
        x[mesh.hexes[0], axis] += a * oracle.GAMMA[mode]
        f = at_rest(state, x)[mesh.hexes[0]]
        wanted = np.zeros((8, 3))
        wanted[:, axis] = -0.304 * coefficient * wave_modulus * h * a * oracle.GAMMA[mode]
        np.testing.assert_allclose(f, wanted, atol=1e-5 * np.abs(wanted).max())
        energy = 0.5 * a * 8.0 * np.abs(wanted).max()
        np.testing.assert_allclose(row(state, HOURGLASS_ENERGY), AT_ONCE * energy, rtol=1e-5)


def test_a_pattern_that_swings_is_damped() -> None:
    """f = −k (q + βΔt q̇): a swing of a free cube dies by β(ωΔt)²/2 a step, and what it loses is booked."""
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    state = start(Model(mesh, ELASTIC, hourglass=0.01, viscosity=NO_VISCOSITY))
    pattern, mass = np.zeros((8, 3)), 1e-9 / 8.0
    pattern[mesh.hexes[0], 1] = oracle.GAMMA[0]
    # 64 a of the whole pattern over the mass of the cube
    omega = np.sqrt(64.0 * 0.038 * 0.01 * 100.0 * 0.7 / (1.3 * 0.4) / 1e-9)
    dt, steps = 0.1 / omega, 1200
    v, x = 1e-2 * pattern, mesh.nodes.copy()
    energy, sizes = 0.5 * mass * np.sum(v**2), []
    for _ in range(steps):
        x = x + dt * v
        v = v + dt / mass * advance(state, x, dt)
        sizes.append(np.sum(pattern * (x - mesh.nodes)) / 8.0)
    first, last = np.abs(sizes[:32]).max(), np.abs(sizes[-32:]).max()
    assert last / first == pytest.approx(np.exp(-0.5 * DAMPING * 0.1**2 * (steps - 32)), rel=0.05)
    left = 0.5 * mass * np.sum(v**2) + float(row(state, HOURGLASS_ENERGY)[0])
    assert left == pytest.approx(energy, rel=0.02)


@pytest.mark.parametrize("pressure", [0.0, 20.0, 300.0])
def test_pressure_does_not_make_a_cube_lose_its_patterns(pressure: float) -> None:
    """V = l³ + (4l/3)(a₅b₄ − a₄b₅) + …: pressure pushes a = b apart with (4l/3)p, the resistance is 64·0.038 h(λ+2μ)l.

    At 20 MPa the plain resistance of h = 0.01, 0.51 MPa of l, has less than it takes, 0.42 MPa, times three: it is
    three times that then. So a pattern in x and one in y always cost energy together.
    """
    h, a, coefficient = 2.0, 1e-6, 0.01
    wave_modulus = 1000.0 * 0.7 / (1.3 * 0.4)
    mesh = brick((h, h, h), (1, 1, 1))
    state = start(Model(mesh, Material(1e-9, 1000.0, 0.3), hourglass=coefficient,
                        viscosity=NO_VISCOSITY, integration=EXACT))  # fmt: skip
    state.body.state[:, STRESS : STRESS + 3] = -pressure
    x, pattern = mesh.nodes.copy(), np.zeros((8, 3))
    pattern[:, 0], pattern[:, 1] = oracle.GAMMA[1], oracle.GAMMA[0]
    before = -pressure * volume_gradient(mesh.nodes[mesh.hexes[0]])
    x[mesh.hexes[0]] += a * pattern
    resisted = -np.sum((at_rest(state, x)[mesh.hexes[0]] + before) * pattern) / a
    own = 64.0 * max(0.038 * coefficient * wave_modulus, 3.0 * pressure / 48.0) * h
    assert resisted == pytest.approx(2.0 * own - 2.0 * pressure * 4.0 * h / 3.0, rel=1e-3) and resisted > 0.0


def volume_gradient(x: np.ndarray) -> np.ndarray:
    """Return ∂V/∂x (8, 3) of a hexahedron."""
    b, volume = oracle.mean_b_matrix(x)
    return np.asarray(volume * b)


def test_a_coefficient_that_is_a_cubes_own_bending() -> None:
    """Pure bending u = κxy of a cube with ν = 0 holds ½E κ² I h, I = h⁴/12; ⅙ / 0.304 stores just that."""
    h, kappa = 2.0, 1e-5
    mesh = brick((h, h, h), (1, 1, 1))
    own = 1 / 6 / 0.304
    state = start(Model(mesh, Material(1e-9, 100.0, 0.0), hourglass=own, viscosity=NO_VISCOSITY))
    x = mesh.nodes.copy()
    x[:, 0] += kappa * (mesh.nodes[:, 0] - 1.0) * (mesh.nodes[:, 1] - 1.0)
    advance(state, x)
    stored = 0.5 * 100.0 * kappa**2 * h**4 / 12.0 * h
    np.testing.assert_allclose(row(state, HOURGLASS_ENERGY), AT_ONCE * stored, rtol=1e-4)


def uniform(x: np.ndarray) -> np.ndarray:
    return x + x @ np.array([[0.02, 0.05, -0.01], [-0.03, 0.01, 0.04], [0.02, 0.0, -0.03]]).T


def shifted(x: np.ndarray) -> np.ndarray:
    return x + np.array([0.3, -0.2, 0.1])


@pytest.mark.parametrize("move", [uniform, shifted])
def test_uniform_motions_meet_no_hourglass_force(move: Callable[[np.ndarray], np.ndarray]) -> None:
    """γ = Γ − (Γ·x) B is orthogonal to every linear field, on any shape. Tolerance: round-off of E h."""
    mesh = distorted((2, 2, 2), 0.25, seed=8)
    state = start(Model(mesh, ELASTIC, viscosity=NO_VISCOSITY, hourglass=0.1, integration=EXACT))
    advance(state, move(mesh.nodes))
    assert np.abs(row(state, slice(HOURGLASS_FORCE, HOURGLASS_FORCE + 12))).max() < 1e-12


@given(seed=st.integers(0, 10**6))
@settings(max_examples=20, deadline=None)
def test_forces_of_an_element_balance(seed: int) -> None:
    """Σf = 0 and Σ x×f = 0 for any shape, stress and hourglass force: nothing pulls or turns itself."""
    random = np.random.default_rng(seed)
    mesh = distorted((1, 1, 1), 0.2, seed)
    state = start(Model(mesh, ELASTIC, hourglass=0.1, integration=EXACT))
    for _ in range(2):
        f = advance(state, state.body.x + random.uniform(-0.05, 0.05, (8, 3)))
    scale = np.abs(f).max()
    np.testing.assert_allclose(f.sum(axis=0), 0.0, atol=1e-13 * scale)
    np.testing.assert_allclose(np.cross(state.body.x, f).sum(axis=0), 0.0, atol=1e-12 * scale)


def test_hourglass_stretch_leaves_no_stress_in_a_cube() -> None:
    """The one point in the middle sees none of the four modes, which is why they need a force of their own."""
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    for mode in range(4):
        state = start(Model(mesh, ELASTIC, viscosity=NO_VISCOSITY))
        x = mesh.nodes.copy()
        x[mesh.hexes[0], 2] += 1e-3 * oracle.GAMMA[mode]
        advance(state, x)
        assert np.abs(stresses(state)).max() < 1e-4
