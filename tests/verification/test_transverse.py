"""Elements with an axis against textbooks: moduli, Hill's yield, hardening, rate and failure at any angle to the pull.

Strains are some 1e-5, so that neither the axis nor the element's shape turns by more than that: E is a million MPa.
"""

from dataclasses import replace
from math import pi

import numpy as np
import oracle
import pytest
from called import called
from driven import NO_VISCOSITY, advance, boundary, distorted, record, row, stresses
from exact import EXACT
from fibres import PAIRS, compliance, hill, pull, strained, turn, turned_brick

from stemcal.fem.kernels.block import ALIVE, PLASTIC_STRAIN, STRESS
from stemcal.fem.kernels.plasticity import rate_factor
from stemcal.fem.kernels.timestep import stable_step
from stemcal.fem.material import BulkViscosity, Layers, Material, Transverse
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import State, start

SIZE = 1.0e6
WOOD = Material(
    1e-9, SIZE, 0.35, yield_stress=30.0, tangent_modulus=0.05 * SIZE,
    transverse=Transverse(SIZE / 10.0, SIZE / 24.0, 0.4, yield_stress=12.0, shear_yield_stress=9.0),
)  # fmt: skip
STEMS = {
    "wood": WOOD,
    "weak along": replace(WOOD, transverse=Transverse(2.0 * SIZE, SIZE, 0.2, 55.0, 30.0)),
    "hemp": replace(WOOD, transverse=Transverse(SIZE / 20.0, SIZE / 54.0, 0.3, 8.0, 6.0)),
}
ANGLES = np.deg2rad([0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0])
PLASTIC_MODULUS = WOOD.plastic_modulus


def element(material: Material, Q: np.ndarray) -> tuple[State, Mesh]:
    """Return the state of one element whose axis is the third column of Q, and its mesh."""
    mesh = turned_brick(Q)
    return start(Model(mesh, material, viscosity=NO_VISCOSITY, integration=EXACT)), mesh


def stress_of(state: State) -> np.ndarray:
    """Return the stress of the first element, (3, 3)."""
    found = np.zeros((3, 3))
    for (i, j), value in zip(PAIRS, stresses(state)[0], strict=True):
        found[i, j] = found[j, i] = value
    return found


# ---- elastic


@pytest.mark.parametrize("name", STEMS)
@pytest.mark.parametrize("angle", ANGLES)
def test_modulus_at_an_angle_to_the_axis(name: str, angle: float) -> None:
    """Under the strain S:σ of a pull along x the stress is that pull: E(θ), ν and the coupling with shear at once.

    1/E(θ) = cos⁴/E_L + (1/G_LT − 2ν_LT/E_L) sin² cos² + sin⁴/E_T, which the turned compliance must have too.
    """
    material, Q = STEMS[name], turn(angle)
    across, c, s = material.transverse, np.cos(angle), np.sin(angle)
    assert across is not None
    S = compliance(material, Q)
    middle = 1.0 / across.shear_modulus - 2.0 * material.poisson_ratio / SIZE
    formula = 1.0 / (c**4 / SIZE + middle * (s * c) ** 2 + s**4 / across.elastic_modulus)
    assert 1.0 / S[0, 0, 0, 0] == pytest.approx(formula, rel=1e-12)
    state, mesh = element(material, Q)
    advance(state, strained(mesh, 0.01 * np.einsum("ijkl,kl", S, pull())))
    np.testing.assert_allclose(100.0 * stress_of(state), pull(), atol=2e-5)


@pytest.mark.parametrize("name", STEMS)
def test_shear_moduli(name: str) -> None:
    """Shear of 1e-5 between axis and across, and within the plane across: G_LT, and G_TT = E_T/2(1 + ν_TT)."""
    material = STEMS[name]
    across = material.transverse
    assert across is not None
    for (i, j), G in {
        (2, 0): across.shear_modulus,
        (1, 2): across.shear_modulus,
        (0, 1): across.elastic_modulus / (2.0 + 2.0 * across.poisson_ratio),
    }.items():
        state, mesh = element(material, np.eye(3))
        strain = np.zeros((3, 3))
        strain[i, j] = strain[j, i] = 0.5e-5
        advance(state, strained(mesh, strain))
        assert stress_of(state)[i, j] == pytest.approx(1e-5 * G, rel=1e-4)


# ---- yield, hardening, reversal


def flow(material: Material, Q: np.ndarray) -> tuple[float, np.ndarray]:
    """Return q per unit pull along x, and the plastic strain per unit of the effective one, ∂q/∂σ."""
    P = hill(material, Q)
    k = float(np.sqrt(P[0, 0, 0, 0]))
    return k, np.einsum("ijkl,kl", P, pull()) / k


@pytest.mark.parametrize("beta", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("angle", ANGLES)
def test_yield_hardening_and_reversal_of_a_pull_at_an_angle(beta: float, angle: float) -> None:
    """A pull to q = X + Eₚ ε̄ and back to yield in compression: the stress follows that of the closed form.

    Uniaxial: q = kσ, ε = S:σ + ε̄ ∂q/∂σ, dε̄ = k dσ/Eₚ. The elastic range in q is 2(X + β Eₚ ε̄) wide. Corners: yield,
    top, reverse yield, and a way into compression; steps end on each. Tolerance 1e-3 of the corner stresses.
    """
    Q = turn(angle)
    material = replace(WOOD, hardening_parameter=beta)
    X, (k, n), S = material.yield_stress, flow(material, Q), compliance(material, Q)
    elastic = np.einsum("ijkl,kl", S, pull())
    top = 2.0e-5
    sigma_top = (X + PLASTIC_MODULUS * top) / k
    lower = sigma_top - 2.0 * (X + beta * PLASTIC_MODULUS * top) / k
    beyond = 1.0e-5
    sigma_beyond = lower - PLASTIC_MODULUS * beyond / k
    corners = [(X / k, 0.0), (sigma_top, top), (lower, top), (sigma_beyond, top - beyond)]
    state, mesh = element(material, Q)
    found, before = [], (0.0, 0.0)
    for sigma, plastic in corners:
        for part in np.linspace(0.0, 1.0, 101)[1:]:
            now = [a + part * (b - a) for a, b in zip(before, (sigma, plastic), strict=True)]
            advance(state, strained(mesh, now[0] * elastic + now[1] * n))
        before = (sigma, plastic)
        found.append(stress_of(state))
    wanted = np.array([sigma for sigma, _ in corners])
    np.testing.assert_allclose(np.array(found)[:, 0, 0], wanted, atol=1e-3 * X / k)
    np.testing.assert_allclose(np.array(found) - wanted[:, None, None] * pull(), 0.0, atol=1e-3 * X)
    np.testing.assert_allclose(row(state, PLASTIC_STRAIN), top + beyond, rtol=1e-3)


def test_yield_in_shear_along_and_across_the_axis() -> None:
    """Axial shear yields at its stress; shear in the plane across at X/√(4 (X/Y)² − 1), which the others imply."""
    across, X = WOOD.transverse, WOOD.yield_stress
    assert across is not None
    plane = SIZE / 10.0 / 2.8
    for (i, j), G, limit in (
        ((2, 0), across.shear_modulus, across.shear_yield_stress),
        ((0, 1), plane, X / np.sqrt(4.0 * (X / across.yield_stress) ** 2 - 1.0)),
    ):
        state, mesh = element(replace(WOOD, tangent_modulus=0.0), np.eye(3))
        strain = np.zeros((3, 3))
        strain[i, j] = strain[j, i] = 1.5 * limit / G / 2.0
        for part in np.linspace(0.0, 1.0, 101)[1:]:
            advance(state, strained(mesh, part * strain))
        assert stress_of(state)[i, j] == pytest.approx(limit, rel=1e-3)


@pytest.mark.parametrize("angle", ANGLES)
def test_rate_factor_at_an_angle(angle: float) -> None:
    """Steady plastic flow at a constant rate: q = s X with s = 1 + (ε̇/C)^(1/P), ε̇ that of the whole strain."""
    Q, c, p = turn(angle), 40.0, 5.0
    material = replace(WOOD, tangent_modulus=0.0, strain_rate_c=c, strain_rate_p=p)
    k, n = flow(material, Q)
    elastic = np.einsum("ijkl,kl", compliance(material, Q), pull())
    state, mesh = element(material, Q)
    step, dt = 2.0e-7, 2.0e-8
    factor = called(rate_factor)(step / dt, c, 1.0 / p)
    assert 1.5 < factor < 2.5
    at_yield = factor * material.yield_stress / k * elastic
    ways = np.linalg.norm(at_yield), 5.0e-5  # of elastic and of plastic strain
    for way in np.arange(step, sum(ways), step):
        plastic = max(way - ways[0], 0.0) * n / np.linalg.norm(n)
        advance(state, strained(mesh, min(way / ways[0], 1.0) * at_yield + plastic), dt)
    assert row(state, PLASTIC_STRAIN)[0] > 1e-5
    assert stress_of(state)[0, 0] == pytest.approx(factor * material.yield_stress / k, rel=1e-3)


@pytest.mark.parametrize("angle", ANGLES)
def test_failure_at_an_angle(angle: float) -> None:
    """An element fails at the effective plastic strain ε_f: across the axis a pull has X/Y times that along itself."""
    Q = turn(angle)
    material = replace(WOOD, tangent_modulus=0.0, failure_strain=3.0e-5)
    k, n = flow(material, Q)
    elastic = np.einsum("ijkl,kl", compliance(material, Q), pull())
    state, mesh = element(material, Q)
    for plastic in np.arange(0.0, 4.0e-5, 1.0e-7):
        advance(state, strained(mesh, material.yield_stress / k * elastic + plastic * n))
        if row(state, ALIVE)[0] == 0.0:
            break
    assert plastic == pytest.approx(material.failure_strain, rel=0.01)
    assert plastic * n[0, 0] == pytest.approx(k * material.failure_strain, rel=0.01)


# ---- motion


def test_stress_and_axis_turn_with_the_body() -> None:
    """A pull turned rigidly by 90° about y, then doubled: the stress and the modulus are those of the turned axis."""
    Q = turn(np.deg2rad(30.0))
    state, mesh = element(WOOD, Q)
    strain = 5.0 * np.einsum("ijkl,kl", compliance(WOOD, Q), pull())
    x = strained(mesh, strain)
    advance(state, x)
    for angle in np.linspace(0.0, pi / 2.0, 721)[1:]:
        c, s = np.cos(angle), np.sin(angle)
        R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        advance(state, x @ R.T)
    np.testing.assert_allclose(stress_of(state), R @ (5.0 * pull()) @ R.T, atol=5e-3)
    advance(state, strained(mesh, 2.0 * strain) @ R.T)
    np.testing.assert_allclose(stress_of(state), R @ (10.0 * pull()) @ R.T, atol=1e-2)


def test_patch_with_a_turned_axis() -> None:
    """Parallel edges ζ in an otherwise irregular mesh: equal stresses, and no forces on interior nodes."""
    plane = distorted((3, 3, 1), 0.25, seed=3)
    base = plane.nodes[plane.nodes[:, 2] < 0.5]
    heights = np.array([0.0, 0.8, 1.9, 3.0])
    nodes = np.concatenate([np.column_stack([base[:, :2], np.full(len(base), h)]) for h in heights])
    order = np.lexsort((nodes[:, 2], np.tile(np.arange(len(base)), len(heights))))
    mesh = brick((3.0, 3.0, 3.0), (3, 3, 3))
    mesh = mesh.moved(nodes[order] @ turn(np.deg2rad(40.0)).T)
    F = 1e-5 * np.array([[6.0, 3.0, -2.0], [-1.0, -4.0, 5.0], [2.0, 1.0, 3.0]])
    state = start(Model(mesh, WOOD, viscosity=NO_VISCOSITY, hourglass=0.1, integration=EXACT))
    for part in (0.25, 0.5, 0.75, 1.0):
        forces = advance(state, mesh.nodes + part * mesh.nodes @ F.T)
    found = stresses(state)
    assert row(state, PLASTIC_STRAIN).min() > 1e-7
    np.testing.assert_allclose(found, np.broadcast_to(found[0], found.shape), atol=1e-10 * np.abs(found).max())
    assert np.abs(forces[~boundary(mesh)]).max() < 1e-10 * np.abs(forces).max()


@pytest.mark.parametrize("wave", ["along", "across", "shear"])
def test_wave_speeds(wave: str) -> None:
    """Plane waves along and across the axis, √(C_LL/ρ) and √(C_TT/ρ), and of shear, √(G_LT/ρ); 1 % of the time.

    C from the inverted matrix of the compliance. The bar's other components are held.
    """
    rho = 1e-9
    material = replace(WOOD, density=rho, yield_stress=np.inf, tangent_modulus=0.0)
    S = compliance(material, np.eye(3))
    C = np.linalg.inv(np.array([[S[i, i, j, j] for j in range(3)] for i in range(3)]))
    modulus = {"along": C[2, 2], "across": C[0, 0], "shear": SIZE / 24.0}[wave]
    axis, moves = {"along": (2, 2), "across": (0, 0), "shear": (2, 0)}[wave]
    counts = [1, 1, 1]
    counts[axis] = 80
    mesh = brick(tuple(float(n) for n in counts), tuple(counts))
    held = np.ones(mesh.nodes.shape, dtype=bool)
    driven = mesh.nodes[:, axis] < 0.5
    held[~driven, moves] = False
    velocity = np.zeros_like(mesh.nodes)
    c = np.sqrt(modulus / rho)
    velocity[driven, moves] = 1e-6 * c
    model = Model(mesh, material, held=held, velocity=velocity, viscosity=BulkViscosity(0.06, 0.0),
                  integration=Integration(safety=0.8))  # fmt: skip
    transit = 80.0 / c
    component = {"along": 2, "across": 0, "shear": 5}[wave]
    at = np.linspace(0.0, 0.95 * transit, 381)[1:]
    times, seen = record(model, at, lambda state: np.abs(row(state, STRESS + component)))
    plateau = 1e-6 * modulus
    arrivals = [times[np.argmax(seen[:, e] > 0.5 * plateau)] for e in (16, 64)]
    assert (arrivals[1] - arrivals[0]) / (48.0 / c) == pytest.approx(1.0, rel=0.01)
    assert seen[-1, 20:40].mean() == pytest.approx(plateau, rel=0.01)


def test_without_a_difference_across_it_is_the_isotropic_law() -> None:
    """E, G, ν and yield stresses of an isotropic material: the same stresses and strains on a cyclic path."""
    plain = Material(1e-9, SIZE, 0.3, 10.0, 0.05 * SIZE, 0.5, 10.0, 5.0)
    trivial = replace(plain, transverse=Transverse(SIZE, SIZE / 2.6, 0.3, 10.0, 10.0 / np.sqrt(3.0)))
    Q = turn(0.7)
    states = [element(material, Q) for material in (plain, trivial)]
    path = (
        3e-5
        * np.sin(np.linspace(0.0, 7.0, 300))[:, None, None]
        * np.array([[1.0, 0.3, -0.2], [0.3, -0.6, 0.5], [-0.2, 0.5, 0.1]])
    )
    for strain in path:
        for state, mesh in states:
            advance(state, strained(mesh, strain))
    assert row(states[0][0], PLASTIC_STRAIN)[0] > 5e-5
    np.testing.assert_allclose(stresses(states[1][0]), stresses(states[0][0]), atol=1e-9)
    np.testing.assert_allclose(row(states[1][0], PLASTIC_STRAIN), row(states[0][0], PLASTIC_STRAIN), rtol=1e-10)


def test_two_layers_share_the_strain() -> None:
    """Two halves of a bar side by side: each has the stress of its own material under one strain."""
    mesh = brick((2.0, 1.0, 1.0), (2, 1, 1))
    soft = Material(1e-9, 100.0, 0.3)
    layers = Layers((soft, replace(soft, elastic_modulus=700.0)), np.array([0, 1]))
    state = start(Model(mesh, layers, viscosity=NO_VISCOSITY, integration=EXACT))
    strain = 1e-6 * np.diag([-0.3, -0.3, 1.0])
    advance(state, strained(mesh, strain))
    np.testing.assert_allclose(stresses(state)[:, 2], [1e-4, 7e-4], rtol=1e-4)


@pytest.mark.parametrize("aspect", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("name", STEMS)
def test_the_time_step_is_stable(name: str, aspect: float) -> None:
    """Δt ≤ 2/ω_max of the fastest free element, and more than half of that: ω_max from its 24×24 stiffness B C B.

    30 irregular elements, with little hourglass stiffness, so that the uniform strains decide.
    """
    material, rng, shares = STEMS[name], np.random.default_rng(1), []
    for _ in range(30):
        x = (oracle.CORNERS / 2.0 + rng.uniform(-0.15, 0.15, (8, 3))) * np.array([1.0, 1.0, aspect])
        model = Model(Mesh(x, np.arange(8, dtype=np.int32)[None]), material, hourglass=1e-3)
        state = start(model)
        b, volume = oracle.mean_b_matrix(x)
        C = np.linalg.inv(_six_by_six(compliance(material, _frame(oracle.CORNERS[:, 2] @ x))))
        B = np.zeros((6, 8, 3))
        for row_, (i, j) in enumerate(PAIRS):
            B[row_, :, i] += b[:, j] if i != j else 0.0
            B[row_, :, j] += b[:, i]
        B = B.reshape(6, 24)
        omega2 = np.linalg.eigvalsh(volume * B.T @ C @ B)[-1] / (material.density * volume / 8.0)
        shares.append(stable_step(state.body, state.material)[0] * np.sqrt(omega2) / 2.0)
    assert max(shares) <= 1.0 + 1e-6
    assert min(shares) > 0.5


def _frame(edge: np.ndarray) -> np.ndarray:
    """Return a rotation whose third column is along an edge."""
    Q, _ = np.linalg.qr(np.column_stack([edge, np.eye(3)]))
    return np.roll(Q, -1, axis=1)


def _six_by_six(S: np.ndarray) -> np.ndarray:
    """Return S (6, 6) of strains whose shears are the engineering ones."""
    twice = [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]
    return np.array(
        [
            [S[i, j, k, l] * f * g for (k, l), g in zip(PAIRS, twice, strict=True)]
            for (i, j), f in zip(PAIRS, twice, strict=True)
        ]
    )
