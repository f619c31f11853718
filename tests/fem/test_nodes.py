"""Nodes kicked and moved a component at a time, against the formulas written out."""

from dataclasses import replace

import numpy as np
import pytest
from called import called

from stemcal.fem.kernels import nodes
from stemcal.fem.kernels.nodes import CHUNK, KINDS, kick_and_drift
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import State, start
from stemcal.fem.tools import Tool

push, take, leave, energy_within = map(
    called, (nodes.push, nodes.kick_by_pushes, nodes.clear_pushes, nodes.kinetic_energy_within)
)
KICK, DRIFT = 2.0e-3, 3.0e-3


def shaken() -> State:
    """Return more nodes than a chunk has, loaded, pushed, some held and some driven, and in motion."""
    random = np.random.default_rng(3)
    mesh = brick((8.0, 8.0, 9.0), (8, 8, 9))
    loads = random.uniform(-1.0, 1.0, mesh.nodes.shape)
    held = random.uniform(size=mesh.nodes.shape) < 0.2
    tool = Tool(((0.0, 0.0), (1.0, 3.0), (-1.0, 3.0)), 0.1, height=100.0, speed=-5.0)
    velocity = random.standard_normal(mesh.nodes.shape)
    model = Model(mesh, Material(1e-9, 100.0, 0.3), tools=(tool,), velocity=velocity, held=held)
    state = start(replace(model, loads=loads))
    count = len(mesh.nodes)
    assert CHUNK < count < 2 * CHUNK
    state.body.f[:count] = random.standard_normal((count, 3))
    for n in range(0, count, 7):
        for i in range(3):
            push(state.body.pushes, n % 3, n, i, random.standard_normal())
    return state


def test_nodes_move_as_the_formula_says() -> None:
    state = shaken()
    body, count = state.body, len(state.body.x)
    x, v, f, pushes = body.x.copy(), body.v.copy(), body.f[:count].copy(), body.pushes.force.sum(axis=0)
    free, loads, mass = body.free, body.loads, body.mass[:, None]
    new = np.where(free, v + KICK * (f + pushes + loads) / mass, v)
    sums = state.ledger.node_sums
    kinetic = energy_within(body, KICK)
    by_source, contact_held = body.pushes.force.copy(), np.zeros(KINDS)
    take(body, KICK, state.tools, contact_held)
    kick_and_drift(body, KICK, DRIFT, sums, 0, len(sums))
    leave(body, KICK, state.tools, contact_held)
    round_off = 1e-14 * np.abs(new).max()
    np.testing.assert_allclose(body.v, new, rtol=0.0, atol=round_off)
    np.testing.assert_allclose(body.x, x + DRIFT * new, rtol=0.0, atol=round_off)
    assert np.all(body.v[~free] == v[~free])
    assert not body.f[:count].any() and not body.pushes.force.any() and not body.pushes.many.any()
    mean = 0.5 * (v + new)
    holding = np.where(free, 0.0, v) * (f + pushes + loads)
    slower = np.array([0.0, 0.0, -5.0]) - mean
    np.testing.assert_allclose(contact_held, KICK * np.sum(by_source * slower, axis=(1, 2)), rtol=1e-12)
    # what is held does the work of all that pushes it, with the other sign
    assert sums[:, 0].sum() == pytest.approx(KICK * (np.sum(loads * mean) - np.sum(holding)), rel=1e-12)
    assert sums[:, 1].max() == pytest.approx(np.linalg.norm(new, axis=1).max(), rel=1e-14)
    assert kinetic == pytest.approx(0.5 * np.sum(mass * v * new), rel=1e-12)


def test_kinetic_energy_gains_the_work_done() -> None:
    """½ m v² grows by force times mean velocity: elements, contact, loads and what drives held components."""
    state = shaken()
    body, count = state.body, len(state.body.x)
    f, v, mass = body.f[:count].copy(), body.v.copy(), body.mass[:, None]
    contact_held, still = np.zeros(KINDS), state.tools._replace(speed=np.zeros(1))
    take(body, KICK, still, contact_held)
    kick_and_drift(body, KICK, DRIFT, state.ledger.node_sums, 0, len(state.ledger.node_sums))
    leave(body, KICK, still, contact_held)
    contact = -contact_held.sum()
    inside = KICK * np.sum(f * 0.5 * (v + body.v))
    gained = 0.5 * np.sum(mass * (body.v**2 - v**2))
    assert gained == pytest.approx(inside + contact + state.ledger.node_sums[:, 0].sum(), rel=1e-10)


@pytest.mark.parametrize("node", [0, CHUNK - 1, CHUNK, CHUNK + 3])
def test_no_number_hides_among_the_speeds(node: int) -> None:
    """The largest speed is NaN wherever one is: `max` would pass it over."""
    state = shaken()
    state.body.v[node, 1], state.body.free[node, 1] = np.nan, True
    sums = state.ledger.node_sums
    kick_and_drift(state.body, KICK, DRIFT, sums, 0, len(sums))
    assert np.isnan(sums[node // CHUNK, 1]) and np.isfinite(sums[1 - node // CHUNK, 1])


def test_elements_of_single_precision_see_where_nodes_are() -> None:
    """Positions are whole units, the same modulo 2³², velocities rounded; a moved node is seen where it is."""
    mesh = brick((7.0, 5.0, 9.0), (7, 5, 9))
    state = start(Model(mesh, Material(1e-9, 100.0, 0.3), integration=Integration(precision="mixed")))
    body = state.body
    body.v[:] = np.random.default_rng(4).standard_normal(body.v.shape) * 1e4
    sums = state.ledger.node_sums
    kick_and_drift(body, 0.0, 1.0, sums, 0, len(sums))
    unit = float(body.seen.unit)
    assert np.log2(unit) == round(np.log2(unit)) and 2.0**31 * unit >= 16.0
    assert np.abs(body.x).max() > 2.0**32 * unit
    wanted = np.round(body.x / unit).astype(np.int64)
    np.testing.assert_array_equal(body.seen.x, (wanted & 0xFFFFFFFF).astype(np.uint32).view(np.int32))
    np.testing.assert_array_equal(body.seen.v, body.v.astype(np.float32))


def test_single_precision_takes_the_same_time_step() -> None:
    """The stable step is worked out from the blocks, in their precision."""
    mesh = brick((7.0, 5.0, 9.0), (7, 5, 9))
    mesh = mesh.moved(mesh.nodes + np.random.default_rng(1).uniform(-0.2, 0.2, mesh.nodes.shape))
    model = Model(mesh, Material(1e-9, 100.0, 0.3))
    steps = [
        start(replace(model, integration=Integration(precision=p))).settings.penalty_step for p in ("double", "mixed")
    ]
    assert steps[1] == pytest.approx(steps[0], rel=2e-6) and steps[1] != steps[0]
