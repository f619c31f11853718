"""Nodes kicked and moved a component at a time, against the formulas written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stemcal.fem.kernels.nodes import CHUNK, kick_and_drift
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import State, start

KICK, DRIFT = 2.0e-3, 3.0e-3


def shaken() -> State:
    """Return more nodes than a chunk has, loaded, pushed, some held and some driven, and in motion."""
    random = np.random.default_rng(3)
    mesh = brick((16.0, 16.0, 17.0), (16, 16, 17))
    loads = random.uniform(-1.0, 1.0, mesh.nodes.shape)
    held = random.uniform(size=mesh.nodes.shape) < 0.2
    model = Model(mesh, Material(1e-9, 100.0, 0.3), velocity=random.standard_normal(mesh.nodes.shape), held=held)
    state = start(replace(model, loads=loads))
    count = len(mesh.nodes)
    assert CHUNK < count < 2 * CHUNK
    state.body.f[:count] = random.standard_normal((count, 3))
    state.body.push[::7] = random.standard_normal((len(range(0, count, 7)), 3))
    return state


def test_nodes_move_as_the_formula_says() -> None:
    state = shaken()
    body, count = state.body, len(state.body.x)
    x, v, f, push = body.x.copy(), body.v.copy(), body.f[:count].copy(), body.push.copy()
    free, driven, loads, mass = body.free, body.driven, body.loads, body.mass[:, None]
    new = np.where(free, v + KICK * (f + push) / mass, driven)
    sums = state.ledger.node_sums
    kick_and_drift(body, KICK, DRIFT, sums, 0, len(sums))
    np.testing.assert_allclose(body.v, new, rtol=1e-12)
    np.testing.assert_allclose(body.x, x + DRIFT * new, rtol=1e-12)
    np.testing.assert_array_equal(body.f[:count], loads)
    assert not body.push.any()
    mean = 0.5 * (v + new)
    external = np.sum(loads * mean * free) - np.sum((f + push - loads) * driven)
    assert sums[:, 0].sum() == pytest.approx(KICK * np.sum(push * mean), rel=1e-12)
    assert sums[:, 1].sum() == pytest.approx(KICK * external, rel=1e-12)
    assert sums[:, 2].max() == pytest.approx(np.linalg.norm(new, axis=1).max(), rel=1e-14)
    assert sums[:, 3].sum() == pytest.approx(0.5 * np.sum(mass * v * new), rel=1e-12)


@pytest.mark.parametrize("node", [0, CHUNK - 1, CHUNK, CHUNK + 3])
def test_no_number_hides_among_the_speeds(node: int) -> None:
    """The largest speed is NaN wherever one is: `max` would pass it over."""
    state = shaken()
    state.body.v[node, 1], state.body.free[node, 1] = np.nan, True
    sums = state.ledger.node_sums
    kick_and_drift(state.body, KICK, DRIFT, sums, 0, len(sums))
    assert np.isnan(sums[node // CHUNK, 2]) and np.isfinite(sums[1 - node // CHUNK, 2])


def test_single_precision_takes_the_same_time_step() -> None:
    """The stable step is worked out from the blocks, in their precision."""
    mesh = brick((7.0, 5.0, 9.0), (7, 5, 9))
    mesh = mesh.moved(mesh.nodes + np.random.default_rng(1).uniform(-0.2, 0.2, mesh.nodes.shape))
    model = Model(mesh, Material(1e-9, 100.0, 0.3))
    steps = [
        start(replace(model, integration=Integration(precision=p))).settings.penalty_step for p in ("double", "mixed")
    ]
    assert steps[1] == pytest.approx(steps[0], rel=2e-6) and steps[1] != steps[0]
