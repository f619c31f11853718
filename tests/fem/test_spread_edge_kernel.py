"""The hold of a spread edge on the nodes under it, against sums written out."""

import numpy as np
import pytest
from called import called

from stemcal.fem.kernels import spread_edge
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import State, start
from stemcal.fem.stepper import _Marching
from stemcal.fem.tools import Contact, Tool

_work_out_compliance, _list_met = map(called, (spread_edge._work_out_compliance, spread_edge._list_met))


@pytest.fixture(scope="module")
def pressed() -> State:
    """Return a block with a spread edge pressed into it."""
    mesh = brick((4.0, 1.0, 3.0), (16, 4, 12))
    mesh = mesh.moved(mesh.nodes - [2.0, 0.0, 3.0])
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[mesh.nodes[:, 2] < -2.99] = True
    wedge = Tool(((0.0, 0.1), (1.0, 4.0), (-1.0, 4.0)), 0.05, height=0.0, speed=-100.0, edge=0.0, spread=0.5)
    model = Model(
        mesh, Material(1e-9, 1000.0, 0.3), tools=(wedge,), held=held, contact=Contact(0.3, 0.1),
        integration=Integration(mass_scaling=1e4),
    )  # fmt: skip
    state = start(model)
    _Marching(state, 1)(1e-3, state)
    assert (state.spread.force[:, 0] > 0.0).sum() > 3
    return state


def test_compliance_is_the_sum_over_common_nodes(pressed: State) -> None:
    """C_jk = Σ normal_j·normal_k/m over the free components, whatever steps have left in the scratch before."""
    edge, body = pressed.spread, pressed.body
    normal = np.zeros((len(edge.sizes), *body.v.shape))
    for j, size in enumerate(edge.sizes):
        np.add.at(normal[j], edge.nodes[j, :size], edge.normal[j, :size])
    wanted = np.einsum("jni,kni,n,ni->jk", normal, normal, body.inverse_mass, body.free)
    edge.velocity[:] = 1e3
    _list_met(edge)
    _work_out_compliance(edge, body.free, body.inverse_mass)
    np.testing.assert_allclose(edge.compliance, wanted, rtol=0.0, atol=1e-12 * wanted.max())


def test_every_node_of_a_row_is_listed_once(pressed: State) -> None:
    edge = pressed.spread
    nodes = {int(n) for j, size in enumerate(edge.sizes) for n in edge.nodes[j, :size]}
    listed = edge.met[: edge.met_count[0]].tolist()
    assert sorted(listed) == sorted(nodes) and len(nodes) > 10
    assert set(np.flatnonzero(edge.is_met)) == nodes


def test_the_tool_feels_what_its_rows_push(pressed: State) -> None:
    """Down on the nodes with λ along the mean normal: the upward sum on the tool is Σ λ less friction's part."""
    edge = pressed.spread
    upward = 0.0
    for j, size in enumerate(edge.sizes):
        upward += edge.force[j, 0] * edge.normal[j, :size, 2].sum() - edge.force[j, 3] * edge.shape[j, :size, 2].sum()
    assert pressed.tools.force[edge.tool, 2] == pytest.approx(upward, rel=1e-12) and upward > 0.0
