"""Contact with rigid tools: rebound, momentum, damping and friction of a block against closed forms."""

from math import atan2, exp, pi, sqrt

import numpy as np
import pytest
from driven import NO_VISCOSITY

from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import start
from stemcal.fem.stepper import History, _Marching, simulate
from stemcal.fem.tools import Contact, Tool

# A table: its top at z = 0, far larger than what lies on it.
TABLE = Tool(corners=((-50.0, -20.0), (50.0, -20.0), (50.0, -1.0), (-50.0, -1.0)), radius=1.0)
STIFF = Material(1e-9, 1000.0, 0.0)
BLOCK = brick((4.0, 4.0, 1.0), (4, 4, 1))
MASS = 16e-9


def fall(
    contact: Contact, tool: Tool = TABLE, speed: float = -100.0, time: float = 2e-3, outputs: int = 400
) -> History:
    """Let the block come down on a tool from a gap of 0.001 mm, without gravity."""
    mesh = BLOCK.moved(BLOCK.nodes + np.array([0.0, 0.0, 0.001]))
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 2] = speed
    model = Model(mesh, STIFF, tools=(tool,), contact=contact, velocity=velocity, viscosity=NO_VISCOSITY,
                  integration=Integration(outputs=outputs, safety=0.8))  # fmt: skip
    return simulate(model, time)


# A contact so soft beside the block's own stiffness that the block is rigid.
SOFT = 1e-4
STEP = 1.0 / sqrt(1000.0 / 1e-9)


@pytest.mark.parametrize("speed", [-100.0, -1000.0])
def test_rebound_keeps_the_energy(speed: float) -> None:
    """Without damping a rigid block leaves as fast as it came, after half a period π √(M/K).

    K = p m/Δt² for each of the nodes below, which carry half of the mass: ω = √(p/2)/Δt. The block's own springs are
    softer by p/2 = 5e-5, and the contact ends on a whole step: tolerances 0.5 % of the impulse, 1 % of the time.
    """
    history = fall(Contact(penalty=SOFT, damping=0.0), speed=speed, time=4.8e-4)
    impulse = -np.cumsum(history.force[:, 0, 2] * np.diff(history.time, prepend=0.0))
    assert impulse[-1] == pytest.approx(-2.0 * MASS * speed, rel=0.005)
    assert history.kinetic[-1] == pytest.approx(history.kinetic[0], rel=0.01)
    touching = np.flatnonzero(history.force[:, 0, 2] < 0.0)
    duration = history.time[touching[-1]] - history.time[touching[0] - 1]
    assert duration == pytest.approx(pi * STEP / sqrt(SOFT / 2.0), rel=0.02)
    assert history.force[:, 0, 2].min() == pytest.approx(MASS * speed * sqrt(SOFT / 2.0) / STEP, rel=0.005)
    assert history.drift_percent() < 0.5
    assert history.contact[-1] == pytest.approx(0.0, abs=0.005 * history.kinetic[0])


@pytest.mark.parametrize("penalty", [0.3125, 0.078])
def test_rebound_of_an_elastic_block_keeps_the_sum_of_energies(penalty: float) -> None:
    """With the stiff default contact some of the energy rings on in the block; the sum stays.

    What the contact held is back within 1 %; the sum within 3 %, as kinetic energy stands half a step aside.
    """
    history = fall(Contact(penalty=penalty, damping=0.0))
    assert history.force[-1, 0, 2] == 0.0
    total = history.kinetic + history.internal + history.hourglass
    assert total[-1] == pytest.approx(history.kinetic[0], rel=0.03)
    assert history.contact[-1] == pytest.approx(0.0, abs=0.01 * history.kinetic[0])


@pytest.mark.parametrize("damping", [0.1, 0.3, 0.5])
def test_rebound_with_damping(damping: float) -> None:
    """f = max(0, kδ − cδ̇) on M = 2m per node: ζ' = ζ/√2, and the contact ends where kδ + cδ̇ = 0, before δ = 0.

    e = exp(−ζ'ω t*) (cos − ζ'/√(1−ζ'²) sin)(ω_d t*) with tan(ω_d t*) = 2ζ'√(1−ζ'²)/(2ζ'² − 1). Tolerance 1 %.
    """
    history = fall(Contact(penalty=SOFT, damping=damping), time=5e-4)
    zeta = damping / sqrt(2.0)
    root = sqrt(1.0 - zeta**2)
    angle = atan2(2.0 * zeta * root, 2.0 * zeta**2 - 1.0)
    restitution = exp(-zeta / root * angle) * abs(np.cos(angle) - zeta / root * np.sin(angle))
    assert sqrt(history.kinetic[-1] / history.kinetic[0]) == pytest.approx(restitution, rel=0.01)
    # what is lost is in the contact's account
    assert history.contact[-1] == pytest.approx(history.kinetic[0] * (1.0 - restitution**2), rel=0.02)
    assert np.all(history.force[:, 0, 2] <= 0.0)  # damping never pulls


def momentum(model: Model, duration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return momentum at the start and the end, and the sum of the impulses on the tools."""
    from stemcal.fem.kernels.march import REACHED

    state = start(model)
    before = state.body.mass @ state.body.v
    assert _Marching(state, 1)(duration, state) == REACHED
    return before, state.body.mass @ state.body.v, state.ledger.impulse.sum(axis=0)


def test_momentum_is_conserved_to_round_off() -> None:
    """The impulse on the tools is what the body lost, whatever the friction, damping and plasticity.

    Forces of an element balance to the round-off of single precision: 1e-6 of the momentum (1e-12 in double).

    A spinning block with an edge tool from above and a table below, 2000 steps.
    """
    mesh = BLOCK.moved(BLOCK.nodes - np.array([2.0, 2.0, -0.01]))
    velocity = np.array([300.0, 200.0, -500.0]) + np.cross([100.0, -50.0, 80.0], mesh.nodes - mesh.nodes.mean(axis=0))
    wedge = Tool(((0.0, 0.05), (1.0, 3.0), (-1.0, 3.0)), 0.05, height=1.02, speed=-200.0, edge=0.0)
    model = Model(mesh, Material(1e-9, 1000.0, 0.3, 5.0, 10.0), tools=(TABLE, wedge), contact=Contact(0.3, 0.2, 0.01),
                  velocity=velocity, integration=Integration(safety=0.5))  # fmt: skip
    before, after, impulse = momentum(model, 5e-4)
    assert np.abs(impulse).min() > 0.01 * np.abs(before).max()  # all directions took part
    np.testing.assert_allclose(before - after, impulse, atol=1e-6 * np.abs(before).max())


GRAVITY = 1.0e4


def slide(contact: Contact, velocity_x: float, pull: float, time: float, axis: int = 0, settle: float = 0.0) -> History:
    """Let the block slide on the table under its weight M g, pulled sideways by `pull`·M g; damping takes the bounce.

    The block starts at the depth at which the springs carry the weight.
    """
    depth = 2.0 * GRAVITY * STEP**2 / contact.penalty
    mesh = BLOCK.moved(BLOCK.nodes - np.array([2.0, 2.0, depth]))
    loads = np.zeros_like(mesh.nodes)
    mass = start(Model(mesh, STIFF)).body.mass
    loads[:, 2] = -mass * GRAVITY
    loads[:, axis] += pull * mass * GRAVITY
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, axis] = velocity_x
    model = Model(mesh, STIFF, tools=(TABLE,), contact=contact, velocity=velocity, loads=loads,
                  integration=Integration(outputs=200, safety=0.8))  # fmt: skip
    return simulate(model, time)


@pytest.mark.parametrize(
    ("axis", "mu", "speed"),
    [*((0, 0.3, 100.0), (1, 0.3, 200.0)), *(pytest.param(axis, 0.1, 100.0, marks=pytest.mark.slow) for axis in (0, 1))],
)
def test_stopping_distance(axis: int, mu: float, speed: float) -> None:
    """A block thrown at v stops after v²/(2μg) in v/(μg) and stays; its energy is in the contact's account.

    Tolerance 1 %: the stick of the friction spring and the ringing of the block.
    """
    stop = speed / (mu * GRAVITY)
    history = slide(Contact(mu, mu), speed, 0.0, 1.5 * stop, axis)
    moved = history.x[:, axis].mean() - (BLOCK.nodes[:, axis].mean() - 2.0)
    assert moved == pytest.approx(speed**2 / (2.0 * mu * GRAVITY), rel=0.01)
    assert history.kinetic[-1] < 1e-4 * history.kinetic[0]
    assert history.contact[-1] == pytest.approx(history.kinetic[0], rel=0.02)
    sliding = history.time < 0.9 * stop
    assert history.force[1:, 0, axis][sliding[1:]].mean() == pytest.approx(mu * MASS * GRAVITY, rel=0.01)


def test_sticks_below_and_slips_above_the_limit() -> None:
    """Pulled by 0.9 μ_s M g a block stays (to the give of its springs); by 1.1 μ_s M g it moves with 0.1 μ_s g."""
    mu, time = 0.3, 0.02
    depth = 2.0 * GRAVITY * STEP**2 / 0.2
    stays = slide(Contact(mu, mu), 0.0, 0.9 * mu, time)
    moved = abs(stays.x[:, 0].mean())
    assert moved < 20.0 * depth
    slips = slide(Contact(mu, mu), 0.0, 1.1 * mu, time)
    assert slips.x[:, 0].mean() == pytest.approx(0.5 * 0.1 * mu * GRAVITY * time**2, rel=0.05)


@pytest.mark.parametrize("decay", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("speed", [1.0, 30.0, 300.0])
def test_friction_decays_with_speed(decay: float, speed: float) -> None:
    """LS-DYNA keyword manual, *CONTACT: μ = μ_d + (μ_s − μ_d) exp(−DC |v|); with DC = 0 it is μ_s at any speed.

    The block is drawn along at constant speed (all nodes held along x) and the table feels μ M g. 0.5 %.
    """
    contact = Contact(0.3, 0.1, decay)
    depth = 2.0 * GRAVITY * STEP**2 / contact.penalty
    mesh = BLOCK.moved(BLOCK.nodes - np.array([2.0, 2.0, depth]))
    loads = np.zeros_like(mesh.nodes)
    loads[:, 2] = -start(Model(mesh, STIFF)).body.mass * GRAVITY
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 0] = speed
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 0] = True
    model = Model(mesh, STIFF, tools=(TABLE,), contact=contact, velocity=velocity, loads=loads, held=held,
                  integration=Integration(outputs=10, safety=0.8))  # fmt: skip
    history = simulate(model, 2e-3)
    mu = 0.1 + 0.2 * exp(-decay * speed)
    assert history.force[5:, 0, 0].mean() == pytest.approx(mu * MASS * GRAVITY, rel=0.005)
    assert history.force[5:, 0, 2].mean() == pytest.approx(-MASS * GRAVITY, rel=0.005)
    # the work of the drawing hand is what friction takes
    assert history.external[-1] == pytest.approx(history.contact[-1], rel=0.01)


def test_a_fillet_pushes_along_its_own_normal() -> None:
    """A row of nodes on a filleted corner of a support is pushed along the line from the fillet's centre.

    All nodes held; the force on the tool is then p m/Δt² δ along the normal, less half a step of the 1250.
    """
    support = Tool(corners=((1.0, -1.0), (1.0, -50.0), (50.0, -50.0), (50.0, -1.0)), radius=1.0)
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    shift = np.array([1.0 - 0.95 * np.sin(0.6) - 1.0, 0.0, -1.0 + 0.95 * np.cos(0.6)])
    mesh = mesh.moved(mesh.nodes + shift)
    held = np.ones(mesh.nodes.shape, dtype=bool)
    history = simulate(Model(mesh, STIFF, tools=(support,), contact=Contact(), held=held,
                             integration=Integration(outputs=1, safety=0.8)), 1e-3)  # fmt: skip
    force = history.force[1, 0] / np.linalg.norm(history.force[1, 0])
    np.testing.assert_allclose(force, [np.sin(0.6), 0.0, -np.cos(0.6)], atol=1e-9)
    step = 1.0 / sqrt(1000.0 / 1e-9)
    assert np.linalg.norm(history.force[1, 0]) == pytest.approx(2 * 0.25 * 0.125e-9 / step**2 * 0.05, rel=1e-3)
