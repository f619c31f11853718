"""Single elements: patch test, rigid rotation, hourglass modes."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import oracle
from driven import NO_VISCOSITY, advance, boundary, distorted, row, stresses
from test_hourglass import AT_ONCE, SMALL, at_rest, stiffness_matrix, uniform
from test_objectivity import AXIS, model, rotation, sheared, turned
from test_patch import ELASTIC, PLASTIC, F

from stemcal.fem.kernels.block import HOURGLASS_ENERGY, HOURGLASS_FORCE
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Model
from stemcal.fem.state import start
from verification.case import SINGLE, Case, Topic

CUBE = brick((2.0, 2.0, 2.0), (1, 1, 1))


def patch() -> Topic:
    """Stretch a distorted mesh uniformly, elastic and through yield."""
    spread, interior = np.max([patched(material) for material in (ELASTIC, PLASTIC)], axis=0)
    source = "Irons and Razzaque 1972"
    cases = [
        Case("variation of the stress over the mesh", spread, 0.0, SINGLE, source, relative=False),
        Case("residual force on interior nodes", interior, 0.0, SINGLE, source, relative=False),
    ]
    text = (
        "A uniform deformation gradient is applied in four steps to the nodes of a randomly distorted mesh of 3 × 3 × "
        "3 elements. The patch test is run with an elastic material and with an elastic-plastic material that has "
        "hardening and rate dependence. For each quantity, only the larger of the errors for the two materials is "
        "listed. The stress in the mesh must be uniform, and the forces on interior nodes must be zero. The errors in "
        "the patch test are relative to the largest stress or force."
    )
    return Topic("Patch test", text, tuple(cases))


def patched(material: Material) -> tuple[float, float]:
    """Return the spread of the stress and the largest force on an inner node, over the largest of each."""
    mesh = distorted((3, 3, 3), 0.25, seed=3)
    state = start(Model(mesh, material, viscosity=NO_VISCOSITY, hourglass=0.1))
    for part in (0.25, 0.5, 0.75, 1.0):
        forces = advance(state, mesh.nodes + part * mesh.nodes @ F.T)
    found = stresses(state)
    inner = np.abs(forces[~boundary(mesh)]).max()
    return float(np.ptp(found, axis=0).max() / np.abs(found).max()), float(inner / np.abs(forces).max())


def objectivity() -> Topic:
    """Turn a strained body; shear one by γ = 1 and 2."""
    cases = []
    error, ratio = turning_error()
    text = "error of the stress after a quarter turn"
    cases.append(Case(text, error, 0.0, 1e-4, "Hughes and Winget 1980", relative=False))
    cases.append(Case("error over that at twice the steps", ratio, 4.0, 0.05, "Hughes and Winget 1980"))
    for gamma in (1.0, 2.0):
        found = (2.0 * sheared(gamma, 200) - sheared(gamma, 100))[0] / ELASTIC.shear_modulus
        for name, value, exact in (("τ", found[3], sin(gamma)), ("σxx", found[0], 1.0 - cos(gamma))):
            text = f"{name}/G in simple shear, γ = {gamma:g}"
            cases.append(Case(text, value, exact, 1e-4, "Dienes 1979", relative=False))
    text = (
        "If a strained body is rotated by 90°, the stress tensor must rotate with the body. The rotation is simulated "
        "in steps of half a degree. The error in the rotated stress is relative to the largest deviatoric stress. If "
        "the rotation step is halved, the error in the stress must decrease to a quarter of its value. With the "
        "Jaumann rate, the exact stresses in simple shear are τ = G sin γ and σxx = G (1 − cos γ), where G is the "
        "shear modulus. The stresses in simple shear are computed with two step sizes and extrapolated to a step size "
        "of zero."
    )
    return Topic("Rigid rotation", text, tuple(cases))


def turning_error() -> tuple[float, float]:
    """Return the error of the stress after 90° in 180 steps over its deviator, and its ratio to that in 360 steps."""
    errors = []
    for steps in (180, 360):
        state = start(model())
        x = state.body.x @ (np.eye(3) + 0.1 * np.array([[1.0, 2.0, 0.0], [0.0, -1.0, 1.0], [0.5, 0.0, 3.0]])).T
        advance(state, x)
        sigma = oracle.symmetric(stresses(state)[0])
        turned(state, x, pi / 2, steps)
        R = rotation(AXIS, pi / 2)
        deviator = sigma - np.trace(sigma) / 3.0 * np.eye(3)
        errors.append(np.abs(oracle.symmetric(stresses(state)[0]) - R @ sigma @ R.T).max() / np.abs(deviator).max())
    return float(errors[0]), float(errors[0] / errors[1])


def hourglass() -> Topic:
    """Count the modes that nothing resists; measure the force on each of the four."""
    source = "Flanagan and Belytschko 1981"
    kinds = {
        "with hourglass control": ({"hourglass": 0.1}, 6),
        "without hourglass control": ({"hourglass": 0.0}, 18),
    }
    cases = [
        Case(f"{name}: zero-energy modes", free_modes(kind), exact, 0.0, source, relative=False)
        for name, (kind, exact) in kinds.items()
    ]
    cases += [
        Case(f"force along mode {mode + 1} over 8 · 0.038 c (λ+2μ) h a", mode_force(mode), 1.0, 1e-5, source)
        for mode in range(4)
    ]
    cases.append(Case("c = 0.548: energy in bending over beam theory", bending_energy(), 1.0, 1e-4, source))
    text = "hourglass force in uniform deformation"
    cases.append(Case(text, uniform_force(), 0.0, SINGLE, source, "N", relative=False))
    text = (
        "A hexahedral element must resist all of its 24 modes of motion except the 6 rigid-body modes. Without "
        "hourglass control, an element with a single integration point has twelve additional zero-energy modes. "
        "Hourglass control must resist each of the four hourglass patterns of a cubic element. In a cube of edge "
        "length h, an hourglass mode of amplitude a must cause corner forces of 8 · 0.038 c (λ+2μ) h a, where c is the "
        "hourglass coefficient. A uniform deformation must not cause hourglass forces. With an hourglass coefficient "
        "of 0.548 and ν = 0, the hourglass energy of a cube in bending must equal its bending energy in beam theory."
    )
    return Topic("Hourglass modes", text, tuple(cases))


def free_modes(kind: dict[str, object]) -> int:
    """Return how many motions of a distorted element meet no force."""
    values = np.abs(np.linalg.eigvals(stiffness_matrix(distorted((1, 1, 1), 0.2, seed=4), **kind)))
    return int(np.sum(values < 1e-5 * values.max()))


def mode_force(mode: int, coefficient: float = 0.1) -> float:
    """Return the force along an hourglass mode of amplitude a, over 8 · 0.038 c (λ+2μ) h a."""
    state = start(Model(CUBE, ELASTIC, hourglass=coefficient, viscosity=NO_VISCOSITY))
    x = CUBE.nodes.copy()
    x[CUBE.hexes[0], 0] += SMALL * oracle.GAMMA[mode]
    force = at_rest(state, x)[CUBE.hexes[0], 0] @ oracle.GAMMA[mode] / 8.0
    return float(-force / (0.304 * coefficient * ELASTIC.p_wave_modulus * 2.0 * SMALL))


def bending_energy(kappa: float = 1e-5) -> float:
    """Return the hourglass energy of a cube of side 2 bent by κ, less what damping took, over ½ E κ² I h."""
    material = Material(1e-9, 100.0, 0.0)
    state = start(Model(CUBE, material, hourglass=1 / 6 / 0.304, viscosity=NO_VISCOSITY))
    x = CUBE.nodes.copy()
    x[:, 0] += kappa * (CUBE.nodes[:, 0] - 1.0) * (CUBE.nodes[:, 1] - 1.0)
    advance(state, x)
    return float(row(state, HOURGLASS_ENERGY)[0] / AT_ONCE / (0.5 * 100.0 * kappa**2 * 2.0**4 / 12.0 * 2.0))


def uniform_force() -> float:
    """Return the largest hourglass force of a distorted mesh under a uniform gradient, N."""
    mesh = distorted((2, 2, 2), 0.25, seed=8)
    state = start(Model(mesh, ELASTIC, viscosity=NO_VISCOSITY, hourglass=0.1))
    advance(state, uniform(mesh.nodes))
    return float(np.abs(row(state, slice(HOURGLASS_FORCE, HOURGLASS_FORCE + 12))).max())
