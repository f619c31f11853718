"""Rigid motions make no stress and turn the stress there is."""

from math import cos, pi, sin

import numpy as np
import oracle
import pytest
from driven import NO_VISCOSITY, advance, distorted, stresses
from exact import EXACT

from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Model
from stemcal.fem.state import State, start

ELASTIC = Material(1e-9, 100.0, 0.3)
AXIS = np.array([2.0, -1.0, 2.0]) / 3.0


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return Rodrigues' rotation matrix."""
    w = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + sin(angle) * w + (1.0 - cos(angle)) * w @ w


def model() -> Model:
    mesh = distorted((2, 2, 2), 0.2, seed=2)
    return Model(mesh, ELASTIC, viscosity=NO_VISCOSITY, hourglass=0.1, integration=EXACT)


def turned(state: State, x: np.ndarray, angle: float, steps: int) -> np.ndarray:
    """Turn the body about AXIS in equal steps; returns the nodal forces at the end."""
    for n in range(1, steps + 1):
        forces = advance(state, x @ rotation(AXIS, angle * n / steps).T)
    return forces


def test_translation_gives_no_stress() -> None:
    """A jump of 10 mm in one step; the stress left is E times the round-off of positions, 1e-16 · 10/1."""
    state = start(model())
    forces = advance(state, state.body.x + np.array([3.0, -10.0, 7.0]))
    assert np.abs(stresses(state)).max() < 1e-12
    assert np.abs(forces).max() < 1e-12


def test_a_quarter_turn_strains_by_the_fourth_power_of_the_step() -> None:
    """One step by θ strains by θ⁴/4 across the axis: sym(A + ½A²) of A = I − R(−θ) is 3/2 − 2 cos θ + ½ cos 2θ.

    So 90° in n steps leaves n θ⁴/4: 1.4e-6·π/2/4 … and an eighth of it in twice the steps. Without the term ½A² it
    would be n θ²/2, a thousand times more.
    """
    worst = []
    for steps in (45, 90):
        state = start(model())
        turned(state, state.body.x.copy(), pi / 2, steps)
        theta = pi / 2 / steps
        strain = steps * theta**4 / 4.0
        # both directions across the axis are strained alike: pressure −(K + G/3)·2ε + …, at most (λ+μ)·2ε
        lame, mu = 100.0 * 0.3 / (1.3 * 0.4), 100.0 / 2.6
        worst.append(np.linalg.norm(oracle.symmetric(stresses(state)[0]), 2) / (2.0 * (lame + mu) * strain))
    np.testing.assert_allclose(worst, 1.0, atol=0.01)


def test_stress_turns_with_the_body() -> None:
    """A strained body turned by 90° carries R σ Rᵀ, and its nodal forces are R f.

    Error of the angle: Hughes and Winget's tan(½φ) = ½ω with ω = θ + θ³/3 turns by θ + θ³/4 per step, 180·θ³/4 =
    3.0e-5 rad in ½° steps, a quarter of that in half steps. The measured ratio must be 4 within 5 % (the θ⁴ of the
    test above adds to the coarser one).
    """
    errors = []
    for steps in (180, 360):
        state = start(model())
        x = state.body.x @ (np.eye(3) + 0.1 * np.array([[1.0, 2.0, 0.0], [0.0, -1.0, 1.0], [0.5, 0.0, 3.0]])).T
        before = advance(state, x)
        sigma = oracle.symmetric(stresses(state)[0])
        after = turned(state, x, pi / 2, steps)
        R = rotation(AXIS, pi / 2)
        found = oracle.symmetric(stresses(state)[0])
        scale = np.abs(sigma - np.trace(sigma) / 3.0 * np.eye(3)).max()
        errors.append(np.abs(found - R @ sigma @ R.T).max() / scale)
        np.testing.assert_allclose(after, before @ R.T, atol=1e-3 * np.abs(before).max())
    assert errors[0] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def sheared(gamma: float, steps: int) -> np.ndarray:
    """Return the stresses after simple shear u = γ y."""
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    state = start(Model(mesh, ELASTIC, viscosity=NO_VISCOSITY, hourglass=0.1))
    for part in np.linspace(0.0, gamma, steps + 1)[1:]:
        advance(state, mesh.nodes @ np.array([[1.0, part, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).T)
    return stresses(state)


@pytest.mark.parametrize("gamma", [0.5, 1.0, 2.0])
def test_simple_shear_of_the_jaumann_rate(gamma: float) -> None:
    """Dienes, Acta Mechanica 32, 217-232 (1979): τ = G sin γ, σ_xx = −σ_yy = G (1 − cos γ).

    The step's strain is added unturned, so the errors are ½Δγ G sin γ and ½Δγ G (1 − cos γ), of first order; what
    two runs extrapolate to is good to 1e-4 G. A Green-Naghdi rate would be off by 7 % at γ = 1 and 40 % at γ = 2.
    """
    coarse, fine = sheared(gamma, 100), sheared(gamma, 200)
    tau, sigma = sin(gamma), 1.0 - cos(gamma)
    wanted = ELASTIC.shear_modulus * np.array([sigma, -sigma, 0.0, tau, 0.0, 0.0])
    for one, two in zip(coarse, fine, strict=True):
        np.testing.assert_allclose(2.0 * two - one, wanted, atol=1e-4 * ELASTIC.shear_modulus)
        assert np.abs(two - wanted).max() < 0.55 * gamma / 200 * ELASTIC.shear_modulus * max(tau, sigma)
