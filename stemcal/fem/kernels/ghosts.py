"""Ghosts: massless nodes beyond a mirror plane, images of nodes in front of it."""

from typing import Any

from stemcal.fem.kernels.compile import kernel
from stemcal.fem.kernels.nodes import see_node


@kernel
def mirror_ghosts(body: Any) -> None:
    """Set each ghost (g, s) of `body.ghosts` to the mirror image of its source in the plane x = 0."""
    x, v, ghosts = body.x, body.v, body.ghosts
    for m in range(ghosts.shape[0]):
        g, s = ghosts[m, 0], ghosts[m, 1]
        x[g, 0], x[g, 1], x[g, 2] = -x[s, 0], x[s, 1], x[s, 2]
        v[g, 0], v[g, 1], v[g, 2] = -v[s, 0], v[s, 1], v[s, 2]
        see_node(body, g)
