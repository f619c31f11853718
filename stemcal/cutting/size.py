"""How many elements the mesh of a shear test has, how small they are, what memory they take: without building it."""

from dataclasses import dataclass
from math import floor, inf, pi, sin

from stemcal.cutting.build import EVEN_SHARE, around_half, pairs_along, through_wall
from stemcal.cutting.parts import Discretisation, Stem
from stemcal.fem.mesh import SQUARE, square_of_solid

# What building and integrating a model takes at its most, bytes per element; `tests/cutting/test_size.py` measures it.
_BYTES = 2900.0


@dataclass(frozen=True)
class MeshSize:
    """Number of elements, the edge of a cube as large as the smallest of them (mm), memory of its simulation (bytes).

    A mesh that no number can count has infinitely many elements of no size.
    """

    elements: float
    smallest: float
    memory: float


def mesh_size(stem: Stem, how: Discretisation) -> MeshSize:
    """Return the size of the mesh that `build.stem_mesh` would make."""
    try:
        pairs, around, through = (
            float(count)
            for count in (
                pairs_along(stem.length, how),
                around_half(0.5 * stem.outer_diameter, how),
                through_wall(stem, how),
            )
        )
    except OverflowError:
        return MeshSize(inf, 0.0, inf)
    odd = 1 if how.edge_over == "elements" else 0
    along = (pairs + odd) if how.symmetry == "quarter" else 2.0 * pairs + odd
    solid = stem.diameter_ratio == 0.0
    up, across = square_of_solid(around_half(0.5 * stem.outer_diameter, how)) if solid else (0, 0)
    elements = along * (around * through + up * across) * (2.0 if how.symmetry == "none" else 1.0)
    # the smallest lies under the edge, on the inside: a prism over a trapezium
    length = 0.5 * stem.length / (_sum_of_lengths(pairs + odd, how.coarsening) - 0.5 * odd)
    angle = pi / (0.5 * (1.0 + how.coarsening_around) * around)
    inner = 0.5 * stem.outer_diameter * stem.diameter_ratio
    ring = 0.5 * stem.outer_diameter * (1.0 - (SQUARE if solid else stem.diameter_ratio)) / through
    if solid:  # those in the corners of its square are as if so far inside, within a tenth
        inner = 0.25 * SQUARE * stem.outer_diameter
    outer = inner + ring
    volume = length * 0.5 * (outer * outer - inner * inner) * sin(angle)
    return MeshSize(elements, max(volume, 0.0) ** (1.0 / 3.0), _BYTES * elements)


def _sum_of_lengths(count: float, coarsening: float) -> float:
    """Return the sum of the lengths of so many elements outwards from the cut over that of the first.

    The lengths are 1 + (c − 1)(t − p)/(1 − p) where t = k/(n − 1) exceeds the even share p, else 1.
    """
    last = max(count - 1.0, 1.0)
    even = floor(EVEN_SHARE * last)
    beyond = 0.5 * (last * (last + 1.0) - even * (even + 1.0)) / last - EVEN_SHARE * (last - even)
    return count + (coarsening - 1.0) / (1.0 - EVEN_SHARE) * beyond * (count > 1.0)
