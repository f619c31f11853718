"""Meshes of 8-node hexahedra: bricks and hollow cylinders, and who neighbours whom."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels import hexahedron
from stemcal.fem.kernels.search import FACES, Topology

Array = NDArray[np.float64]
Ints = NDArray[np.int32]

# Corner offsets along (i, j, k) of a structured grid, in the order of the hexahedron's corners.
_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_PORTION = 4096  # elements


@dataclass(frozen=True)
class Mesh:
    """Nodes (N, 3) in mm and hexahedra (E, 8), corners 1-4 around the lower face and 5-8 above them."""

    nodes: Array
    hexes: Ints

    def neighbours(self) -> Ints:
        """Return (E, 6): the element behind each face, −1 where the face is outside."""
        faces = np.sort(self.hexes[:, FACES].reshape(-1, 4), axis=1)
        order = np.lexsort(faces.T[::-1])
        same = np.all(faces[order[1:]] == faces[order[:-1]], axis=1)
        first, second = order[:-1][same], order[1:][same]
        behind = np.full(faces.shape[0], -1, dtype=np.int32)
        behind[first], behind[second] = second // 6, first // 6
        return behind.reshape(-1, 6)

    def topology(self, crowns: Array | None = None, slots: Ints | None = None) -> Topology:
        """Return a fresh topology with every element standing, its faces flat or with the given crowns.

        The state of the elements lies in `slots` (E,), one after the other if None.
        """
        slots = np.arange(len(self.hexes), dtype=np.int32) if slots is None else slots
        crowns = np.zeros((len(self.hexes), 6)) if crowns is None else crowns
        live = np.bincount(self.hexes.ravel(), minlength=len(self.nodes)).astype(np.int32)
        return Topology(self.hexes, slots, self.neighbours(), np.ones(len(self.hexes), dtype=np.bool_), live, crowns)

    def volumes(self) -> Array:
        """Return the volume of each element, mm³, V = Σ Xₘ Bₘ / 64 (see `kernels.hexahedron`)."""
        return np.concatenate([_volumes(self.nodes, some) for some in self._portions()])

    def largest_extent(self) -> float:
        """Return how far an element reaches at most along any axis, mm."""
        return max(float(np.ptp(self.nodes[some], axis=1).max()) for some in self._portions())

    def modal_gradients(self) -> list[tuple[Any, ...]]:
        """Return for each of x, y, z the derivatives b = ∂V/∂xₘ by the modes of the corners, tuples of arrays (E,)."""
        x, y, z = _modal_sums(self.nodes, self.hexes)
        return [tuple(b / 8.0 for b in hexahedron.minors.py_func(p, q)) for p, q in ((y, z), (z, x), (x, y))]

    def _portions(self) -> Iterator[Ints]:
        """Give the elements some at a time: what is worked out on the way for all of them would not fit the caches."""
        for first in range(0, len(self.hexes), _PORTION):
            yield self.hexes[first : first + _PORTION]

    def moved(self, nodes: Array) -> Mesh:
        """Return the same mesh with its nodes elsewhere."""
        return replace(self, nodes=nodes)


def _modal_sums(nodes: Array, hexes: Ints) -> list[tuple[Any, ...]]:
    return [hexahedron.modal_sums.py_func(tuple(nodes[hexes, i].T)) for i in range(3)]


def _volumes(nodes: Array, hexes: Ints) -> Array:
    x, y, z = _modal_sums(nodes, hexes)
    return np.asarray(hexahedron.contract.py_func(x, hexahedron.minors.py_func(y, z)) / 64.0)


def brick(size: tuple[float, float, float], counts: tuple[int, int, int]) -> Mesh:
    """Return a box from the origin to `size` (mm), cut into `counts` elements along x, y, z."""
    axes = [np.linspace(0.0, s, n + 1) for s, n in zip(size, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Mesh(nodes, _structured(counts, closed=False))


def hollow_cylinder(
    inner: float,
    outer: float,
    along: Array,
    counts: tuple[int, int],
    angles: tuple[float, float] = (-pi / 2, 3 * pi / 2),
    widths: Array | None = None,
) -> Mesh:
    """Return a hollow cylinder about the x axis, its nodes numbered along it first, then around, then through the wall.

    Parameters
    ----------
    inner, outer : float
        Radii, mm.
    along : array
        x of the layers of nodes, mm, increasing.
    counts : (around, through)
        Elements around and through the wall.
    angles : (from, to)
        Where the section begins and ends, from +y towards +z; a full turn closes it.
    widths : array (around,), optional
        How wide the elements around are, in proportion; all alike if None.
    """
    around, through = counts
    closed = abs(angles[1] - angles[0] - 2 * pi) < 1e-12
    parts = np.linspace(0.0, 1.0, around + 1) if widths is None else _parts(widths)
    turn = (angles[0] + (angles[1] - angles[0]) * parts)[: around if closed else around + 1]
    radius = np.linspace(inner, outer, through + 1)
    r, a, x = np.meshgrid(radius, turn, along, indexing="ij")
    nodes = np.stack([x, r * _exact(np.cos(a)), r * _exact(np.sin(a))], axis=-1).reshape(-1, 3)
    return Mesh(nodes, _structured((through, around, len(along) - 1), closed))


def _parts(widths: Array) -> Array:
    """Return where pieces of the given widths begin and end in a whole of 1."""
    return np.asarray(np.concatenate([[0.0], np.cumsum(widths) / np.sum(widths)]))


def _exact(values: Array) -> Array:
    """Round to 15 digits, so that nodes meant to lie on a mirror plane do."""
    return np.round(values, 15) + 0.0


def _structured(counts: tuple[int, int, int], closed: bool) -> Ints:
    """Return the hexahedra of a grid of nodes numbered k fastest; `closed` joins its ends along j."""
    ni, nj, nk = counts
    rows = nj if closed else nj + 1
    i, j, k = (a.ravel() for a in np.meshgrid(np.arange(ni), np.arange(nj), np.arange(nk), indexing="ij"))
    corners = [((i + di) * rows + (j + dj) % rows) * (nk + 1) + k + dk for di, dj, dk in _CORNERS]
    return np.stack(corners, axis=1).astype(np.int32)
