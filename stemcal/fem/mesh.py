"""Meshes of 8-node hexahedra: bricks, hollow and solid cylinders, and the neighbours of each element."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import cos, pi, sin
from typing import Any

import numpy as np

from stemcal.arrays import Array, Ints
from stemcal.fem.kernels import hexahedron
from stemcal.fem.kernels.search import FACES, Topology

_PORTION = 4096  # number of elements that `Mesh._portions` yields at a time


@dataclass(frozen=True)
class Mesh:
    """Nodes (N, 3) in mm and hexahedra (E, 8), corners 1-4 around the lower face and 5-8 above them."""

    nodes: Array
    hexes: Ints

    def neighbours(self) -> Ints:
        """Return the element on the other side of each face (E, 6), −1 for a face on the surface."""
        faces = np.sort(self.hexes[:, FACES].reshape(-1, 4), axis=1)
        order = np.lexsort(faces.T[::-1])
        same = np.all(faces[order[1:]] == faces[order[:-1]], axis=1)
        first, second = order[:-1][same], order[1:][same]
        behind = np.full(faces.shape[0], -1, dtype=np.int32)
        behind[first], behind[second] = second // 6, first // 6
        return behind.reshape(-1, 6)

    def topology(self, crowns: Array | None = None, slots: Ints | None = None) -> Topology:
        """Return the topology before erosion; `crowns` (default 0) and `slots` are those of `Topology`."""
        slots = np.arange(len(self.hexes), dtype=np.int32) if slots is None else slots
        crowns = np.zeros((len(self.hexes), 6)) if crowns is None else crowns
        live = np.bincount(self.hexes.ravel(), minlength=len(self.nodes)).astype(np.int32)
        return Topology(self.hexes, slots, self.neighbours(), np.ones(len(self.hexes), dtype=np.bool_), live, crowns)

    def volumes(self) -> Array:
        """Return the volume of each element, mm³, V = Σ Xₘ Bₘ / 64 (see `kernels.hexahedron`)."""
        portions = (_modal_sums(self.nodes, some) for some in self._portions())
        volumes = [hexahedron.contract.py_func(x, hexahedron.minors.py_func(y, z)) / 64.0 for x, y, z in portions]
        return np.concatenate(volumes)

    def largest_extent(self) -> float:
        """Return the largest extent of an element along a coordinate axis, mm."""
        return max(float(np.ptp(self.nodes[some], axis=1).max()) for some in self._portions())

    def modal_gradients(self) -> list[tuple[Any, ...]]:
        """Return the derivatives bₘ = ∂V/∂xₘ of the volumes (E,) by the modal amplitudes, for x, y and z."""
        x, y, z = _modal_sums(self.nodes, self.hexes)
        return [tuple(b / 8.0 for b in hexahedron.minors.py_func(p, q)) for p, q in ((y, z), (z, x), (x, y))]

    def _portions(self) -> Iterator[Ints]:
        """Yield the elements in portions whose intermediate arrays fit into the processor's caches."""
        for first in range(0, len(self.hexes), _PORTION):
            yield self.hexes[first : first + _PORTION]

    def moved(self, nodes: Array) -> Mesh:
        """Return the mesh with new positions of its nodes (N, 3), mm."""
        return replace(self, nodes=nodes)


def _modal_sums(nodes: Array, hexes: Ints) -> list[tuple[Any, ...]]:
    return [hexahedron.modal_sums.py_func(tuple(nodes[hexes, i].T)) for i in range(3)]


def brick(size: tuple[float, float, float], counts: tuple[int, int, int]) -> Mesh:
    """Return a box from the origin to `size` (mm), cut into `counts` elements along x, y, z."""
    axes = [np.linspace(0.0, s, n + 1) for s, n in zip(size, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Mesh(nodes, _hexes(_quads(counts[0], counts[1], closed=False), counts[2] + 1))


def hollow_cylinder(
    inner: float,
    outer: float,
    along: Array,
    counts: tuple[int, int],
    angles: tuple[float, float] = (-pi / 2, 3 * pi / 2),
    widths: Array | None = None,
    radii: Array | None = None,
) -> Mesh:
    """Return a hollow cylinder about the x axis, with nodes numbered along x first, then around, then through the wall.

    inner, outer: Radii, mm.
    along: x of the layers of nodes, mm, increasing.
    counts (around, through): Number of elements around and through the wall.
    angles (from, to): Begin and end of the section, rad from +y towards +z; a full turn closes it.
    widths: Relative widths of the elements around; equal if None.
    radii: Radii of the nodes from `inner` to `outer`, mm; evenly spaced if None.
    """
    around, through = counts
    closed = abs(angles[1] - angles[0] - 2 * pi) < 1e-12
    parts = np.linspace(0.0, 1.0, around + 1) if widths is None else _parts(widths)
    turn = (angles[0] + (angles[1] - angles[0]) * parts)[: around if closed else around + 1]
    radius = np.linspace(inner, outer, through + 1) if radii is None else radii
    points = radius[:, None, None] * _directions(turn)
    return _drawn_out(points.reshape(-1, 2), _quads(through, around, closed), along)


def solid_cylinder(
    radius: float,
    along: Array,
    through: int,
    widths: Array,
    whole: bool,
    turn: float = 0.0,
    beyond: Sequence[float] = (),
) -> Mesh:
    """Return a solid cylinder about the x axis: a core with a rounded square section within rings of elements.

    Without the core, the elements at the axis would have zero width.

    radius: mm.
    along: x of the layers of nodes, mm, increasing.
    through: Number of rings of elements around the core.
    widths: Relative widths of the elements around the half y ≥ 0, from the bottom to the top; at least six.
    whole: Mesh the whole section instead of that half.
    turn: Rotation of the section about the axis, rad.
    beyond: Radii of the nodes of further rings around the cylinder, mm, increasing.
    """
    points, quads = _half_disc(radius, through, widths, beyond)
    if whole:
        points, quads = _with_mirror_image(points, quads)
    c, s = cos(turn), sin(turn)
    return _drawn_out(_exact(points @ np.array([[c, s], [-s, c]])), quads, along)


def square_of_solid(around: int) -> tuple[int, int]:
    """Return the numbers of elements (up, across) of the core in half a solid section with `around` elements around."""
    across = around // 4
    return around - 2 * across, across


# Core of a solid cylinder: radius of its corners relative to the cylinder's, and bulge of its sides (1: circular arcs).
SQUARE, _BULGE = 0.5, 0.4


def _half_disc(radius: float, through: int, widths: Array, beyond: Sequence[float]) -> tuple[Array, Ints]:
    """Return the points (P, 2) in y and z of half a solid section, y ≥ 0, and its quadrilaterals (Q, 4)."""
    arc = _directions(pi * (_parts(widths) - 0.5))  # from the bottom to the top
    up, across = square_of_solid(len(widths))
    corners = arc[[across, across + up]]
    share = np.arange(across + 1) / across
    straight = np.concatenate([
        np.stack([share * corners[0, 0], np.full(across + 1, corners[0, 1])], axis=1),
        (corners[0] + np.linspace(0.0, 1.0, up + 1)[:, None] * (corners[1] - corners[0]))[1:-1],
        np.stack([share[::-1] * corners[1, 0], np.full(across + 1, corners[1, 1])], axis=1),
    ])  # fmt: skip
    rim = SQUARE * ((1.0 - _BULGE) * straight + _BULGE * arc)
    rings = rim + np.linspace(0.0, 1.0, through + 1)[1:, None, None] * (arc - rim)
    rings = np.concatenate([rings, (np.array(beyond) / radius)[:, None, None] * arc])
    inside = _filled(rim, up, across)
    # nodes of the core row by row from the bottom; the nodes on its rim begin the rings
    grid = np.arange((up + 1) * (across + 1), dtype=np.int32).reshape(up + 1, across + 1)
    begin = np.concatenate([grid[0], grid[1:-1, -1], grid[-1, ::-1]])
    ring = grid.size + np.arange(rings[..., 0].size, dtype=np.int32).reshape(-1, len(arc))
    lines = np.concatenate([begin[None], ring])
    quads = [_between(grid.T[:-1], grid.T[1:]), _between(lines[:-1], lines[1:])]
    points = radius * np.concatenate([inside.reshape(-1, 2), rings.reshape(-1, 2)])
    return points, np.concatenate(quads)


def _filled(rim: Array, up: int, across: int) -> Array:
    """Return the points (up + 1, across + 1, 2) of the half core between its rim and the symmetry axis y = 0."""
    bottom, side, top = rim[: across + 1], rim[across : across + up + 1], rim[across + up :][::-1]
    heights = bottom[0, 1] + (side[:, 1] - side[0, 1]) / (side[-1, 1] - side[0, 1]) * (top[0, 1] - bottom[0, 1])
    axis = np.stack([np.zeros(up + 1), heights], axis=1)
    u, v = np.arange(across + 1) / across, np.arange(up + 1) / up
    u, v = u[None, :, None], v[:, None, None]
    # transfinite interpolation (Gordon and Hall 1973): blends of opposite sides less the bilinear blend of the corners
    ends = (1 - v) * ((1 - u) * bottom[0] + u * bottom[-1]) + v * ((1 - u) * top[0] + u * top[-1])
    return np.asarray((1 - v) * bottom + v * top + (1 - u) * axis[:, None] + u * side[:, None] - ends)


def _between(first: Ints, second: Ints) -> Ints:
    """Return the quadrilaterals (Q, 4) between each line of nodes (L, P) and the next line (L, P)."""
    corners = (first[:, :-1], second[:, :-1], second[:, 1:], first[:, 1:])
    return np.stack([corner.ravel() for corner in corners], axis=1)


def _with_mirror_image(points: Array, quads: Ints) -> tuple[Array, Ints]:
    """Return the whole section: a half section (y ≥ 0) and its mirror image, which share the nodes on y = 0."""
    off = np.flatnonzero(points[:, 0] > 1e-12)
    image = np.arange(len(points))
    image[off] = len(points) + np.arange(len(off))
    beyond = image[quads][:, [0, 3, 2, 1]]  # in this order, the mirrored corners are counter-clockwise again
    return np.concatenate([points, points[off] * [-1.0, 1.0]]), np.concatenate([quads, beyond])


def _drawn_out(section: Array, quads: Ints, along: Array) -> Mesh:
    """Return the extrusion of a section along x; its points (y, z) are in mm, its nodes numbered along x first."""
    layers = len(along)
    nodes = np.empty((len(section), layers, 3))
    nodes[..., 0], nodes[..., 1:] = along, section[:, None]
    return Mesh(nodes.reshape(-1, 3), _hexes(quads, layers))


def _hexes(quads: Ints, layers: int) -> Ints:
    """Return the hexahedra of an extruded section whose nodes are numbered along the extrusion first."""
    first = (quads * layers)[:, None] + np.arange(layers - 1)[None, :, None]
    return np.concatenate([first, first + 1], axis=2).reshape(-1, 8).astype(np.int32)


def _quads(rows: int, columns: int, closed: bool) -> Ints:
    """Return the quadrilaterals of a grid of points numbered row by row; `closed` joins the ends of each row."""
    points = columns if closed else columns + 1
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    return np.stack([(i + di) * points + (j + dj) % points for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1)


def _directions(turn: Array) -> Array:
    """Return unit vectors (y, z) at angles (rad) from +y towards +z, (…, 2)."""
    return np.stack([_exact(np.cos(turn)), _exact(np.sin(turn))], axis=-1)


def _parts(widths: Array) -> Array:
    """Divide the interval from 0 to 1 into pieces of the given relative widths; return their n + 1 boundaries."""
    return np.asarray(np.concatenate([[0.0], np.cumsum(widths) / np.sum(widths)]))


def _exact(values: Array) -> Array:
    """Round to 15 digits, so that nodes on a mirror plane have a coordinate of exactly 0."""
    return np.round(values, 15) + 0.0
