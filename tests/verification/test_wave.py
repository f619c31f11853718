"""An elastic wave in a bar with ν = 0: speed c = √(E/ρ), stress ρ c v behind it, and what its two ends do to it.

Graff, *Wave Motion in Elastic Solids*, 1975, ch. 2. One end is driven at v from t = 0; behind the front the bar moves
at v under the stress ρ c v = E v/c. A free end sends it back with the stress taken away and the velocity doubled, a
fixed one with the stress doubled and the velocity gone.
"""

from functools import cache

import numpy as np
import pytest
from driven import record

from stemcal.fem.kernels.block import STRESS
from stemcal.fem.material import BulkViscosity, Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import State

LENGTH, E, RHO = 100, 1000.0, 1e-9
C = np.sqrt(E / RHO)
V = 1e-3 * C  # strains of 1e-3
STRESS_BEHIND = RHO * C * V


@cache
def bar(end: str, push: float = 1.0, mass_scaling: float = 1.0) -> tuple[np.ndarray, ...]:
    """Return times in units of L/c, axial stress (times, elements) and velocity (times, layers of nodes).

    100 cubes, the near end driven at `push`·V towards the bar; linear bulk viscosity of 0.06 smears a compressive
    front over some elements.
    """
    mesh = brick((float(LENGTH), 1.0, 1.0), (LENGTH, 1, 1))
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 1:] = True
    held[mesh.nodes[:, 0] < 0.5, 0] = True
    if end == "fixed":
        held[mesh.nodes[:, 0] > LENGTH - 0.5, 0] = True
    velocity = np.zeros_like(mesh.nodes)
    velocity[mesh.nodes[:, 0] < 0.5, 0] = push * V / np.sqrt(mass_scaling)
    model = Model(mesh, Material(RHO, E, 0.0), held=held, velocity=velocity,
                  viscosity=BulkViscosity(0.06, 0.0),
                  integration=Integration(mass_scaling=mass_scaling, safety=0.8))  # type: ignore[arg-type]  # fmt: skip
    transit = LENGTH / C * np.sqrt(mass_scaling)

    def look(state: State) -> np.ndarray:
        stress = state.lanes.gathered(state.body.state[:, STRESS])
        return np.concatenate([stress, state.body.v[:, 0].reshape(-1, 4).mean(axis=1) * np.sqrt(mass_scaling)])

    times, seen = record(model, np.linspace(0.0, 1.9 * transit, 381)[1:], look)
    return times / transit, seen[:, :LENGTH], seen[:, LENGTH:]


@pytest.mark.parametrize("mass_scaling", [1.0, 1.0e4])
def test_speed_and_stress(mass_scaling: float) -> None:
    """Arrival at half stress in two elements 60 apart, and the plateau behind the front.

    Tolerances: 1 % of the speed (0.5 % is the resolution of the record), 0.5 % of the stress in the mean of 20
    elements. With mass scaling all runs slower by its root, so the stress of the same strain stays.
    """
    times, stress, velocity = bar("free", 1.0, mass_scaling)
    arrivals = [np.interp(0.5 * STRESS_BEHIND, -stress[:200, e], times[:200]) for e in (20, 80)]
    assert (arrivals[1] - arrivals[0]) / 0.6 == pytest.approx(1.0, rel=0.01)
    assert arrivals[0] == pytest.approx(0.205, abs=0.01)
    now = int(np.searchsorted(times, 0.9))
    assert stress[now, 20:40].mean() == pytest.approx(-STRESS_BEHIND, rel=0.005)
    assert velocity[now, 20:40].mean() == pytest.approx(V, rel=0.005)
    assert np.abs(stress[now, 97:]).max() < 0.05 * STRESS_BEHIND  # nothing runs ahead of the front


def test_a_free_end_doubles_the_velocity_and_takes_the_stress_away() -> None:
    """At 1.6 L/c the front is on its way back at 0.4 L; beyond it the bar moves at 2v free of stress. 2 % of each."""
    times, stress, velocity = bar("free")
    now = int(np.searchsorted(times, 1.6))
    assert velocity[now, 60:80].mean() == pytest.approx(2.0 * V, rel=0.02)
    assert abs(stress[now, 60:80].mean()) < 0.02 * STRESS_BEHIND
    assert stress[now, 10:25].mean() == pytest.approx(-STRESS_BEHIND, rel=0.01)


def test_a_fixed_end_doubles_the_stress_and_stops_the_bar() -> None:
    times, stress, velocity = bar("fixed")
    now = int(np.searchsorted(times, 1.6))
    assert stress[now, 60:80].mean() == pytest.approx(-2.0 * STRESS_BEHIND, rel=0.02)
    assert abs(velocity[now, 60:80].mean()) < 0.02 * V
    assert stress[now, 10:25].mean() == pytest.approx(-STRESS_BEHIND, rel=0.01)


def test_tension_is_compression_upside_down() -> None:
    """Pulled in place of pushed, without bulk viscosity (off in expansion): the front rings, its mean is the same."""
    times, stress, _ = bar("free", push=-1.0)
    now = int(np.searchsorted(times, 0.9))
    assert stress[now, 10:50].mean() == pytest.approx(STRESS_BEHIND, rel=0.01)
