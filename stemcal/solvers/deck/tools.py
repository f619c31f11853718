"""Meshes of the blade and the supports. They are rigid, so only their surfaces matter."""

from math import ceil, cos, pi, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array
from stemcal.cutting.parts import Blade, Stem, Supports
from stemcal.fem.mesh import Mesh

# Least number of elements across half the blade edge, and around the inner edge of a support.
_HALF = 2
_AROUND = 4
# Length of the facets of a rounded edge, in units of the element size of the stem.
_FACET = 0.5
# Height of the V of a sharp edge, in units of the blade thickness. The contact penetration is smaller.
_VEE = 0.15
# Lengths of the supports beyond the ends of the stem and below their rounding, mm.
_BEYOND, _BELOW = 5.0, 10.0


def blade_mesh(
    blade: Blade, length: float, lowest: float, size: float, stroke: float | None = None, samples: int | None = None
) -> Mesh:
    """Return the mesh of a blade with its edge along y and its lowest line at z = `lowest`, with elements of `size` mm.

    With `samples`, the edge is a line with this number of nodes per element, symmetric about y = 0 as in the embedded
    solver. The upper part of the blade, which does not reach the stem within the stroke, is one element high.
    """
    section = _blade_section(blade, size, stroke, samples is not None)
    section[..., 1] += lowest
    if samples is None:
        return _drawn_out([section], _even(-0.5 * length, 0.5 * length, size))
    spacing = size / samples
    half = ceil(0.5 * length / spacing - 0.5 - 1e-9)
    return _drawn_out([section], np.linspace(-half - 0.5, half + 0.5, 2 * half + 2) * spacing)


def supports_mesh(supports: Supports, stem: Stem, size: float, knife: float | None = None, slide: float = 0.0) -> Mesh:
    """Return the mesh of both supports below the stem; the gap between them is the clearance.

    knife: Distance of a fixed knife from the plane of the cut, mm; it is on the left and replaces both supports.
    slide: Distance that the blade slides along y, and may drag the stem, mm.
    """
    r, near = supports.fillet_radius, 0.5 * supports.clearance if knife is None else knife
    top = -0.5 * stem.outer_diameter
    far = max(0.5 * stem.length if knife is None else supports.height, near + r) + _BEYOND
    turn = np.linspace(pi, 0.5 * pi, (_AROUND if r > 0 else 0) + 1)
    rounding = np.stack([near + r + r * np.cos(turn), top - r + r * np.sin(turn)], axis=-1)
    flat = _even(near + r, far, size)[1:]
    upper = np.concatenate([rounding, np.stack([flat, np.full(flat.size, top)], axis=-1)])
    lower = np.stack([upper[:, 0], np.full(len(upper), top - r - _BELOW)], axis=-1)
    right = np.stack([lower, upper])  # (2, columns, 2): nodes x, z of the flat bottom and of the rounded top
    left = right * (-1.0, 1.0)
    half = 0.5 * stem.outer_diameter
    return _drawn_out([right, left] if knife is None else [left], _even(-half, half + slide, size))


def _blade_section(blade: Blade, size: float, stroke: float | None = None, line: bool = False) -> Array:
    """Return the nodes (rows, columns, 2) of the cross-section of the blade in x and z, with the edge at z = 0.

    The first row follows the edge; the rows above it are horizontal, from one flank of the blade to the other. A body
    that is thinner than the rounding is widened. The elements are `size` long. With `line`, the edge is sharp: the
    first row is a V with one node at the edge. More nodes near it would also touch the stem.
    """
    r, t = blade.edge_radius, blade.thickness
    both = blade.bevel == "both"
    lean_left = radians(0.5 * blade.edge_angle) if both else 0.0
    lean_right = radians(blade.edge_angle) - lean_left
    t = max(t, r * (cos(lean_left) + cos(lean_right)) * (1.0 + 1e-6))
    body = (-0.5 * t, 0.5 * t) if both else (-r, t - r)
    # the flank is tangent to the rounding at r (cos α, 1 − sin α) and meets the body at the shoulder
    touch, shoulder = r * cos(lean_right), r - r * sin(lean_right)
    shoulder += (body[1] - touch) / tan(lean_right)

    def ends(z: float) -> tuple[float, float]:
        left = -r * cos(lean_left) - (z - r + r * sin(lean_left)) * tan(lean_left)
        return max(body[0], left), min(body[1], touch + (z - r + r * sin(lean_right)) * tan(lean_right))

    if line:  # the V: left flank, edge, right flank
        height = min(size, _VEE * t)
        (left, right) = ends(height)
        edge = np.array([[left, height], [0.0, 0.0], [right, height]])
    else:
        edge = _rounding(r, lean_left, lean_right, size)
    rows = [edge]
    start = float(edge[[0, -1], 1].max())
    touched = blade.width if stroke is None else min(blade.width, shoulder + 2.0 * stroke)
    top = [blade.width] if touched < blade.width else []
    for z in (*_even(start, shoulder, size)[1:], *_even(shoulder, touched, 4 * size)[1:], *top):
        rows.append(np.stack([np.linspace(*ends(z), len(edge)), np.full(len(edge), z)], axis=-1))
    return np.stack(rows)


def _rounding(r: float, lean_left: float, lean_right: float, size: float) -> Array:
    half = max(_HALF, ceil(r * (0.5 * pi - lean_right) / (_FACET * size)))
    lowest = -0.5 * pi
    turn = np.concatenate(
        [np.linspace(-pi + lean_left, lowest, half + 1), np.linspace(lowest, -lean_right, half + 1)[1:]]
    )
    return np.stack([r * np.cos(turn), r + r * np.sin(turn)], axis=-1)


def _even(low: float, high: float, size: float) -> Array:
    """Return equally spaced points from low to high at distances of at most `size`."""
    return np.linspace(low, high, max(1, ceil((high - low) / size - 1e-9)) + 1)


def _drawn_out(sections: list[Array], y: Array) -> Mesh:
    parts = [_one_drawn_out(section, y) for section in sections]
    offsets = np.cumsum([0, *(len(nodes) for nodes, _ in parts[:-1])])
    nodes = np.concatenate([nodes for nodes, _ in parts])
    hexes = np.concatenate([hexes + offset for (_, hexes), offset in zip(parts, offsets, strict=True)])
    _, first, same = np.unique(np.round(nodes, 9), axis=0, return_index=True, return_inverse=True)
    return Mesh(nodes[first], same.reshape(-1)[hexes].astype(np.int32))


def _one_drawn_out(section: Array, y: Array) -> tuple[Array, NDArray[np.int64]]:
    rows, columns, _ = section.shape
    flat = section.reshape(-1, 2)
    nodes = np.concatenate([np.insert(flat, 1, value, axis=1) for value in y])
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    quads = np.stack([corner, corner + 1, corner + columns + 1, corner + columns], axis=-1)
    # x, z, −y are right-handed: with a counter-clockwise quad, the second face of an element must be at smaller y
    here, after = flat[quads], np.roll(flat[quads], -1, axis=1)
    turning_left = np.sum(here[..., 0] * after[..., 1] - here[..., 1] * after[..., 0]) > 0.0  # twice the area
    quads = quads if turning_left else quads[:, ::-1]
    layers = np.arange(len(y) - 1)[:, None, None] * rows * columns
    return nodes, np.concatenate([quads + layers + rows * columns, quads + layers], axis=2).reshape(-1, 8)
