"""Contact search: the topology of the mesh, and lists of the nodes and faces that can touch a tool soon.

The lists contain everything within `margin` of a tool. They remain valid until an element is eroded, or until nodes and
tools together may have moved by the margin: the march adds up the largest speed of each step times its duration.
"""

from typing import NamedTuple

import numpy as np

from stemcal.arrays import Array, Floats, Ints, Mask
from stemcal.fem.kernels.compile import kernel
from stemcal.fem.kernels.contact import SAMPLES, flank_distance, outline_distance, sample_of_skin

# Corners of the six faces of a hexahedron, −ξ, +ξ, −η, +η, −ζ, +ζ, counter-clockwise as seen from outside.
FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]], dtype=np.int32)


class Topology(NamedTuple):
    """Connectivity of the mesh and the elements not yet eroded; created by `stemcal.fem.mesh.Mesh.topology`."""

    hexes: Ints  # (E, 8)
    slots: Ints  # (E,) block · LANES + lane of the elements' state
    neighbours: Ints  # (E, 6) element behind each face, −1 outside
    standing: Mask  # (E,) elements not eroded yet; changes during the run
    live: Ints  # (N,) number of standing elements at each node; changes during the run
    crowns: Array  # (E, 6) height of the true surface over the middle of each face, mm


class Candidates(NamedTuple):
    """Nodes and faces that may touch a tool before the next search."""

    nodes: Ints  # (T, N) nodes near each tool
    node_counts: Ints  # (T,)
    skin: Ints  # (T, F) faces of the skin near each tool that touches faces
    skin_counts: Ints  # (T,)
    covered: Mask  # (N,) nodes of the faces of the skin
    faces: Ints  # (F, 4) exposed faces under the edge
    corner_mass: Array  # (F,) mass of one corner of the element behind the face
    crowns: Array  # (F,) height of the true surface over the face
    face_count: Ints  # (1,)


@kernel
def list_near_nodes(candidates: Floats, topology: Floats, tools: Floats, cut: Floats, x: Array, margin: float) -> None:
    """List the nodes within `margin` of each tool, except the nodes of the skin if the tool touches faces."""
    for t in range(tools.radius.shape[0]):
        count = 0
        for n in range(x.shape[0]):
            if topology.live[n] == 0 or (tools.faces[t] and candidates.covered[n]):
                continue
            gap, _, _ = outline_distance(x[n, 0], x[n, 2] - tools.height[t], tools.corners[t])
            gap -= tools.radius[t]
            if t == cut.tool:
                flank, _, _ = flank_distance(cut, n, x[n, 0] - tools.edge[t], x[n, 2] - tools.height[t])
                gap = min(gap, flank)
            if gap < margin:
                candidates.nodes[t, count] = n
                count += 1
        candidates.node_counts[t] = count


@kernel
def list_near_skin(candidates: Floats, topology: Floats, tools: Floats, x: Array, margin: float) -> None:
    """List the faces of the skin within `margin` of each tool that touches faces; mark the nodes of the skin."""
    candidates.covered[:] = False
    candidates.skin_counts[:] = 0
    for f in range(tools.skin.shape[0]):
        if not topology.standing[tools.skin[f, 4]]:
            continue
        for corner in range(4):
            candidates.covered[tools.skin[f, corner]] = True
        for t in range(tools.radius.shape[0]):
            for s in range(SAMPLES if tools.faces[t] else 0):
                _, px, pz = sample_of_skin(tools, f, s, x)
                gap, _, _ = outline_distance(px, pz - tools.height[t], tools.corners[t])
                if gap - tools.radius[t] < margin:
                    candidates.skin[t, candidates.skin_counts[t]] = f
                    candidates.skin_counts[t] += 1
                    break


@kernel
def list_faces_under_edge(
    candidates: Floats, topology: Floats, tools: Floats, tool: int, x: Array, element_mass: Array, margin: float,
    on_plane: Ints,
) -> None:  # fmt: skip
    """List the exposed faces within `margin` of the edge of `tool`, or of the zone over which this edge is spread.

    Faces with all corners on the cut plane (`on_plane` ≥ 0) are excluded: `parting.find_front` locates the cut front.
    """
    count = 0
    reach = margin + tools.reach[tool]
    tip, edge = tools.height[tool] - reach, tools.edge[tool]
    for e in range(topology.standing.shape[0]):
        if not topology.standing[e]:
            continue
        for s in range(6):
            behind = topology.neighbours[e, s]
            if behind >= 0 and topology.standing[behind]:
                continue
            low, high, top, parting = 1.0e30, -1.0e30, -1.0e30, 0
            for a in range(4):
                n = topology.hexes[e, FACES[s, a]]
                low, high, top = min(low, x[n, 0]), max(high, x[n, 0]), max(top, x[n, 2])
                parting += 1 if on_plane[n] >= 0 else 0
            if parting == 4 or low - reach > edge or high + reach < edge or top < tip:
                continue
            for a in range(4):
                candidates.faces[count, a] = topology.hexes[e, FACES[s, a]]
            candidates.corner_mass[count] = element_mass[e] / 8.0
            candidates.crowns[count] = topology.crowns[e, s]
            count += 1
    candidates.face_count[0] = count
