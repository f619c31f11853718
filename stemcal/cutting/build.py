"""From a shear test to its finite element model: mesh, materials, tools; how large the mesh will be."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, inf, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.constraints import held_components
from stemcal.cutting.parts import SHARES, Discretisation, ShearTest, Stem
from stemcal.fem.contact import Tool
from stemcal.fem.kernels.search import FACES
from stemcal.fem.material import Layers, Material
from stemcal.fem.mesh import SQUARE, Mesh, hollow_cylinder, solid_cylinder, square_of_solid
from stemcal.fem.model import Model
from stemcal.fem.parting import doubled

Array = NDArray[np.float64]

# Elements keep the length of those under the edge over this share of their number on either side of it.
EVEN_SHARE = 0.3
# Through a layer: with one element, whose point is in its middle, it does not bend; with 1, 3 and 5 through a skin of a
# sixteenth of the diameter the cutting force was 89.8, 124.9 and 127.0 N.
FEWEST_IN_LAYER = 3
# Around half a section: fewer do not leave room for the middle of a solid one.
_FEWEST_AROUND = 4
# How far the supports reach outwards and down, mm: past anything the stem can do.
_FAR = 200.0


def build(test: ShearTest) -> Model:
    """Return the finite element model of a shear test."""
    how = test.discretisation
    mesh = stem_mesh(test.stem, how, layers=_layers_of(test), parts=test.parts)
    mesh = doubled(mesh) if test.parts else mesh
    return Model(
        mesh=mesh,
        material=materials(mesh, test.stem, test.material, test.outer),
        tools=(_blade(test), *_supports(test)),
        contact=test.contact,
        hourglass=how.hourglass,
        integration=how.integration,
        held=held_components(mesh, test),
        crowns=crowns(mesh),
    )


def stem_mesh(
    stem: Stem,
    how: Discretisation,
    rests_at: float | None = None,
    widths: Array | None = None,
    layers: Array | None = None,
    parts: bool = False,
) -> Mesh:
    """Return the mesh of the stem, or of the part of it that the symmetry leaves.

    Instead of those that `how` asks for, `widths` of the elements around half the stem from the bottom to the top (in
    proportion) and `layers` of nodes along it (x, mm) may be given. With `rests_at` a layer of nodes is at that
    distance from the blade (mm) on either side: what rests on a support is nodes, and the span is else that between the
    next ones. Nodes lie on the mirror planes. Where the stem `parts` under the edge there are nodes as well, in a model
    of both sides with elements of no length between two layers of them (`fem.parting.doubled`).
    """
    outer, inner = 0.5 * stem.outer_diameter, 0.5 * stem.outer_diameter * stem.diameter_ratio
    if widths is None:  # from the bottom to the top under the edge
        widths = np.linspace(how.coarsening_around, 1.0, around_half(outer, how))
    counts, surfaces = through_layers(stem, how), stem.radii
    layers = _layers(stem.length, how) if layers is None else layers
    if rests_at is not None:
        layers = _supported(layers, rests_at)
    if parts and how.symmetry != "quarter":
        middle = int(np.argmin(np.abs(layers)))  # moved to the edge
        layers = np.concatenate([layers[:middle], [0.0, 0.0], layers[middle + 1 :]])
    whole = how.symmetry == "none"
    turn = how.turn * pi * widths[-1] / np.sum(widths) if whole else 0.0
    radii = [np.linspace(*ends, n + 1)[1:] for ends, n in zip(pairwise(surfaces), counts, strict=True)]
    if stem.diameter_ratio == 0.0:
        beyond = np.concatenate([[], *radii[1:]])
        return solid_cylinder(surfaces[1], layers, counts[0], widths, whole, turn, beyond.tolist())
    if whole:
        widths = np.concatenate([widths, widths[::-1]])
    first, angle = turn - 0.5 * pi, 2.0 * pi if whole else pi
    turns, whole_wall = (first, first + angle), np.concatenate([surfaces[:1], *radii])
    return hollow_cylinder(inner, outer, layers, (len(widths), sum(counts)), turns, widths, whole_wall)


def materials(mesh: Mesh, stem: Stem, inner: Material, outer: tuple[Material, ...]) -> Material | Layers:
    """Return the material of the elements of a stem, from those of its innermost layer and of those around it."""
    if not outer:
        return inner
    radius = np.linalg.norm(mesh.nodes[mesh.hexes, 1:], axis=2).mean(axis=1)
    return Layers((inner, *reversed(outer)), np.searchsorted(stem.radii[1:-1], radius))


def through_wall(stem: Stem, how: Discretisation) -> int:
    """Return the number of elements through the wall; for a solid stem, the number of rings around its middle."""
    return sum(through_layers(stem, how))


def through_layers(stem: Stem, how: Discretisation) -> tuple[int, ...]:
    """Return the number of elements through each layer, from the inside; each has nodes on both of its surfaces.

    The wall of a solid stem is its radius; the core covers half of its innermost layer, which has that many rings of
    elements around.
    """
    radii, wall = stem.radii, 0.5 * stem.outer_diameter * (1.0 - stem.diameter_ratio)
    fewest = FEWEST_IN_LAYER if stem.layers else 1
    counts = []
    for low, high in pairwise(radii):
        share = 1.0 - SQUARE if low == 0.0 else 1.0
        wanted = how.through_wall and round(share * how.through_wall * ((high - low) / wall if stem.layers else 1.0))
        least = 1 if low == 0.0 else fewest
        counts.append(max(least, wanted or ceil(share * (high - low) / how.element_size - 1e-9)))
    return tuple(counts)


def around_half(radius: float, how: Discretisation) -> int:
    """Return the number of elements around half the stem."""
    return max(_FEWEST_AROUND, round(pi * radius / (0.5 * (1.0 + how.coarsening_around) * how.element_size)))


def _pairs_along(length: float, how: Discretisation) -> int:
    """Return the number of elements on either side of the cut, next to a row under the edge."""
    odd = 1 if how.edge_over == "elements" else 0
    return max(1, ceil((length / (_mean_length(how) * how.element_size) - odd) / 2 - 1e-9))


def _mean_length(how: Discretisation) -> float:
    """Return the mean length of the elements along the stem over that of those under the edge."""
    return 1.0 + (1.0 - EVEN_SHARE) * 0.5 * (how.coarsening - 1.0)


def _layers(length: float, how: Discretisation) -> Array:
    """Return x of the layers of nodes: an odd number of elements if the edge is over elements, else an even one."""
    odd = 1 if how.edge_over == "elements" else 0
    right = _outwards(length, how)
    under = float(right[0]) * (1 + odd)
    middle = [] if odd else [0.0]
    if how.symmetry == "quarter":
        return np.concatenate([middle, right])
    return np.concatenate([-right[::-1], middle, right]) + how.shift * under


def _outwards(length: float, how: Discretisation) -> Array:
    """Return x of the layers of nodes to the right of the middle, or of the middle row of elements.

    The elements are even at first, then longer and longer; a row under the edge counts half on either side.
    """
    odd = 1 if how.edge_over == "elements" else 0
    outwards = np.linspace(0.0, 1.0, _pairs_along(length, how) + odd)
    sizes = np.interp(outwards, (EVEN_SHARE, 1.0), (1.0, how.coarsening))
    sizes[0] *= 1.0 - 0.5 * odd
    return np.asarray(0.5 * length * np.cumsum(sizes) / np.sum(sizes))


def _supported(layers: Array, rests_at: float, sides: tuple[float, ...] = (1.0, -1.0)) -> Array:
    """Return layers of nodes, on either side of the cut the nearest one moved to where the stem rests.

    Those between half way there and the end of the stem give way in proportion. Where one element goes so far, or the
    stem ends before, nothing moves.
    """
    moved, middle = layers.copy(), 0.5 * rests_at
    for side in sides:
        away = side * layers
        nearest, end = float(away[np.argmin(np.abs(away - rests_at))]), float(away.max())
        if middle < nearest < end and rests_at < end:
            beyond = away > middle
            to = np.interp(away[beyond], (middle, nearest, end), (middle, rests_at, end))
            moved[beyond] = side * to
    return moved


def crowns(mesh: Mesh) -> Array:
    """Return the height of a circle about the axis over the middle of each face with all corners on it (E, 6), mm."""
    corners = mesh.nodes[mesh.hexes[:, FACES], 1:]
    radius = np.linalg.norm(corners, axis=3)
    round_ = np.ptp(radius, axis=2) < 1e-9
    return np.where(round_, radius[:, :, 0] - np.linalg.norm(corners.mean(axis=2), axis=2), 0.0)


def _layers_of(test: ShearTest) -> Array:
    """Return x of the layers of nodes: a clamp is at the left end, and one is where the stem rests on a block."""
    how, supports, height = test.discretisation, test.supports, test.supports.height
    if supports.kind == "span":
        return _supported(_layers(test.stem.length, how), 0.5 * supports.clearance + supports.fillet_radius)
    right, left = _outwards(2.0 * (test.stem.length - height), how), _outwards(2.0 * height, how)
    layers: Array = np.concatenate([-left[::-1], [0.0], right]) + how.shift * right[0]
    if supports.kind == "clamped":
        return layers
    return _supported(layers, _counter_edge(test) + supports.fillet_radius, sides=(-1.0,))


def _counter_edge(test: ShearTest) -> float:
    """Return the distance of a counter-edge from the plane of the cut, its clearance from the blade, mm."""
    half = 0.5 * test.blade.thickness if test.blade.bevel == "both" else 0.0
    return half + test.supports.clearance


def _blade(test: ShearTest) -> Tool:
    top = 0.5 * test.stem.outer_diameter
    return Tool(
        corners=test.blade.outline(),
        radius=test.blade.edge_radius,
        height=top + test.loading.gap,
        speed=-test.loading.speed * cos(radians(test.loading.sliding_angle)),
        slide=test.loading.speed * sin(radians(test.loading.sliding_angle)),
        edge=0.0,
        spread=test.blade.edge_spread,
        parts=test.parts,
    )


def _supports(test: ShearTest) -> tuple[Tool, ...]:
    """Return the blocks: on the right, and unless a mirror makes it on the left; a counter-edge is only on the left."""
    r, kind = test.supports.fillet_radius, test.supports.kind
    near = r + (0.5 * test.supports.clearance if kind == "span" else _counter_edge(test))
    height = -0.5 * test.stem.outer_diameter
    far = near + _FAR
    right = ((near, -r), (near, -_FAR), (far, -_FAR), (far, -r))
    left = tuple((-x, z) for x, z in reversed(right))
    mirrored = test.discretisation.symmetry == "quarter"
    blocks = {"span": (right,) if mirrored else (right, left), "clamped": (), "counter_edge": (left,)}[kind]
    return tuple(Tool(corners, r, height) for corners in blocks)


# ---- the size of the mesh, without building it

# What building and integrating a model takes at its most, bytes per element; `tests/cutting/test_size.py` measures it.
_BYTES = 2900.0
# Volume of the innermost elements over that of the mean element at the same place along the stem, roughly.
_NARROWER = 0.7


@dataclass(frozen=True)
class MeshSize:
    """Number of elements, inf if countless; about the smallest one's edge, mm; memory of a simulation, bytes."""

    elements: float
    smallest: float
    memory: float


def mesh_size(stem: Stem, how: Discretisation) -> MeshSize:
    """Return the size of the mesh that `stem_mesh` would make."""
    try:
        pairs, through = float(_pairs_along(stem.length, how)), float(through_wall(stem, how))
        around = float(around_half(0.5 * stem.outer_diameter, how))
    except OverflowError:
        return MeshSize(inf, 0.0, inf)
    odd = 1 if how.edge_over == "elements" else 0
    along = pairs if how.symmetry == "quarter" else 2.0 * pairs + odd
    solid = stem.diameter_ratio == 0.0
    up, across = square_of_solid(around_half(0.5 * stem.outer_diameter, how)) if solid else (0, 0)
    elements = along * (around * through + up * across) * (2.0 if how.symmetry == "none" else 1.0)
    # those under the edge have a share of the mean element's length and width; the innermost are narrower
    share = _mean_length(how) * 0.5 * (1.0 + how.coarsening_around)
    mean = SHARES[how.symmetry] * stem.length * 0.25 * pi * (stem.outer_diameter * stem.outer_diameter) / elements
    volume = _NARROWER * mean * (1.0 - stem.diameter_ratio * stem.diameter_ratio) / share
    thin = (t / n for t, n in zip(reversed(stem.layers), through_layers(stem, how)[1:], strict=True))
    return MeshSize(elements, min([volume ** (1.0 / 3.0), *thin]), _BYTES * elements)
