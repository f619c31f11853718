"""A plane on which a blade parts a body: what a user of the solver writes, and the arrays of `kernels.cohesive`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.contact import Tool
from stemcal.fem.kernels.cohesive import CutPlane
from stemcal.fem.kernels.search import FACES
from stemcal.fem.mesh import Mesh

Array = NDArray[np.float64]
Ints = NDArray[np.int32]

# Stations of the edge to an element on the plane.
_TO_A_FACE = 4
_NEAR = 0.05


@dataclass(frozen=True)
class Cohesion:
    """What holds the mirror plane x = 0 of a body together, and what a tool with `parts` meets there.

    Parameters
    ----------
    strength : float
        Stress at which the plane begins to open, MPa.
    toughness : float
        Energy of a parted area, N/mm (kJ/m²).
    nose : float
        What the rounding of the edge adds to the toughness, N per mm of edge, while the plane ahead is closed.
    nose_width : float
        Opening of the plane ahead at which the rounding meets nothing, mm.
    """

    strength: float
    toughness: float
    nose: float = 0.0
    nose_width: float = 0.0


def on_plane(nodes: Array) -> NDArray[np.bool_]:
    """Return which nodes (N, 3) lie on the plane x = 0."""
    return np.abs(nodes[:, 0]) < 1e-9


def cut_plane(law: Cohesion | None, tools: tuple[Tool, ...], mesh: Mesh, size: float) -> CutPlane:
    """Return the plane that the first tool that parts moves on, an empty one if there is none.

    Parameters
    ----------
    size : float
        Length of the elements, mm.
    """
    tool = next((t for t, tool in enumerate(tools) if tool.parts), -1) if law is not None else -1
    law = law or Cohesion(1.0, 1.0)
    faces = _faces_on_plane(mesh) if tool >= 0 else np.zeros((0, 4), dtype=np.int32)
    nodes = np.unique(faces)
    columns = _columns(mesh, nodes, 0.5 * law.nose_width)
    places = np.searchsorted(nodes, faces).astype(np.int32)
    corners = mesh.nodes[faces][:, :, 1:]
    whole = np.zeros(len(nodes))
    np.add.at(whole, places, _tributary(corners))
    reach = np.zeros(len(nodes))
    np.maximum.at(reach, places, np.repeat(np.ptp(corners[:, :, 1], axis=1)[:, None], 4, axis=1) if len(faces) else 0.0)
    spacing = size / _TO_A_FACE
    y = mesh.nodes[nodes, 1]
    first, last = (np.floor(y.min() / spacing), np.ceil(y.max() / spacing)) if len(nodes) else (0, 0)
    along = np.asarray((np.arange(first, last) + 0.5) * spacing, dtype=np.float64)
    count = len(mesh.nodes) if tool >= 0 else 0
    return CutPlane(
        tool=tool,
        strength=law.strength,
        toughness=law.toughness,
        nose=law.nose,
        nose_width=law.nose_width,
        near=_NEAR * size,
        nodes=nodes.astype(np.int32),
        whole=whole,
        area=whole.copy(),
        widest=np.zeros(len(nodes)),
        reach=reach,
        pull=np.zeros(len(nodes)),
        columns=columns,
        faces=faces,
        places=places,
        before=corners,
        along=along,
        spacing=spacing,
        found=np.full(len(along), -1, dtype=np.int32),
        shape=np.zeros((len(along), 4)),
        bearing=np.zeros((len(along), columns.shape[1])),
        stretch=np.ones(len(along)),
        most=np.zeros(len(along)),
        rounding=np.zeros(len(along)),
        behind=np.zeros(len(along)),
        force=np.zeros(len(along)),
        flank=np.zeros((count, 4)),
        gap=np.zeros((count, 3)),
        touching=np.zeros(count, dtype=np.int32),
        many=np.zeros(1, dtype=np.int64),
        velocity=np.zeros((count, 3)),
    )


def parted_share(cut: CutPlane) -> float:
    """Return which share of the plane is parted: passed by the edge, or open beyond what cohesion reaches."""
    if len(cut.nodes) == 0:
        return 0.0
    holding = cut.widest < 2.0 * cut.toughness / cut.strength
    return float(1.0 - cut.area[holding].sum() / cut.whole.sum())


def _faces_on_plane(mesh: Mesh) -> Ints:
    faces = mesh.hexes[:, FACES].reshape(-1, 4)
    return np.ascontiguousarray(faces[on_plane(mesh.nodes)[faces].all(axis=1)])


def _columns(mesh: Mesh, nodes: Ints, wide: float) -> Ints:
    """Return nodes of the plane and those next to them along x (P, R), as many as lie within `wide` and one more.

    The mesh is layers of the same nodes along x.
    """
    if len(nodes) == 0:
        return np.zeros((0, 2), dtype=np.int32)
    layers = np.unique(np.round(mesh.nodes[:, 0], 9))
    rows = min(max(int(np.searchsorted(layers, wide)) + 1, 2), len(layers))
    y, z = np.round(mesh.nodes[:, 1:], 9).T
    columns = np.lexsort((mesh.nodes[:, 0], z, y)).reshape(-1, len(layers))[:, :rows]
    columns = columns[np.argsort(columns[:, 0])]
    return np.ascontiguousarray(columns[np.searchsorted(columns[:, 0], nodes)], dtype=np.int32)


def _tributary(corners: Array) -> Array:
    """Return ∫N dA of each corner of faces given by y and z of theirs (F, 4, 2), by 2×2 Gauss points; (F, 4) mm²."""
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    total = np.zeros(corners.shape[:2])
    for xi, eta in signs / np.sqrt(3.0):
        shape = (1 + signs[:, 0] * xi) * (1 + signs[:, 1] * eta) / 4
        by_xi, by_eta = signs[:, 0] * (1 + signs[:, 1] * eta) / 4, signs[:, 1] * (1 + signs[:, 0] * xi) / 4
        j = np.einsum("fki,k->fi", corners, by_xi), np.einsum("fki,k->fi", corners, by_eta)
        total += np.abs(j[0][:, 0] * j[1][:, 1] - j[0][:, 1] * j[1][:, 0])[:, None] * shape
    return total
