"""Create the cut plane, the plane under the edge of a blade on which a body parts, from the mesh and the tools."""

from dataclasses import replace

import numpy as np

from stemcal.arrays import Array, Ints, Mask
from stemcal.fem.kernels.parting import SKIN, CutPlane
from stemcal.fem.kernels.search import FACES
from stemcal.fem.kernels.spread_edge import SpreadEdge
from stemcal.fem.mesh import Mesh
from stemcal.fem.tools import Tool

_HAIR = 1.0e-9  # tolerance of positions, mm
# Elements are never deleted within half the blade's thickness plus this number of internal lengths ℓ of the plane: at
# 2 ℓ the weight of the mean strain, exp(−r²/ℓ²), is 2 %. Nor are they within half the height of the body, where the
# flanks crush it: deleting the elements of plastic hinges over near supports would make the force mesh-dependent.
_LENGTHS = 2.0
# A flank continues beyond the plane by this many half thicknesses of the blade, for nodes that have crossed the plane.
_BEYOND = 50.0


def parts_under(tools: tuple[Tool, ...]) -> int:
    """Return the index of the tool whose edge parts the body, −1 for none."""
    return next((t for t, tool in enumerate(tools) if tool.parts), -1)


def doubled(mesh: Mesh) -> Mesh:
    """Return a mesh without its elements of zero length; the two layers of nodes at their place are then separate."""
    extent = np.ptp(mesh.nodes[mesh.hexes][..., 0], axis=1)
    return replace(mesh, hexes=np.ascontiguousarray(mesh.hexes[extent > _HAIR]))


def joined(mesh: Mesh, tools: tuple[Tool, ...]) -> Mesh:
    """Return the mesh with the twin nodes on the cut plane merged, so that elements share nodes across the plane."""
    if (tool := parts_under(tools)) < 0:
        return mesh
    on = np.flatnonzero(np.abs(mesh.nodes[:, 0] - (tools[tool].edge or 0.0)) < _HAIR)
    _, first, place = np.unique(np.round(mesh.nodes[on], 7), axis=0, return_index=True, return_inverse=True)
    node = np.arange(len(mesh.nodes), dtype=np.int32)
    node[on] = on[first[place.ravel()]]
    return replace(mesh, hexes=node[mesh.hexes])


def spared(mesh: Mesh, tools: tuple[Tool, ...], length: float) -> Mask:
    """Return a mask (E,) of elements near the cut plane, which are never deleted; `length` is the internal length."""
    if (tool := parts_under(tools)) < 0:
        return np.zeros(len(mesh.hexes), dtype=bool)
    half = np.ptp(np.array(tools[tool].corners)[:, 0]) / 2.0 + tools[tool].radius
    away = np.abs(mesh.nodes[mesh.hexes, 0].mean(axis=1) - (tools[tool].edge or 0.0))
    return np.asarray(away < half + max(_LENGTHS * length, 0.5 * float(np.ptp(mesh.nodes[:, 2]))))


def cut_plane(tools: tuple[Tool, ...], mesh: Mesh, spread: SpreadEdge) -> CutPlane:
    """Return the plane under the first tool edge that parts the body; `spread` defines the sample lines of the edge."""
    tool, x, lines = parts_under(tools), mesh.nodes, len(spread.along)
    reach = float(np.abs(spread.across).max(initial=0.0))
    place = float(tools[tool].edge or 0.0) if tool >= 0 else np.inf
    side = np.ones(len(x))
    side[mesh.hexes] = np.where(x[mesh.hexes, 0].mean(axis=1) > place, 1.0, -1.0)[:, None] if tool >= 0 else 1.0
    on = np.abs(x[:, 0] - place) < _HAIR
    none = np.zeros((0, 0), np.int32), np.zeros(0), np.zeros(len(x), np.int32)
    columns, layers, line = _columns(x, side, place, reach) if tool >= 0 else none
    middle = int(np.argmax(layers >= 0.0)) + bool(np.any(on & (side < 0.0))) if tool >= 0 else 0
    nodes = columns[:, middle] if tool >= 0 else np.zeros(0, dtype=np.int32)
    twins = columns[:, middle - 1] if middle > 0 else nodes[:0]
    number = np.full(len(x), -1, dtype=np.int32)
    number[nodes] = np.arange(len(nodes))
    number[twins] = np.arange(len(twins))
    faces = number[mesh.hexes[:, FACES]]
    behind, face = np.nonzero((faces >= 0).all(axis=2))
    return CutPlane(
        tool=tool,
        nodes=np.ascontiguousarray(nodes),
        twins=np.ascontiguousarray(twins),
        number=number,
        line=line,
        side=side,
        faces=faces[behind, face],
        behind=behind.astype(np.int32),
        around=np.bincount(faces[behind, face].ravel(), minlength=len(nodes)).astype(float),
        columns=columns,
        layers=layers,
        flanks=_flanks(tools[tool]) if tool >= 0 else np.zeros((2, 5, 2)),
        strain=np.zeros(len(nodes)),
        parted=np.zeros(len(nodes), dtype=bool),
        offset=np.zeros(len(x)),
        front=np.full(lines, SKIN),
        ends=np.zeros((lines, 4), dtype=np.int32),
        shares=np.zeros((lines, 4)),
    )


def _columns(x: Array, side: Array, place: float, reach: float) -> tuple[Ints, Array, Ints]:
    """Return lines of nodes across the plane (P, M), the places of their M layers (M,), and the line of each node (N,).

    The lines end one layer beyond `reach`. The layers of nodes must be plane. Both sides must have the same number
    within `reach`, unless one is mirrored.
    """
    _, line = np.unique(np.round(x[:, 1:], 7), axis=0, return_inverse=True)
    table = np.lexsort((side, x[:, 0], line.ravel())).reshape(line.max() + 1, -1).astype(np.int32)
    away = x[table[0], 0] - place
    right = int(np.argmax((np.abs(away) < _HAIR) & (side[table[0]] > 0.0)))
    count = int(np.searchsorted(away[right:], reach)) + 1
    begin = right - count if right > 0 else 0
    some = slice(max(begin, 0), right + count)
    places = np.where(np.abs(away[some]) < _HAIR, 0.0, away[some])
    return np.ascontiguousarray(table[:, some]), places, line.ravel().astype(np.int32)


def _flanks(tool: Tool) -> Array:
    """Return the right and the left flank (2, 5, 2) of the blade as a sharp wedge, continued beyond the plane.

    The wedge passes through the edge's lowest line. A vertical flank (single bevel) is inclined by 1/1000.
    """
    corners, flanks = np.array(tool.corners), np.zeros((2, 5, 2))
    top = float(corners[:, 1].max()) + tool.radius
    for flank, sign in zip(flanks, (1.0, -1.0), strict=True):
        shoulder = corners[np.argmax(sign * corners[:, 0] - 1.0e-6 * corners[:, 1])]
        run, rise = sign * (shoulder[0] - corners[0, 0]), shoulder[1] - corners[0, 1]
        half, per = (run + tool.radius, run / rise) if run > 0.0 else (1.0e-3, 1.0e-3)
        far = _BEYOND * max(half, 1.0)
        flank[:4] = (-far, -far / per), (half, half / per), (half, top + half / per), (-far, top + half / per)
        flank[4] = flank[3]
    return flanks
