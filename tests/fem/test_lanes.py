"""Elements in the lanes of blocks: known places, and that every lane's corners are its element's."""

import numpy as np
import pytest

from stemcal.fem import lanes
from stemcal.fem.kernels.block import LANES
from stemcal.fem.kernels.compile import RUN
from stemcal.fem.lanes import lay_out
from stemcal.fem.mesh import Mesh, brick, hollow_cylinder

CYLINDER = hollow_cylinder(1.0, 2.0, np.linspace(0.0, 9.0, 18), (13, 3))
MESHES = {
    "brick": brick((3.0, 4.0, 5.0), (3, 4, 5)),
    "ring": CYLINDER,
    "in no order": Mesh(CYLINDER.nodes, np.random.default_rng(3).permutation(CYLINDER.hexes)),
    "one element": brick((1.0, 1.0, 1.0), (1, 1, 1)),
}


@pytest.mark.parametrize("name", MESHES)
def test_every_lane_has_the_corners_of_its_element(name: str) -> None:
    """Corner a of the element in a lane is the run's first node + the lane's place in the run; no lane has two."""
    mesh = MESHES[name]
    laid = lay_out(mesh.hexes, len(mesh.nodes))
    assert len(set(laid.slots.tolist())) == len(mesh.hexes)
    block, lane = laid.slots // LANES, laid.slots % LANES
    corners = laid.runs[block, :, lane // RUN] + (lane % RUN)[:, None]
    np.testing.assert_array_equal(corners, mesh.hexes)
    assert laid.runs.min() >= 0 and laid.runs.max() < len(mesh.nodes)


def test_rows_follow_one_another() -> None:
    """Rows of 17 with one lane between them fill 13 · 18 − 1 lanes, then the ring closes: 12 rows and one."""
    laid = lay_out(CYLINDER.hexes, len(CYLINDER.nodes))
    np.testing.assert_array_equal(laid.slots[:17], np.arange(17))
    np.testing.assert_array_equal(laid.slots[17:34], 18 + np.arange(17))
    closing = laid.slots[12 * 17 : 13 * 17]
    np.testing.assert_array_equal(closing - closing[0], np.arange(17))
    assert closing[0] == 216  # 12 · 18 − 1 = 215 lanes, to the next run


def test_values_go_and_come_back() -> None:
    """What is spread over the lanes is gathered again in the order of the mesh; empty lanes hold the filling."""
    laid = lay_out(CYLINDER.hexes, len(CYLINDER.nodes))
    values = np.arange(len(CYLINDER.hexes), dtype=float)
    spread = laid.spread(values, -1.0)
    assert spread.shape == (len(laid.runs), LANES)
    assert (spread == -1.0).sum() == spread.size - len(values)
    np.testing.assert_array_equal(laid.gathered(spread), values)
    rows = np.stack([spread, 2.0 * spread], axis=1)
    np.testing.assert_array_equal(laid.gathered(rows), np.stack([values, 2.0 * values], axis=1))


def test_parts_meet_no_row_in_common(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rows that two parts write have nothing in common, and the late ones carry each force to its node."""
    monkeypatch.setattr(lanes, "_BLOCKS_OF_A_PART", 2)
    mesh, rng = MESHES["ring"], np.random.default_rng(5)
    laid = lay_out(mesh.hexes, len(mesh.nodes))
    assert len(laid.ends) > 3
    written = [
        set((laid.targets[begin:end, ..., None] + np.arange(RUN)).ravel().tolist())
        for begin, end in zip(laid.ends[:-1], laid.ends[1:], strict=True)
    ]
    assert all(not a & b for i, a in enumerate(written) for b in written[i + 1 :])
    first = len(mesh.nodes) + RUN
    forces = np.zeros(first + len(laid.late))
    direct = np.zeros(first)
    each = rng.integers(-9, 9, (*laid.runs.shape, RUN))
    np.add.at(forces, laid.targets[..., None] + np.arange(RUN), each)
    np.add.at(forces, laid.late, forces[first:].copy())
    np.add.at(direct, laid.runs[..., None] + np.arange(RUN), each)
    np.testing.assert_array_equal(forces[:first], direct)


def test_a_block_has_elements_of_one_material() -> None:
    """Skin, ring by ring through the wall of 3: each layer begins with a block, and every lane has its element."""
    of = np.repeat([0, 1, 2], 13 * 17)
    laid = lay_out(CYLINDER.hexes, len(CYLINDER.nodes), of)
    block, lane = laid.slots // LANES, laid.slots % LANES
    assert [len(set(of[block == b])) for b in range(len(laid.runs))] == [1] * len(laid.runs)
    corners = laid.runs[block, :, lane // RUN] + (lane % RUN)[:, None]
    np.testing.assert_array_equal(corners, CYLINDER.hexes)
    assert [laid.slots[n * 13 * 17] % LANES for n in range(3)] == [0, 0, 0]
