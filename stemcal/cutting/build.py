"""The finite element model of a shear test: mesh, materials, tools; an estimate of the size of the mesh."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, inf, pi, radians, sin

import numpy as np

from stemcal.arrays import Array
from stemcal.cutting.constraints import held_components
from stemcal.cutting.parts import SHARES, Discretisation, ShearTest, Stem
from stemcal.fem.kernels.search import FACES
from stemcal.fem.material import Layers, Material
from stemcal.fem.mesh import SQUARE, Mesh, hollow_cylinder, solid_cylinder, square_of_solid
from stemcal.fem.model import Model
from stemcal.fem.parting import doubled
from stemcal.fem.tools import Tool

# On each side, at least this share of the elements, those nearest to the edge, are as long as those under the edge.
_EVEN_SHARE = 0.3
# Minimum number of elements through a layer: a single one with a central integration point has no bending stiffness.
# With 1, 3 and 5 elements through a skin of d/16, the cutting force was 89.8, 124.9 and 127.0 N.
_FEWEST_IN_LAYER = 3
# Minimum number of elements around half a section: fewer cannot surround the core of a solid stem.
_FEWEST_AROUND = 4
# Extent of the supports outwards and down, mm: larger than any possible motion of the stem.
_FAR = 200.0


def build(test: ShearTest) -> Model:
    """Return the finite element model of a shear test."""
    how = test.discretisation
    mesh = stem_mesh(test.stem, how, layers=layers_of(test), parts=test.parts)
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
    """Return the mesh of the stem, or of the half or quarter that is modelled; mirror planes pass through nodes.

    rests_at: Distance from the blade (mm) at which a layer of nodes is placed on either side. Nodes rest on a support,
        so without this layer the span would be the distance between the layers next to the supports.
    widths: Relative widths of the elements around half the stem, from the bottom to the top; by default from `how`.
    layers: x of the layers of nodes along the stem, mm; by default from `how`.
    parts: Whether the stem parts on the plane under the edge. A layer of nodes is then placed there. In a model of both
        sides these are two layers with elements of zero length between them (see `fem.parting.doubled`).
    """
    outer, inner = 0.5 * stem.outer_diameter, 0.5 * stem.outer_diameter * stem.diameter_ratio
    if widths is None:  # the edge is above the top of the stem, where the elements are narrowest
        widths = np.linspace(how.coarsening_around, 1.0, around_half(outer, how))
    counts, surfaces = through_layers(stem, how), stem.radii
    layers = _layers(stem.length, how) if layers is None else layers
    if rests_at is not None:
        layers = _supported(layers, rests_at)
    if parts and how.symmetry != "quarter":
        middle = int(np.argmin(np.abs(layers)))  # this layer is moved to the edge
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
    """Return the material of each element of a stem: `inner` in the innermost layer, `outer` in the other layers."""
    if not outer:
        return inner
    radius = np.linalg.norm(mesh.nodes[mesh.hexes, 1:], axis=2).mean(axis=1)
    return Layers((inner, *reversed(outer)), np.searchsorted(stem.radii[1:-1], radius))


def through_wall(stem: Stem, how: Discretisation) -> int:
    """Return the number of elements through the wall; for a solid stem, of the rings around its core."""
    return sum(through_layers(stem, how))


def through_layers(stem: Stem, how: Discretisation) -> tuple[int, ...]:
    """Return the number of elements through each layer, from the inside; nodes are on the interfaces of layers.

    In a solid stem, the innermost layer has rings of elements around a core with half the radius of the layer.
    """
    radii, wall = stem.radii, 0.5 * stem.outer_diameter * (1.0 - stem.diameter_ratio)
    fewest = _FEWEST_IN_LAYER if stem.layers else 1
    counts = []
    for low, high in pairwise(radii):
        share = 1.0 - SQUARE if low == 0.0 else 1.0
        wanted = how.through_wall and round(share * how.through_wall * ((high - low) / wall if stem.layers else 1.0))
        least = 1 if low == 0.0 else fewest
        counts.append(max(least, wanted or ceil(share * (high - low) / how.element_size - 1e-9)))
    return tuple(counts)


def around_half(radius: float, how: Discretisation) -> int:
    """Return the number of elements around half of a stem with an outer `radius` in mm."""
    return max(_FEWEST_AROUND, round(pi * radius / (0.5 * (1.0 + how.coarsening_around) * how.element_size)))


def _pairs_along(length: float, how: Discretisation) -> int:
    odd = 1 if how.edge_over == "elements" else 0
    return max(1, ceil((length / (_mean_length(length, how) * how.element_size) - odd) / 2 - 1e-9))


def _mean_length(length: float, how: Discretisation) -> float:
    return 1.0 + (1.0 - _even_share(length, how)) * 0.5 * (how.coarsening - 1.0)


def _even_share(length: float, how: Discretisation) -> float:
    """Return the share of the elements, those nearest to the edge, that are as long as the elements under the edge."""
    even = min(how.even, 0.5 * length)
    longer = (0.5 * length - even) / (0.5 * (1.0 + how.coarsening))
    return max(_EVEN_SHARE, even / (even + longer))


def _layers(length: float, how: Discretisation) -> Array:
    """Return x of the layers of nodes, mm; the number of elements is odd if the edge is over a row of elements."""
    odd = 1 if how.edge_over == "elements" else 0
    right = _outwards(length, how)
    under = float(right[0]) * (1 + odd)
    middle = [] if odd else [0.0]
    if how.symmetry == "quarter":
        return np.concatenate([middle, right])
    return np.concatenate([-right[::-1], middle, right]) + how.shift * under


def _outwards(length: float, how: Discretisation) -> Array:
    """Return x of the layers of nodes to the right of the middle (mm), for elements that become longer outwards.

    If the edge is over a row of elements, half the length of this row is on either side of the middle.
    """
    odd = 1 if how.edge_over == "elements" else 0
    outwards = np.linspace(0.0, 1.0, _pairs_along(length, how) + odd)
    even = _even_share(length, how)
    sizes = np.where(outwards > even, np.interp(outwards, (even, 1.0), (1.0, how.coarsening)), 1.0)
    sizes[0] *= 1.0 - 0.5 * odd
    return np.asarray(0.5 * length * np.cumsum(sizes) / np.sum(sizes))


def _supported(layers: Array, rests_at: float, sides: tuple[float, ...] = (1.0, -1.0)) -> Array:
    """Move the layer of nodes that is nearest to the distance `rests_at` to this distance, on each of `sides`.

    Layers from half that distance to the end of the stem move in proportion. Nothing moves if the nearest layer is not
    between these limits, or if the stem is too short.
    """
    moved, middle = layers.copy(), 0.5 * rests_at
    for side in sides:
        away = side * layers
        nearest, end = float(away[np.argmin(np.abs(away - rests_at))]), float(away.max())
        if middle < nearest < end and rests_at < end:
            beyond = away > middle
            moved[beyond] = side * np.interp(away[beyond], (middle, nearest, end), (middle, rests_at, end))
    return moved


def crowns(mesh: Mesh) -> Array:
    """Return the height of the true round surface over the middle of each face (E, 6), mm; 0 for other faces."""
    corners = mesh.nodes[mesh.hexes[:, FACES], 1:]
    radius = np.linalg.norm(corners, axis=3)
    round_ = np.ptp(radius, axis=2) < 1e-9
    return np.where(round_, radius[:, :, 0] - np.linalg.norm(corners.mean(axis=2), axis=2), 0.0)


def layers_of(test: ShearTest) -> Array:
    """Return x of the layers of nodes, mm, with a layer where the stem rests on a block; a clamp is at the first."""
    how, supports, height = test.discretisation, test.supports, test.supports.height
    if supports.kind == "span":
        return _supported(_layers(test.stem.length, how), supports.rests_at)
    right, left = _outwards(2.0 * (test.stem.length - height), how), _outwards(2.0 * height, how)
    middle = [] if how.edge_over == "elements" else [0.0]  # else the first element on either side is a half one
    layers: Array = np.concatenate([-left[::-1], middle, right]) + how.shift * right[0]
    if supports.kind == "clamped":
        return layers
    return _supported(layers, counter_edge(test) + supports.fillet_radius, sides=(-1.0,))


def counter_edge(test: ShearTest) -> float:
    """Return the distance of a counter-edge from the plane of the cut, mm: half the blade thickness plus clearance."""
    return (0.5 * test.blade.thickness if test.blade.bevel == "both" else 0.0) + test.supports.clearance


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
    """Return the support blocks on both sides; the right one for a quarter model, the left one for a counter-edge."""
    r, kind = test.supports.fillet_radius, test.supports.kind
    near = test.supports.rests_at if kind == "span" else r + counter_edge(test)
    height = -0.5 * test.stem.outer_diameter
    far = near + _FAR
    right = ((near, -r), (near, -_FAR), (far, -_FAR), (far, -r))
    left = tuple((-x, z) for x, z in reversed(right))
    mirrored = test.discretisation.symmetry == "quarter"
    blocks = {"span": (right,) if mirrored else (right, left), "clamped": (), "counter_edge": (left,)}[kind]
    return tuple(Tool(corners, r, height) for corners in blocks)


# Peak memory of building and integrating a model, bytes per element; `tests/cutting/test_size.py` measures it.
_BYTES = 2900.0
# Approximate ratio of the volume of the innermost elements to the mean volume at the same position along the stem.
_NARROWER = 0.7


@dataclass(frozen=True)
class MeshSize:
    """Number of elements (inf on overflow), approximate size of the smallest, mm, and memory of a simulation, bytes."""

    elements: float
    smallest: float
    memory: float


def mesh_size(stem: Stem, how: Discretisation) -> MeshSize:
    """Return the size of the mesh that `stem_mesh` would build, without building it."""
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
    # elements under the edge are shorter and narrower than the mean by this factor; the innermost are narrower still
    share = _mean_length(stem.length, how) * 0.5 * (1.0 + how.coarsening_around)
    mean = SHARES[how.symmetry] * stem.length * 0.25 * pi * (stem.outer_diameter * stem.outer_diameter) / elements
    volume = _NARROWER * mean * (1.0 - stem.diameter_ratio * stem.diameter_ratio) / share
    thin = (t / n for t, n in zip(reversed(stem.layers), through_layers(stem, how)[1:], strict=True))
    return MeshSize(elements, min([volume ** (1.0 / 3.0), *thin]), _BYTES * elements)
