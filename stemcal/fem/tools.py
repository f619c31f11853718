"""Rigid tools and the constants of contact as a user of the solver sets them; the law is in `kernels.contact`."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np

from stemcal.arrays import Array, Ints
from stemcal.fem.kernels.contact import SAMPLES, EdgeArrays, FrictionNumbers, ToolArrays, outline_distance
from stemcal.fem.kernels.search import FACES, Topology
from stemcal.fem.kernels.spread_edge import SpreadEdge


@dataclass(frozen=True)
class Tool:
    """A rigid tool that moves along z: a convex polygon in (x, z), offset outwards by a radius, extruded along y.

    corners: Counter-clockwise, in the tool's own frame, mm.
    radius: Radius of all its edges, mm: points nearer than this to the polygon are inside the tool.
    height, speed: z of the frame's origin at the start (mm) and its velocity (mm/s).
    edge: x of a cutting edge whose lowest line is at z = 0 of the frame; None for a tool without a cutting edge.
    spread: Distance from the tool within which its edge acts on the surface next to it, mm (`kernels.spread_edge`);
        with 0 the edge acts along a line.
    faces: The tool touches the curved outer faces of the body (`kernels.contact.push_skin_out`) instead of nodes.
    parts: A spread edge separates the body on the plane under it (`kernels.parting`); the mesh has nodes on that plane.
    slide: Velocity along y, mm/s: an oblique edge slides along itself.
    """

    corners: tuple[tuple[float, float], ...]
    radius: float
    height: float = 0.0
    speed: float = 0.0
    edge: float | None = None
    spread: float = 0.0
    faces: bool = False
    parts: bool = False
    slide: float = 0.0

    def __post_init__(self) -> None:
        """Raise `ValueError` for a polygon that is not convex and counter-clockwise."""
        points = np.asarray(self.corners)
        sides = np.roll(points, -1, axis=0) - points
        after = np.roll(sides, -1, axis=0)
        if not np.all(sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0] > 0.0):
            raise ValueError("the corners of a tool must form a convex polygon in counter-clockwise order")


@dataclass(frozen=True)
class Contact:
    """Penalty contact with Coulomb friction, μ = μ_d + (μ_s − μ_d) exp(−decay·|v|) at the sliding speed v.

    `penalty` is the contact stiffness as a share of m/Δt², with the mass m of a node and the initial stable time step
    Δt; `damping` is the share of critical damping.
    """

    static_friction: float = 0.0
    dynamic_friction: float = 0.0
    decay: float = 0.0
    penalty: float = 0.25
    damping: float = 0.5

    def numbers(self) -> FrictionNumbers:
        """Return the constants in the form that the kernels use."""
        return FrictionNumbers(self.static_friction, self.dynamic_friction, self.decay, self.penalty, self.damping)


def with_skin(tools: ToolArrays, topology: Topology, mass: Array) -> ToolArrays:
    """Return the tool arrays with the skin: the curved outer faces of the body, if any tool touches faces.

    The mass (N,) of a node is divided equally among the faces of the skin around it.
    """
    bulging = topology.crowns > (0.0 if tools.faces.any() else np.inf)
    behind, side = np.nonzero((topology.neighbours < 0) & bulging)
    corners = topology.hexes[behind[:, None], FACES[side]]
    around = np.bincount(corners.ravel(), minlength=len(mass))
    return tools._replace(
        skin=np.column_stack([corners, behind]).astype(np.int32),
        crowns=topology.crowns[behind, side],
        skin_mass=mass[corners] / around[corners],
        skin_traction=np.zeros((len(tools.faces), len(behind), SAMPLES, 3)),
    )


def tool_arrays(tools: tuple[Tool, ...], nodes: int) -> ToolArrays:
    """Return the tools as arrays for a body with a number of nodes; shorter polygons repeat their last corner."""
    most = max((len(tool.corners) for tool in tools), default=1)
    corners = np.zeros((len(tools), most, 2))
    for t, tool in enumerate(tools):
        corners[t, : len(tool.corners)] = tool.corners
        corners[t, len(tool.corners) :] = tool.corners[-1]
    return ToolArrays(
        corners=corners,
        radius=np.array([tool.radius for tool in tools], dtype=float),
        height=np.array([tool.height for tool in tools], dtype=float),
        speed=np.array([tool.speed for tool in tools], dtype=float),
        slide=np.array([tool.slide for tool in tools], dtype=float),
        edge=np.array([tool.edge or 0.0 for tool in tools], dtype=float),
        spread=np.array([0.0 if tool.edge is None else tool.spread for tool in tools], dtype=float),
        reach=np.array(
            [_WIDEST * max(_reach_beside(tool)) if tool.edge is not None else 0.0 for tool in tools], dtype=float
        ),
        traction=np.zeros((len(tools), nodes, 3)),
        force=np.zeros((len(tools), 3)),
        faces=np.array([tool.faces for tool in tools], dtype=bool),
        skin=np.zeros((0, 5), dtype=np.int32),
        crowns=np.zeros(0),
        skin_mass=np.zeros((0, 4)),
        skin_traction=np.zeros((len(tools), 0, SAMPLES, 3)),
        sunk=np.zeros((len(tools), 2)),
    )


# Sample points per element along an edge that acts along a line.
POINTS_PER_FACE = 4


def edge_arrays(tools: tuple[Tool, ...], x: Array, size: float) -> EdgeArrays:
    """Return sample points along the first tool edge that acts along a line, four per element of a size in mm.

    The points are symmetric about y = 0 and extend one element beyond the body.
    """
    tool = next((t for t, tool in enumerate(tools) if tool.edge is not None and tool.spread == 0.0), -1)
    y = _places((x[:, 1].min() - size, x[:, 1].max() + size), size / POINTS_PER_FACE)
    return EdgeArrays(
        tool=tool,
        x=float(tools[tool].edge or 0.0) if tool >= 0 else 0.0,
        y=y,
        per_face=float(POINTS_PER_FACE),
        traction=np.zeros((2 * y.size, 3)),
        depth=size,
    )


# The zone on which a blunt edge acts extends at most this number of spreads to each side; a blade needs much less.
_FARTHEST = 4.0
_ACROSS = 24  # samples across a spread edge
_LINES = 8  # lines of samples across the edge, per length a (the spread) of the edge
# Rows per length a of the edge. With 4, the strain under the edge grows in bursts as successive rows come into contact,
# which changes the failure force by up to 8 %.
_ROWS = 8
# Ratio of element length to spread in the shipped study, for which the spread was chosen. On shorter elements the bell
# is wider, by at most √(1 + 7/6 · 0.56²) because its variance is at least a²/7 (see `_across`).
_CHOSEN_ON = 0.56
_WIDEST = 1.2


def spread_edge(tools: tuple[Tool, ...], x: Array, hexes: Ints, size: float) -> SpreadEdge:
    """Return the rows (contact constraints, `kernels.spread_edge`) along the first spread edge; `cut` is still None.

    x: Positions of the nodes (N, 3), mm; a body that ends at the edge, or at y = 0, is mirrored there.
    hexes: Corners of the elements (E, 8).
    size: Length of the smallest elements, mm.
    """
    tool = next((t for t, tool in enumerate(tools) if tool.edge is not None and tool.spread > 0.0), -1)
    a, place = (max(_reach_beside(tools[tool])), float(tools[tool].edge or 0.0)) if tool >= 0 else (1.0, 0.0)
    mirrored = bool(np.all(x[:, 0] > place - 1e-9))
    half = bool(np.all(x[:, 1] > -1e-9))
    h = _length_beneath(x[hexes, 0] - place, a) if tool >= 0 else 0.0
    across, weight = _across(tools[tool], mirrored, h) if tool >= 0 else (np.zeros(0), np.zeros(0))
    far = float(np.abs(x[:, 1]).max()) if tool >= 0 else 0.0
    ends = (0.0 if half else -far, far)
    length = tools[tool].spread if tool >= 0 else 1.0
    along, rows = _places(ends, length / _LINES), _places(ends, length / _ROWS)
    lines, places, image = _lines_of_rows(rows, along, a, half)
    # pairs of a row and the row opposite in y, from the middle outwards; −1 if a mirror replaces the opposite row
    first = np.arange(0 if half else len(rows) // 2, len(rows))
    opposite = np.full(len(rows), -1) if half else len(rows) - 1 - first
    most = 4 * (ceil(2.0 * _WIDEST * a / size) + 4) ** 2
    return SpreadEdge(
        tool=tool,
        x=place,
        spread=a,
        mirrored=mirrored,
        across=across,
        weight=weight,
        along=along,
        lines=lines,
        bell=_bell(places / a),
        image=image,
        pairs=np.stack([first, opposite], axis=1).astype(np.int32),
        found=np.full((len(along), len(across)), -1, dtype=np.int32),
        place=np.zeros((len(along), len(across), 6)),
        line_sums=np.zeros((len(along), 2)),
        line_sizes=np.zeros(len(along), dtype=np.int32),
        line_nodes=np.zeros((len(along), 4 * len(across)), dtype=np.int32),
        line_hold=np.zeros((len(along), 4 * len(across), 3)),
        sizes=np.zeros(len(rows), dtype=np.int32),
        nodes=np.zeros((len(rows), most), dtype=np.int32),
        shape=np.zeros((len(rows), most, 3)),
        normal=np.zeros((len(rows), most, 3)),
        slope=np.zeros((len(rows), 2)),
        offset=np.zeros(len(rows)),
        compliance=np.zeros((len(rows), len(rows))),
        own=np.zeros(len(rows)),
        give=np.zeros(len(rows)),
        force=np.zeros((len(rows), 4)),
        excess=np.zeros(len(rows)),
        velocity=np.zeros((len(x) if tool >= 0 else 0, 3)),
        met=np.zeros(len(x) if tool >= 0 else 0, dtype=np.int32),
        met_count=np.zeros(1, dtype=np.int64),
        is_met=np.zeros(len(x) if tool >= 0 else 0, dtype=bool),
        cut=None,
    )


def _gap_beside(tool: Tool, s: Array) -> Array:
    """Return the distances (mm) from a tool to points at the height of its edge, at the offsets s (mm) from the edge.

    The distance is |s| for an infinitely thin blade, and less for a blade with flanks and a rounded edge.
    """
    corners = np.array(tool.corners)
    gaps = [outline_distance.py_func((tool.edge or 0.0) + float(offset), 0.0, corners)[0] for offset in s]
    return np.maximum(np.array(gaps) - tool.radius, 0.0)


@lru_cache(maxsize=64)  # 8000 distances in plain Python, needed three times per run for the same blade
def _reach_beside(tool: Tool) -> tuple[float, float]:
    """Return the distances left and right of a spread edge at which the gap to the tool equals the spread, mm."""
    far = tool.spread * np.linspace(0.0, _FARTHEST, 4001)
    left, right = (float(far[_gap_beside(tool, side * far) < tool.spread].max(initial=0.0)) for side in (-1.0, 1.0))
    return left, right


def _length_beneath(x: Array, reach: float) -> float:
    """Return the median extent along x of the elements within `reach` of the edge at x = 0; corners' x (E, 8), mm."""
    near = x[(x.min(axis=1) < reach) & (x.max(axis=1) > -reach)]
    return float(np.median(np.ptp(near, axis=1))) if len(near) else 0.0


def _across(tool: Tool, mirrored: bool, h: float) -> tuple[Array, Array]:
    """Return the sample positions across a spread edge on elements of length h (mm), and their weights.

    The weight is the bell of the distance from the tool. Linear shape functions share a force between two nodes, which
    adds h²/6, the variance of a hat function, to the variance of the bell. The samples are moved apart so that the sum
    is the same on all short elements. No correction is needed along the edge, where neighbouring rows overlap. For a
    mirrored body, only the samples at x > 0 are returned.
    """
    left, right = _reach_beside(tool)
    across = -left + (left + right) * (np.arange(_ACROSS) + 0.5) / _ACROSS
    weight = _bell(_gap_beside(tool, across) / tool.spread)
    middle = np.average(across, weights=weight)
    variance = np.average((across - middle) ** 2, weights=weight)
    missing = max((_CHOSEN_ON * tool.spread) ** 2 - h * h, 0.0) / 6.0
    across = middle + np.sqrt(1.0 + missing / variance) * (across - middle)
    return (across[across > 0.0], weight[across > 0.0]) if mirrored else (across, weight)


def _bell(s: Array) -> Array:
    return np.asarray(np.maximum(1.0 - s * s, 0.0) ** 2)


def _lines_of_rows(rows: Array, along: Array, a: float, half: bool) -> tuple[Ints, Array, Array]:
    """Return the lines within `a` of each row, their distances from it, and −1 for mirror images or 1; each (R, M)."""
    images = -along[::-1] if half else along[:0]
    y = np.concatenate([images, along])
    index = np.concatenate([np.arange(len(images))[::-1], np.arange(len(along))])
    sign = np.concatenate([np.full(len(images), -1.0), np.ones(len(along))])
    near = [np.flatnonzero(np.abs(y - row) < a) for row in rows]
    most = max((len(n) for n in near), default=0)
    lines = np.full((len(rows), most), -1, dtype=np.int32)
    distance, image = np.zeros((len(rows), most)), np.ones((len(rows), most))
    for j, n in enumerate(near):
        lines[j, : len(n)], distance[j, : len(n)], image[j, : len(n)] = index[n], y[n] - rows[j], sign[n]
    return lines, distance, image


def _places(ends: tuple[float, float], spacing: float) -> Array:
    """Return positions `spacing` apart and symmetric about 0 that cover the interval between the ends."""
    first, last = np.floor(ends[0] / spacing), np.ceil(ends[1] / spacing)
    return np.asarray((np.arange(first, last) + 0.5) * spacing, dtype=np.float64)
