"""The compiled elements against their NumPy twins in `oracle`, which share no code with them.

The twins use shape functions, B matrices and γ vectors where the kernels work in modes, so agreement to round-off
says that both are the same element. Tolerance: 1e-10 of the largest value of its kind, about 10⁵ units of round-off,
which the sums over eight points and the condition of distorted Jacobians use up.
"""

import numpy as np
import oracle
import pytest
from exact import EXACT

from stemcal.fem.kernels import block as rows
from stemcal.fem.kernels.block import LANES
from stemcal.fem.kernels.element import add_internal_forces
from stemcal.fem.kernels.nodes import copy_for_elements
from stemcal.fem.material import BulkViscosity, Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import State, start

DT = 1.0e-3
BACK_STRESS = slice(6, 12)
MATERIALS = {
    "elastic": Material(1e-9, 100.0, 0.3),
    "kinematic": Material(1e-9, 100.0, 0.3, 2.0, 20.0, 0.0, failure_strain=0.5),
    "mixed with Cowper-Symonds": Material(1e-9, 100.0, 0.2, 2.0, 20.0, 0.4, 5.0, 3.0, 0.27),
    "isotropic, the paper's law": Material(1e-9, 100.0, 0.45, 2.0, 20.0, 1.0, 5.0, 3.0, 0.27, rate_law="paper"),
}


def distorted(counts: tuple[int, int, int], by: float, seed: int) -> Mesh:
    mesh = brick(tuple(float(n) for n in counts), counts)
    return mesh.moved(mesh.nodes + np.random.default_rng(seed).uniform(-by, by, mesh.nodes.shape))


def random_state(material: Material) -> State:
    """27 distorted elements, 5 of them dead (and lanes left empty), in the middle of something violent."""
    random = np.random.default_rng(7)
    viscosity = BulkViscosity(0.1, 1.5)
    model = Model(distorted((3, 3, 3), 0.2, 1), material, hourglass=0.05, viscosity=viscosity, integration=EXACT)
    state = start(model)
    state.body.v[:] = random.uniform(-30.0, 30.0, state.body.v.shape)
    block = state.body.state
    alive = block[:, rows.ALIVE]
    alive.reshape(-1)[state.topology.slots[[2, 9, 15, 16, 26]]] = 0.0
    block[:, rows.STRESS : rows.STRESS + 6] = random.uniform(-2.0, 2.0, (len(block), 6, LANES))
    block[:, rows.BACK_STRESS : rows.BACK_STRESS + 6] = back_stress(random, (len(block), 6, LANES), 1)
    block[:, rows.PLASTIC_STRAIN] = random.uniform(0.0, 0.3, alive.shape)
    block[:, rows.RATE_FACTOR] = random.uniform(1.0, 1.5, alive.shape)
    block[:, rows.VISCOUS_PRESSURE] = random.uniform(0.0, 0.5, alive.shape)
    block[:, rows.HOURGLASS_FORCE : rows.HOURGLASS_FORCE + 12] = random.uniform(-1.0, 1.0, (len(block), 12, LANES))
    state.body.f[:] = random.uniform(-1.0, 1.0, state.body.f.shape)
    return state


def back_stress(random: np.random.Generator, shape: tuple[int, ...], axis: int) -> np.ndarray:
    """Return tensors without trace: back stress is a deviator."""
    values = np.moveaxis(random.uniform(-1.0, 1.0, shape), axis, 0)
    values[:3] -= values[:3].mean(axis=0)
    return np.moveaxis(values, 0, axis)


def close(found: object, wanted: object, scale: float | None = None) -> None:
    found, wanted = np.asarray(found), np.asarray(wanted)
    scale = max(np.abs(wanted).max(), 1e-3) if scale is None else scale
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-10 * scale)


@pytest.mark.parametrize("name", MATERIALS)
def test_one_point_element_equals_its_twin(name: str) -> None:
    """Forces and state after one step, alive, failing in this step, dead; nothing from the padding."""
    state = random_state(MATERIALS[name])
    body, m = state.body, state.material
    before, v = body.state.copy(), body.v
    x, f = body.x, body.f.copy()
    add_internal_forces(body.scratch, body.runs, body.targets, body.seen, body.state, body.f, DT, m)
    failed = 0
    for e, corners in enumerate(state.topology.hexes):
        slot = state.topology.slots[e]
        old, new = before[slot // LANES, :, slot % LANES], body.state[slot // LANES, :, slot % LANES]
        twin = oracle.OnePoint(
            oracle.Point(oracle.symmetric(old[:6]), oracle.symmetric(old[6:12]), old[rows.PLASTIC_STRAIN],
                         old[rows.RATE_FACTOR]),
            8.0 * old[rows.HOURGLASS_FORCE : rows.HOURGLASS_FORCE + 12].reshape(4, 3),
            64.0 * old[rows.HOURGLASS_STIFFNESS], old[rows.VISCOUS_LENGTH], old[rows.FAILURE_STRAIN],
            bool(old[rows.ALIVE]),
            viscous_pressure=old[rows.VISCOUS_PRESSURE],
        )  # fmt: skip
        f[corners] -= oracle.one_point_forces(twin, x[corners], v[corners], DT, m)
        failed += bool(old[rows.ALIVE]) and not twin.alive
        assert new[rows.ALIVE] == float(twin.alive)
        close(new[:6], oracle.six(twin.point.stress), 10.0)
        close(new[6:12], oracle.six(twin.point.back), 10.0)
        close(8.0 * new[rows.HOURGLASS_FORCE : rows.HOURGLASS_FORCE + 12], twin.hourglass.ravel(), 10.0)
        close(new[rows.INTERNAL_ENERGY], twin.internal_energy)
        close(new[rows.HOURGLASS_ENERGY], twin.hourglass_energy)
        if twin.alive:
            close(new[rows.PLASTIC_STRAIN], twin.point.plastic_strain)
            close(new[rows.RATE_FACTOR], twin.point.rate_factor)
            close(new[rows.VISCOUS_PRESSURE], twin.viscous_pressure)
    close(body.f, f)
    assert (failed > 0) == (MATERIALS[name].failure_strain < 0.4)


def flattened(to: float) -> np.ndarray:
    """Return the nodal forces after the dead one of two elements has been squeezed to a length of `to`."""
    state = start(Model(brick((2.0, 1.0, 1.0), (2, 1, 1)), MATERIALS["kinematic"]))
    body = state.body
    body.state[0, rows.ALIVE, 0] = 0.0
    body.x[:, 0] = np.where(body.x[:, 0] < 0.5, 1.0 - to, body.x[:, 0])
    copy_for_elements(body)
    add_internal_forces(body.scratch, body.runs, body.targets, body.seen, body.state, body.f, DT, state.material)
    return body.f


@pytest.mark.parametrize("place", [0.0, 300.0, -1e4])
def test_single_precision_sees_an_element_the_same_wherever_it_is(place: float) -> None:
    """Forces of a moving mesh of unit elements, shifted far away, equal those of double precision to single's digits.

    Whole numbers of the unit seen have passed 2³¹ there; 10⁴ itself rounds to 10⁻³ in single precision.
    """
    forces = {}
    for precision in ("double", "mixed"):
        mesh = distorted((3, 4, 10), 0.2, 5)
        mesh = mesh.moved(mesh.nodes + place)
        velocity = 20.0 + np.random.default_rng(2).uniform(-5.0, 5.0, mesh.nodes.shape)
        how = Integration(precision=precision)
        state = start(Model(mesh, MATERIALS["kinematic"], velocity=velocity, integration=how))
        body = state.body
        add_internal_forces(body.scratch, body.runs, body.targets, body.seen, body.state, body.f, DT, state.material)
        forces[precision] = body.f[: len(mesh.nodes)].copy()
    np.testing.assert_allclose(forces["mixed"], forces["double"], rtol=0.0, atol=4e-6 * np.abs(forces["double"]).max())


@pytest.mark.parametrize("to", [1e-12, 0.0, -1.0])
def test_dead_element_gives_no_force_however_it_is_deformed(to: float) -> None:
    """What stands around an eroded element may flatten it to nothing or turn it inside out."""
    assert np.all(flattened(to) == 0.0)
