"""Volume, its derivatives and the mean gradient of the hexahedron against numerical integration, over random shapes."""

import numpy as np
import oracle
import pytest
from called import called
from hypothesis import given, settings
from hypothesis import strategies as st

from stemcal.fem.kernels import hexahedron
from stemcal.fem.kernels.block import HOURGLASS_STIFFNESS
from stemcal.fem.kernels.timestep import stable_step
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import start
from stemcal.fem.stepper import simulate

contract, minors, velocity_gradient = map(
    called, (hexahedron.contract, hexahedron.minors, hexahedron.velocity_gradient)
)
modal_sums, spread = called(hexahedron.modal_sums), called(hexahedron.spread)
rotate_tensor, spin_rotation = called(hexahedron.rotate_tensor), called(hexahedron.spin_rotation)

CUBE = 0.5 * oracle.CORNERS + 0.5
# Corners of a unit cube moved by up to 0.2 in each direction: strongly distorted, never inside out.
seeds = st.integers(0, 2**32 - 1)


def shape(seed: int) -> np.ndarray:
    return CUBE + np.random.default_rng(seed).uniform(-0.2, 0.2, (8, 3))


def modes(f: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(total / 8.0 for total in modal_sums(f))


def minor_derivatives(p: tuple[float, ...], q: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(8.0 * b for b in minors(p, q))


def kernel_b(x: np.ndarray) -> tuple[np.ndarray, float]:
    """Return ∂V/∂x_I (8, 3) and V from the kernels: corner forces of unit stress are the derivatives of the volume."""
    mx, my, mz = (modes(tuple(x[:, i])) for i in range(3))
    columns, parts = [], []
    for a, b, own in ((my, mz, mx), (mz, mx, my), (mx, my, mz)):
        modal = minor_derivatives(a, b)
        columns.append(np.array(spread((0.0, *modal, 0.0))) / 8.0)
        parts.append(contract(own, modal))
    assert parts == pytest.approx([parts[0]] * 3, rel=1e-13)  # each coordinate with its own b is the volume
    return np.array(columns).T, parts[0]


@given(seeds)
@settings(max_examples=40, deadline=None)
def test_volume_and_mean_gradient_equal_gauss_integration(seed: int) -> None:
    """2×2×2 points integrate the cofactors exactly, so both must agree to round-off (1e-13)."""
    x = shape(seed)
    derivative, volume = kernel_b(x)
    mean_b, integrated = oracle.mean_b_matrix(x)
    assert volume == pytest.approx(integrated, rel=1e-13)
    np.testing.assert_allclose(derivative / volume, mean_b, atol=1e-13)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_derivatives_of_the_volume(seed: int) -> None:
    """Central differences of V over every corner; V is cubic but linear in each coordinate: exact but for round-off."""
    x = shape(seed)
    derivative, _ = kernel_b(x)
    h = 1e-3
    for corner in range(8):
        for i in range(3):
            there, back = x.copy(), x.copy()
            there[corner, i] += h
            back[corner, i] -= h
            slope = (kernel_b(there)[1] - kernel_b(back)[1]) / (2.0 * h)
            assert slope == pytest.approx(derivative[corner, i], abs=1e-11)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_volume_equals_five_tetrahedra_of_a_plane_faced_shape(seed: int) -> None:
    """An affine image of the cube has volume det F; translation leaves it."""
    random = np.random.default_rng(seed)
    F = np.eye(3) + random.uniform(-0.3, 0.3, (3, 3))
    mesh = Mesh(CUBE @ F.T + random.uniform(-50.0, 50.0, 3), np.arange(8, dtype=np.int32)[None])
    assert mesh.volumes()[0] == pytest.approx(np.linalg.det(F), rel=1e-11)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_mean_gradient_of_a_linear_field_is_exact(seed: int) -> None:
    random = np.random.default_rng(seed)
    x, gradient = shape(seed), random.uniform(-1.0, 1.0, (3, 3))
    v = x @ gradient.T
    mx, my, mz = (modes(tuple(x[:, i])) for i in range(3))
    b = minor_derivatives(my, mz), minor_derivatives(mz, mx), minor_derivatives(mx, my)
    found = velocity_gradient(*(modes(tuple(v[:, i])) for i in range(3)), *b, 1.0 / contract(mx, b[0]))
    np.testing.assert_allclose(np.reshape(found, (3, 3)), gradient, atol=1e-13)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_modal_sums_and_their_transpose(seed: int) -> None:
    """`modal_sums` is Hᵀ and `spread` its transpose H, H the base vectors at the corners; f = Σ H_m f_m."""
    random = np.random.default_rng(seed)
    base = np.vstack([np.ones(8), oracle.CORNERS.T, oracle.GAMMA])
    f = random.uniform(-1.0, 1.0, 8)
    np.testing.assert_allclose(modal_sums(tuple(f)), base @ f, atol=1e-14)
    np.testing.assert_allclose(spread(tuple(f)), base.T @ f, atol=1e-14)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_rotation_of_a_step_is_orthogonal(seed: int) -> None:
    """Hughes and Winget's R is orthogonal for steps of any size; R s Rᵀ keeps trace and norm."""
    random = np.random.default_rng(seed)
    L, s = random.uniform(-2.0, 2.0, 9), random.uniform(-1.0, 1.0, 6)
    R = np.reshape(spin_rotation(tuple(L), 0.7), (3, 3))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) == pytest.approx(1.0)
    found = oracle.symmetric(rotate_tensor(tuple(R.ravel()), tuple(s)))
    np.testing.assert_allclose(found, R @ oracle.symmetric(s) @ R.T, atol=1e-14)


def largest_frequency(x: np.ndarray, m: object, stiffness: float) -> float:
    """Return ω of the fastest mode of one elastic element on its lumped mass, from B matrices."""
    lame, mu = m.bulk - 2.0 / 3.0 * m.shear, m.shear
    b, volume = oracle.mean_b_matrix(x)
    same = np.einsum("Ik,Jk->IJ", b, b)
    K = lame * volume * np.einsum("Ii,Jj->IiJj", b, b)
    K = K + mu * volume * (np.einsum("IJ,ij->IiJj", same, np.eye(3)) + np.einsum("Ij,Ji->IiJj", b, b))
    for mode in oracle.GAMMA:
        gamma = mode - b @ (x.T @ mode)
        K = K + stiffness / 64.0 * np.einsum("I,J,ij->IiJj", gamma, gamma, np.eye(3))
    values = np.linalg.eigvalsh(K.reshape(24, 24)) / (m.density * volume / 8.0)
    return float(np.sqrt(values[-1]))


def model(x: np.ndarray, poisson: float, hourglass: float = 0.05) -> Model:
    return Model(Mesh(x, np.arange(8, dtype=np.int32)[None]), Material(1e-9, 100.0, poisson),
                 hourglass=hourglass)  # fmt: skip


def estimate(model: Model) -> tuple[float, int, float]:
    """Return the kernel's stable step, the element that sets it and its volume."""
    state = start(model)
    found = stable_step(state.body, state.material)
    return float(found[0]), int(found[1]), float(found[2])


@given(
    seed=seeds,
    poisson=st.sampled_from([0.0, 0.3, 0.45]),
    aspect=st.sampled_from([0.3, 1.0, 3.0]),
    hourglass=st.sampled_from([0.003, 0.03, 0.1]),
)
@settings(max_examples=60, deadline=None)
def test_the_time_step_is_stable(seed: int, poisson: float, aspect: float, hourglass: float) -> None:
    """Δt ≤ 2/ω_max of the fastest free element is enough for any mesh of them (Hughes 1987, sec. 9.2; Irons).

    ω_max from the eigenvalues of the element's 24×24 stiffness, built with B matrices. The estimate itself may be 3 %
    above (it looks at strain and hourglass modes apart), far within the default safety of 0.8.
    """
    x = shape(seed) * np.array([1.0, 1.0, aspect])
    body = model(x, poisson, hourglass)
    state = start(body)
    fastest = largest_frequency(x, state.material, 64.0 * float(state.body.state[0, HOURGLASS_STIFFNESS, 0]))
    assert estimate(body)[0] * fastest <= 2.0 * 1.03


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_time_step_of_a_cube(poisson: float) -> None:
    """The volume mode of a free cube is its fastest, ω² = 4 (3λ + 2μ)/ρh²; with ν = 0, 2/ω is h/c."""
    step, element, volume = estimate(model(3.0 * CUBE, poisson))
    lame, mu = 100.0 * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), 50.0 / (1.0 + poisson)
    assert (element, volume) == (0, pytest.approx(27.0))
    assert step == pytest.approx(3.0 * np.sqrt(1e-9 / (3.0 * lame + 2.0 * mu)), rel=1e-12)
    if poisson == 0.0:
        assert step == pytest.approx(3.0 / np.sqrt(100.0 / 1e-9), rel=1e-12)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
@pytest.mark.parametrize("counts", [(1, 1, 1), (2, 1, 1), (1, 1, 8), (4, 4, 1), (3, 3, 3)])
def test_free_fragments_do_not_blow_up(counts: tuple[int, int, int], poisson: float) -> None:
    """2000 steps of free bodies from random velocities: the energy stays (kinetic energy is seen half a step aside).

    Erosion leaves such pieces; with the wave's time through the element as the step, single ones would grow by a
    factor of two in every step.
    """
    mesh = brick(tuple(float(n) for n in counts), counts)
    velocity = 1e-3 * np.random.default_rng(0).uniform(-1.0, 1.0, mesh.nodes.shape)
    body = Model(mesh, Material(1e-9, 100.0, poisson), velocity=velocity,
                 integration=Integration(outputs=50))  # fmt: skip
    history = simulate(body, 2000.0 * 0.8 * estimate(model(CUBE, poisson))[0])
    energy = history.kinetic + history.internal + history.hourglass
    assert energy.max() < 3.0 * energy[0]
