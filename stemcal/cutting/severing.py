"""Detect that a stem is in two parts: elements and unparted twin nodes no longer connect its ends."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from stemcal.fem.mesh import Mesh
from stemcal.fem.state import State

# A stem in two parts was cut through if less than this share of the cut plane is still connected; otherwise it broke
# elsewhere.
_CUT = 0.5


class Severing:
    """Callable for `simulate(inspect=…)`; `time` (s) is when the stem is first in two parts, None until then.

    `holding` is the share of the nodes of the cut plane that have not parted, `aside` the mean distance by which the
    blade has moved these nodes down, `elsewhere` the mean initial distance of deleted elements from the plane (mm).
    """

    def __init__(self, mesh: Mesh) -> None:
        x = mesh.nodes[:, 0]
        self.time: float | None = None
        self.holding, self.aside, self.elsewhere = 1.0, 0.0, 0.0
        self._start, self._away = mesh.nodes[:, 2], np.abs(x[mesh.hexes].mean(axis=1))
        self._ends = np.flatnonzero(x < x.min() + 1e-6), np.flatnonzero(x > x.max() - 1e-6)
        self._failed = 0

    def __call__(self, time: float, state: State) -> None:
        """Update the attributes; the connection of the ends is tested only after new failures."""
        failed = int((~state.topology.standing).sum() + state.spread.cut.parted.sum())
        if self.time is None and failed > self._failed and self._apart(state):
            self.time = time
        self._failed = failed
        cut = state.spread.cut
        left = cut.nodes[~cut.parted]
        self.holding = len(left) / len(cut.nodes)
        self.aside = float(np.mean(self._start[left] - state.body.x[left, 2])) if len(left) else 0.0
        deleted = self._away[~state.topology.standing]
        self.elsewhere = float(deleted.mean()) if len(deleted) else 0.0

    @property
    def cut_through(self) -> bool:
        """Whether the stem is in two parts at the cut, and has not broken elsewhere."""
        return self.time is not None and self.holding < _CUT

    def _apart(self, state: State) -> bool:
        """Check that the ends are not connected; a quarter model has unparted mirror nodes as its left end."""
        cut, standing = state.spread.cut, state.topology.hexes[state.topology.standing]
        unparted, doubled = ~cut.parted, len(cut.twins) > 0
        left, twins = (self._ends[0], cut.twins[unparted]) if doubled else (cut.nodes[unparted], cut.twins)
        elements = len(cut.number) + np.repeat(np.arange(len(standing)), 8)
        first = np.concatenate([elements, cut.nodes[unparted][: len(twins)]])
        second = np.concatenate([standing.ravel(), twins])
        size = len(cut.number) + len(standing)
        graph = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(size, size))
        _, part = connected_components(graph, directed=False)
        first_parts, second_parts = (part[end[np.isin(end, standing)]] for end in (left, self._ends[1]))
        return not np.intersect1d(first_parts, second_parts).size
