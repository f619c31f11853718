"""From the nodes of a deck to the shapes of a shear test: stem, blade and supports, and how the stem is meshed."""

from collections.abc import Iterator
from dataclasses import replace
from math import atan, ceil, degrees, floor, log10, pi, sin, tan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting import Blade, Discretisation, Stem, Supports, stem_mesh
from stemcal.cutting.build import EVEN_SHARE, around_half, mean_length, pairs_along
from stemcal.errors import UsageError

Array = NDArray[np.float64]
_DIGITS = 9  # of mm: what tells two places apart


def stem_of(nodes: Array) -> Stem:
    """Return the hollow cylinder about the x axis that nodes (N, 3) fill."""
    radius = np.linalg.norm(nodes[:, 1:], axis=1)
    outer, inner = float(radius.max()), float(radius.min())
    return Stem(_plain(2.0 * outer), _plain(inner / outer), _plain(float(np.ptp(nodes[:, 0]))))


def blade_of(nodes: Array) -> Blade:
    """Return the wedge whose edge is the lowest of the nodes (N, 3), along y.

    The flanks are the outline's two straight lines between edge and body. They would meet in an apex; a rounding of
    radius r between them lies r (1/sin α − 1) above it, or r (1/tan ½β − 1) if one flank is vertical.
    """
    outline = _outline(nodes[:, [0, 2]])
    low = float(outline[:, 1].min())
    right, left = _flank(outline, 1.0), _flank(outline, -1.0)
    leans = [atan(flank[1]) for flank in (right, left)]
    bevel: Literal["both", "one"] = "one" if min(leans) < 1e-6 else "both"
    angle = sum(leans)
    if not 0.0 < angle < pi:
        raise UsageError(
            "the blade's section has no edge; two faces that lean towards each other in its direction are needed"
        )
    # the flanks x = x₀ + s z, one to either side, meet where both x are alike
    apex = -(left[0] + right[0]) / (left[1] + right[1])
    rise = 1.0 / tan(0.5 * angle) - 1.0 if bevel == "one" else 1.0 / sin(0.5 * angle) - 1.0
    return Blade(
        thickness=_plain(float(np.ptp(outline[:, 0]))),
        width=_plain(float(np.ptp(outline[:, 1]))),
        edge_angle=_plain(degrees(angle), 6),
        edge_radius=max(_plain((low - apex) / rise, 6), 0.0),
        bevel=bevel,
    )


def supports_of(nodes: Array) -> Supports:
    """Return the blocks that nodes (N, 3) to either side of x = 0 make: clearance and radius of their edges."""
    near = float(np.abs(nodes[:, 0]).min())
    flat = nodes[nodes[:, 2] > nodes[:, 2].max() - 1e-9]
    return Supports(_plain(2.0 * near), _plain(float(np.abs(flat[:, 0]).min()) - near))


def discretisation_of(stem: Stem, nodes: Array, rests_at: float) -> tuple[Discretisation, bool]:
    """Return how a stem's nodes (N, 3) are spread, and whether the embedded solver's mesh is just that.

    A layer of nodes may lie where the stem rests, so far (mm) from the blade.
    """
    x = np.unique(np.round(nodes[:, 0], 6))
    through = len(np.unique(np.round(np.linalg.norm(nodes[:, 1:], axis=1), 5))) - 1
    turn = np.unique(np.round(np.arctan2(nodes[:, 2], nodes[:, 1]) + 0.5 * pi, 6) % (2.0 * pi))
    along, around = np.diff(x), np.diff(turn[turn <= pi + 1e-5])
    under = float(along[len(along) // 2])
    near = Discretisation(element_size=_plain(under, 3), symmetry="none")
    structured = len(along) > 1 and len(around) > 1 and len(nodes) == len(x) * (through + 1) * 2 * len(around)
    if not structured:
        return near, False
    how = replace(
        near,
        through_wall=through,
        edge_over="elements" if np.all(np.abs(x) > 1e-6) else "nodes",
        coarsening=_plain(_coarsening(0.5 * stem.length / under, len(along)), 3),
        coarsening_around=_plain(float(around[0] / around[-1]), 3),
    )
    for size in _sizes(stem, how, len(along) // 2, len(around)):
        trial = replace(how, element_size=size)
        if _same(stem_mesh(stem, trial, rests_at).nodes, nodes):
            return trial, True
    return how, False


def _coarsening(half: float, along: int) -> float:
    """Return the length of the last element over that of the first, where so many make `half` times the first twice.

    Layers that were moved to rest on the supports change no sum.
    """
    odd = along % 2
    weights = np.ones(along // 2 + odd)
    weights[0] -= 0.5 * odd
    growth = np.interp(np.linspace(0.0, 1.0, len(weights)), (EVEN_SHARE, 1.0), (0.0, 1.0))
    return 1.0 + (half - float(weights.sum())) / max(float(weights @ growth), 1e-9)


def _sizes(stem: Stem, how: Discretisation, pairs: int, around: int) -> Iterator[float]:
    """Yield element sizes that give so many elements, from those of few digits to those of many."""
    odd, radius = (1 if how.edge_over == "elements" else 0), 0.5 * stem.outer_diameter
    along, turn = stem.length / mean_length(how), pi * radius / (0.5 * (1.0 + how.coarsening_around))
    low = max(along / (2 * pairs + odd), turn / (around + 0.5))
    high = min(along / max(2 * pairs + odd - 2, 1), turn / (around - 0.5))
    for digits in range(6):
        step = 10.0 ** (floor(log10(high)) - digits)
        for count in range(floor(high / step + 1e-9), ceil(low / step - 1e-9) - 1, -1):
            trial = replace(how, element_size=_plain(count * step))
            if (pairs_along(stem.length, trial), around_half(radius, trial)) == (pairs, around):
                yield trial.element_size


def _same(ours: Array, theirs: Array) -> bool:
    """Tell whether two sets of nodes are one, to a hundred-thousandth of a millimetre."""
    from scipy.spatial import cKDTree

    return ours.shape == theirs.shape and float(cKDTree(theirs).query(ours)[0].max()) < 1e-5


def _outline(points: Array) -> Array:
    """Return the convex outline (P, 2) of points in (x, z), counter-clockwise, straight pieces as one."""
    points = np.unique(np.round(points, _DIGITS), axis=0)
    halves = []
    for ordered in (points, points[::-1]):
        chain: list[Array] = []
        for point in ordered:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 1e-7:
                chain.pop()
            chain.append(point)
        halves.append(chain[:-1])
    return np.array([*halves[0], *halves[1]])


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _flank(outline: Array, side: float) -> tuple[float, float]:
    """Return x₀ and slope of the flank side·x = x₀ + slope·z: the longest side below the body that faces there."""
    ends = np.roll(outline, -1, axis=0)
    run = ends - outline
    # going round counter-clockwise, the right flank goes up and the left one comes down
    rising = run * side
    lengths = np.where(rising[:, 1] > 1e-9, np.linalg.norm(run, axis=1), 0.0)
    leaning = np.where(np.abs(run[:, 0]) > 1e-6, lengths, 0.0)
    best = int(np.argmax(leaning if leaning.max() > 0.2 * np.ptp(outline[:, 0]) else lengths))
    slope = float(side * run[best, 0] / run[best, 1])
    return float(side * outline[best, 0] - slope * outline[best, 1]), max(slope, 0.0)


def _plain(value: float, digits: int = 9) -> float:
    """Round to what a deck holds and a person wrote."""
    return float(f"{round(value, _DIGITS):.{digits}g}")
