"""The patch test: a distorted mesh reproduces a uniform deformation exactly.

Irons and Razzaque (1972); Flanagan and Belytschko (1981) show that the one-point element passes it for any shape only
with the volume-averaged gradient. Every node follows x = F X; whatever the element's shape the velocity gradient is
Ḟ F⁻¹, so all stresses are equal and the forces on interior nodes cancel. Tolerance: 1e-12 of the largest, round-off.
"""

import numpy as np
import pytest
from driven import NO_VISCOSITY, advance, boundary, distorted, record, stresses
from exact import EXACT

from stemcal.fem.material import Material
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import start

F = np.array([[0.06, 0.03, -0.02], [-0.01, -0.04, 0.05], [0.02, 0.01, 0.03]])
ELASTIC = Material(1e-9, 100.0, 0.3)
PLASTIC = Material(1e-9, 100.0, 0.3, 2.0, 20.0, 0.5, 10.0, 4.0)


@pytest.mark.parametrize("material", [ELASTIC, PLASTIC], ids=["elastic", "plastic"])
def test_uniform_gradient_gives_uniform_stress_and_free_interior_nodes(material: Material) -> None:
    mesh = distorted((3, 3, 3), 0.25, seed=3)
    state = start(Model(mesh, material, viscosity=NO_VISCOSITY, hourglass=0.1, integration=EXACT))
    for part in (0.25, 0.5, 0.75, 1.0):
        forces = advance(state, mesh.nodes + part * mesh.nodes @ F.T)
    found = stresses(state)
    np.testing.assert_allclose(found, np.broadcast_to(found[0], found.shape), atol=1e-12 * np.abs(found).max())
    assert np.abs(forces[~boundary(mesh)]).max() < 1e-12 * np.abs(forces).max()


def test_stress_of_a_small_uniform_strain_is_hookes() -> None:
    """σ = λ tr ε I + 2μ ε with λ = Eν/((1+ν)(1−2ν)); the second-order terms of a gradient of 1e-7 are 1e-7."""
    mesh = distorted((2, 2, 2), 0.25)
    state = start(Model(mesh, ELASTIC, viscosity=NO_VISCOSITY, hourglass=0.1))
    gradient = 1e-7 * F / np.abs(F).max()
    advance(state, mesh.nodes + mesh.nodes @ gradient.T)
    strain = 0.5 * (gradient + gradient.T)
    lame, mu = 100.0 * 0.3 / (1.3 * 0.4), 100.0 / 2.6
    sigma = lame * np.trace(strain) * np.eye(3) + 2.0 * mu * strain
    wanted = [sigma[0, 0], sigma[1, 1], sigma[2, 2], sigma[0, 1], sigma[1, 2], sigma[2, 0]]
    np.testing.assert_allclose(stresses(state), np.tile(wanted, (len(stresses(state)), 1)), atol=1e-6 * max(wanted))


def test_uniformly_stretching_body_moves_on_as_it_began() -> None:
    """In time: v = A X on all nodes, the boundary driven. x = (I + t A) X solves the equations of motion exactly.

    The interior nodes are free, so after 100 steps and a strain of 3 % they are still on it to round-off.
    """
    mesh = distorted((3, 3, 3), 0.2, seed=5)
    velocity = 1.0e4 * mesh.nodes @ F.T
    held = np.repeat(boundary(mesh)[:, None], 3, axis=1)
    model = Model(mesh, ELASTIC, held=held, velocity=velocity, viscosity=NO_VISCOSITY, hourglass=0.1,
                  integration=Integration(safety=0.2))  # fmt: skip
    (end,), (x,) = record(model, np.array([5.0e-5]), lambda state: state.body.x.copy())
    np.testing.assert_allclose(x, mesh.nodes + end * velocity, atol=1e-12 * 3.0)
