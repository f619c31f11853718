"""A simulation that stops being physical stops, and says why in one word."""

import pickle

import numpy as np
import pytest

from stemcal.errors import SimulationFailed
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate

ELASTIC = Material(1e-9, 100.0, 0.3, 2.0, 20.0, failure_strain=0.5)


@pytest.mark.parametrize("node", [0, 13, 26])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_a_number_that_is_not_finite(value: float, node: int) -> None:
    """Wherever it enters: a comparison alone would pass over NaN, and NaN strains would erode the body in silence."""
    mesh = brick((2.0, 2.0, 2.0), (2, 2, 2))
    loads = np.zeros_like(mesh.nodes)
    loads[node, 1] = value
    with pytest.raises(SimulationFailed) as caught:
        simulate(Model(mesh, ELASTIC, loads=loads, integration=Integration(outputs=2)), 1e-3)
    assert caught.value.reason == "nan"


def test_an_element_turned_inside_out() -> None:
    """One face of a cube driven through the opposite one, so fast that no step sees it nearly flat."""
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 0] = np.where(mesh.nodes[:, 0] > 0.5, -1.0e5, 0.0)
    model = Model(mesh, Material(1e-9, 100.0, 0.3), held=np.ones(mesh.nodes.shape, dtype=bool),
                  velocity=velocity, integration=Integration(outputs=2))  # fmt: skip
    with pytest.raises(SimulationFailed, match="element 0") as caught:
        simulate(model, 1e-3)
    assert caught.value.reason == "inverted"


def test_a_mesh_that_begins_inside_out() -> None:
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    with pytest.raises(SimulationFailed, match="initial mesh") as caught:
        simulate(Model(Mesh(mesh.nodes * [1.0, 1.0, -1.0], mesh.hexes), ELASTIC), 1e-3)
    assert caught.value.reason == "inverted"


def test_a_time_step_that_collapses() -> None:
    """A cube squeezed ever more slowly flat: its step goes with its thickness, to 1e-4 of the first."""
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 0] = np.where(mesh.nodes[:, 0] > 0.5, -1000.0, 0.0)
    model = Model(mesh, Material(1e-9, 100.0, 0.3), held=np.ones(mesh.nodes.shape, dtype=bool), velocity=velocity)
    with pytest.raises(SimulationFailed) as caught:
        simulate(model, 2e-3)
    assert caught.value.reason in {"time_step", "inverted"}
    assert "t = 0.00" in str(caught.value)  # at 1 mm / 1000 mm/s = 1 ms, to 20 steps


def test_a_failure_survives_the_way_between_processes() -> None:
    failure = SimulationFailed("nan", "a velocity became infinite or NaN")
    again = pickle.loads(pickle.dumps(failure))
    assert (again.reason, str(again)) == (failure.reason, str(failure))
