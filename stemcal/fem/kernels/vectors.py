"""How kernels reach runs of nodes, blocks of elements and other threads: in LLVM's words, or plainly.

A run is `RUN` nodes that follow one another. Nodal arrays (N, 3) lie component by component (Fortran's order), so a
component of a run is one vector. A run may reach past the last node: behind the last component there are `RUN` numbers
to spare, and where runs are written to, behind each (`stemcal.fem.lanes.nodal`).

With ``STEMCAL_PLAIN_KERNELS=1`` in the environment the kernels are compiled from `plain` in place of `llvm`.
"""

from __future__ import annotations

from typing import Any

from stemcal.fem.kernels import llvm, plain
from stemcal.fem.kernels.cache import PLAIN as PLAIN
from stemcal.fem.kernels.precision import RUN as RUN

_chosen: Any = plain if PLAIN else llvm
prefetch, counting = _chosen.prefetch, _chosen.counting
read_corners, subtract_run = _chosen.read_corners, _chosen.subtract_run
see_place, see_velocity, maximum = _chosen.see_place, _chosen.see_velocity, _chosen.maximum
read_scratch, write_scratch = _chosen.read_scratch, _chosen.write_scratch
read_state, write_state = _chosen.read_state, _chosen.write_state
add_together, read_together, give_way = _chosen.add_together, _chosen.read_together, _chosen.give_way
