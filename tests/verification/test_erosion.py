"""An element goes in the very step in which its plastic strain first reaches the failure strain."""

import numpy as np
import pytest
from driven import NO_VISCOSITY, advance, row, stresses
from exact import EXACT

from stemcal.fem.kernels.block import ALIVE, HOURGLASS_FORCE, PLASTIC_STRAIN
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import start
from stemcal.fem.stepper import History, simulate

CUBE = brick((1.0, 1.0, 1.0), (1, 1, 1))


@pytest.mark.parametrize("failure_strain", [0.0095, 0.0305, 0.0495])
def test_failure_at_the_first_step_that_reaches_the_strain(failure_strain: float) -> None:
    """Isochoric tension, E_t = 0: εp grows by the step's strain, so the step of failure is known.

    After yield at q = 3Gε = σ_y, εp = ε − σ_y/3G; the element fails in the first step with εp ≥ fs (half a step
    away from a tie here), and from then on neither holds stress nor gives force.
    """
    material = Material(1e-9, 1000.0, 0.25, 12.0, failure_strain=failure_strain)
    model = Model(CUBE, material, viscosity=NO_VISCOSITY)  # type: ignore[arg-type]
    state = start(model)
    yield_strain = 12.0 / (3.0 * 400.0)
    step = 1e-3
    expected = int(np.ceil((failure_strain + yield_strain) / step - 1e-6))
    for n in range(1, expected + 3):
        f = advance(state, CUBE.nodes * np.exp(n * step * np.array([1.0, -0.5, -0.5])))
        strain = row(state, PLASTIC_STRAIN)[0]
        assert bool(row(state, ALIVE)[0]) == (n < expected)
        if n < expected:
            assert strain == pytest.approx(max(0.0, n * step - yield_strain), abs=1e-6)
            assert strain < failure_strain
            assert np.abs(f).max() > 0.1
        else:
            assert np.all(f == 0.0)
            assert np.all(stresses(state)[0] == 0.0)
            assert np.all(row(state, slice(HOURGLASS_FORCE, HOURGLASS_FORCE + 12)) == 0.0)


def test_reaching_the_strain_exactly_is_failure() -> None:
    """εp = fs fails, εp one unit of round-off below fs does not: ≥, not >. The strain of step 30 serves as fs."""

    def strain_and_life(failure_strain: float) -> tuple[float, float]:
        material = Material(1e-9, 1000.0, 0.25, 12.0, failure_strain=failure_strain)
        state = start(Model(CUBE, material, viscosity=NO_VISCOSITY, integration=EXACT))  # type: ignore[arg-type]
        for n in range(1, 31):
            advance(state, CUBE.nodes * np.exp(n * 1e-3 * np.array([1.0, -0.5, -0.5])))
        return float(row(state, PLASTIC_STRAIN)[0]), float(row(state, ALIVE)[0])

    strain, life = strain_and_life(1.0)
    assert life == 1.0
    assert strain_and_life(strain) == (strain, 0.0)
    assert strain_and_life(float(np.nextafter(strain, 1.0))) == (strain, 1.0)


def pulled(mesh: Mesh, elongation: float, outputs: int) -> History:
    """Pull a bar slowly along x by its last layer of nodes until it breaks; it stands against x = 0, y = 0, z = 0."""
    end = mesh.nodes[:, 0] > mesh.nodes[:, 0].max() - 0.5
    held = mesh.nodes < 1e-9
    held[:, 0] |= end
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 0] = np.where(end, 10.0, 0.0)
    material = Material(1e-9, 1000.0, 0.0, 10.0, 0.0, failure_strain=0.03)
    model = Model(mesh, material, held=held, velocity=velocity,
                  hourglass=0.037, integration=Integration(outputs=outputs, safety=0.8))  # type: ignore[arg-type]  # fmt: skip
    return simulate(model, elongation / 10.0)


def test_energy_of_the_eroded() -> None:
    """Uniaxial with ν = 0: the element has taken ½σ_y²/E + σ_y fs per volume when it goes, and takes it along.

    Tolerance 1 %: per current instead of original volume.
    """
    history = pulled(CUBE, 0.06, 60)
    work = 0.5 * 10.0**2 / 1000.0 + 10.0 * 0.03
    last = int(np.argmax(history.deleted > 0)) - 1
    assert np.expm1(0.03 + 0.01) == pytest.approx(10.0 * history.time[last], abs=1e-3)  # the elongation at failure
    assert history.eroded[last] == 0.0
    assert history.eroded[-1] == pytest.approx(work, rel=0.01)
    assert history.internal[-1] == 0.0
    assert history.external[-1] == pytest.approx(work, rel=0.01)
    assert history.drift_percent() < 0.2


def test_a_notched_bar_breaks_in_its_notch() -> None:
    """Three elements, the inner cross-sections half as large: the middle goes, the ends ring without a mean stress.

    `internal` falls by just what `eroded` gains and the ends turn into motion; the balance is seen within 5 % of the
    work (kinetic energy stands half a step aside of internal energy, and the ends ring at their fastest).
    """
    mesh = brick((3.0, 1.0, 1.0), (3, 1, 1))
    nodes = mesh.nodes.copy()
    nodes[(nodes[:, 0] > 0.5) & (nodes[:, 0] < 2.5), 1:] *= 0.7
    history = pulled(mesh.moved(nodes), 0.1, 100)
    np.testing.assert_array_equal(history.standing, [True, False, True])
    assert history.deleted[-1] == 1
    broken = int(np.argmax(history.deleted > 0))
    assert history.external[-1] == pytest.approx(history.external[broken], rel=0.01)
    assert history.eroded[-1] > 0.4 * history.external[-1]
    assert history.drift_percent() < 5.0


def test_a_node_without_elements_stops_and_takes_its_energy_along() -> None:
    """Both elements of a pair fail: every node is left alone, stands still, and its kinetic energy is in `eroded`."""
    mesh = brick((2.0, 1.0, 1.0), (2, 1, 1))
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 0] = 5.0e4 * (mesh.nodes[:, 0] - 1.0)
    material = Material(1e-9, 1000.0, 0.3, 10.0, failure_strain=0.02)
    how = Integration(outputs=20, safety=0.2)
    history = simulate(Model(mesh, material, velocity=velocity, integration=how), 1e-5)
    assert history.deleted[-1] == 2
    assert history.kinetic[-1] == 0.0
    assert history.internal[-1] == 0.0
    assert history.eroded[-1] == pytest.approx(history.kinetic[0], rel=0.02)
