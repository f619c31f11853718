"""Several threads give the bits of one."""

import numpy as np
import pytest

from stemcal.fem import lanes
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import History, simulate
from stemcal.fem.tools import Contact, Tool

WEDGE = Tool(corners=((2.5, 0.1), (3.0, 2.0), (2.0, 2.0)), radius=0.1, height=2.001, speed=-200.0, edge=2.5)


def press(threads: int) -> History:
    """Press a wedge into a block until elements fail."""
    mesh = brick((5.0, 4.0, 2.0), (5, 4, 2))
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[mesh.nodes[:, 2] == 0.0] = True
    model = Model(
        mesh=mesh,
        material=Material(1.0e-6, 1000.0, 0.3, 15.0, 0.5, 0.05, failure_strain=0.03),
        tools=(WEDGE,),
        contact=Contact(0.15, 0.10),
        held=held,
        integration=Integration(outputs=20, threads=threads),
    )
    return simulate(model, 1.5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("threads", [2, 3])
def test_threads_change_no_bit(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three parts of a block each."""
    monkeypatch.setattr(lanes, "_BLOCKS_OF_A_PART", 1)
    one, many = press(1), press(threads)
    assert one.deleted[-1] > 0
    for name in ("time", "force", "kinetic", "internal", "hourglass", "eroded", "external", "x", "state", "standing"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name), err_msg=name)
