"""A body that settles, and one that falls to pieces as a whole."""

import numpy as np
import pytest

from stemcal.fem.material import BulkViscosity, Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate


def test_a_loaded_bar_settles_at_its_static_length() -> None:
    """u = F L/EA after some periods, ν = 0."""
    length, force, E = 8.0, 0.5, 1000.0
    mesh = brick((length, 1.0, 1.0), (8, 1, 1))
    held = np.repeat((mesh.nodes[:, :1] < 1e-9), 3, axis=1)
    loads = np.zeros_like(mesh.nodes)
    end = mesh.nodes[:, 0] > length - 1e-9
    loads[end, 0] = 0.25 * force
    period = 4.0 * length / (E / 1e-9) ** 0.5
    model = Model(mesh, Material(1e-9, E, 0.0), held=held, loads=loads, viscosity=BulkViscosity(0.0, 0.0),
                  integration=Integration(outputs=200), settling=0.2)  # fmt: skip
    history = simulate(model, 10.0 * period)
    assert history.x[end, 0].mean() - length == pytest.approx(force * length / E, rel=1e-3)
    assert history.kinetic[-1] < 1e-6 * history.external[-1]
    swinging = simulate(Model(**{**vars(model), "settling": 0.0}), 10.0 * period)
    assert swinging.kinetic[-40:].max() > 0.1 * swinging.external.max()


def test_a_bar_that_fails_as_a_whole_leaves_rows_to_the_end() -> None:
    """All elements reach the failure strain in one step: the rest of the history has no force, and its times."""
    mesh = brick((2.0, 1.0, 1.0), (2, 1, 1))
    ends = (np.abs(mesh.nodes[:, :1] - 1.0) > 0.5) & np.array([[True, False, False]])
    velocity = 0.1 * (mesh.nodes - [1.0, 0.5, 0.5]) * [1.0, -0.5, -0.5]
    material = Material(1e-9, 1000.0, 0.3, 10.0, 0.0, failure_strain=0.02)
    history = simulate(Model(mesh, material, held=ends, velocity=velocity,
                             integration=Integration(mass_scaling=1e6, outputs=50)), 1.0)  # fmt: skip
    assert history.deleted[-1] == 2
    np.testing.assert_allclose(history.time, np.linspace(0.0, 1.0, 51), atol=0.01)
    assert history.external[-1] == history.external[-5]
