"""Parting: separation of the body on the plane under the edge of a blade (the cut plane), without deleting elements.

Nodes on the plane are held together until the mean plastic strain ε̄ around them (`nonlocal_mean`) reaches the failure
strain ε_f:

    Σ ε̄ₑ/ε_f,ₑ ≥ n   over the n element faces on the plane around a node.

If the plane is a mirror plane, a node that parts is released. In a body on both sides of the plane, each node there has
a twin, and the two move as one until they part. Elements keep their strength, so the gap is no wider than the blade:
the flanks, as a sharp wedge in contact with the nodes beside it, push the two faces of the cut apart. The edge acts on
the cut front, the highest point under each line of the edge where the plane still holds. The front moves continuously
between nodes as the strain there increases.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy import sqrt

from stemcal.arrays import Array, Floats, Ints, Mask
from stemcal.fem.kernels.compile import inlined, kernel
from stemcal.fem.kernels.contact import flank_distance, may_touch_flank
from stemcal.fem.kernels.nodes import SURFACE, push

# Values of `CutPlane.front`: SKIN if the top of the line has not parted, NO_FRONT if no front is within reach.
SKIN, NO_FRONT = np.inf, -np.inf
# The remaining share of the failure strain at a node is at least this before the node parts, and at most −this after.
_LEAST = 1.0e-6


class CutPlane(NamedTuple):
    """The plane under an edge and its parted nodes; created by `stemcal.fem.parting.cut_plane`.

    Arrays from `strain` on change during the run.
    """

    tool: int  # index of the tool whose edge parts the body, −1 for none
    nodes: Ints  # (P,) nodes of the plane, of the elements on its right side
    twins: Ints  # (P,) nodes at the same places, of the elements on the left side; (0,) if the plane is a mirror
    number: Ints  # (N,) index of each node among `nodes` or `twins`, −1 for others
    line: Ints  # (N,) index among `nodes` of the node of the plane on the same line across the plane
    side: Array  # (N,) 1 right of the plane, −1 left of it
    faces: Ints  # (F, 4) faces of elements on the plane; corners are indices into `nodes` or `twins`
    behind: Ints  # (F,) element of each of these faces
    around: Array  # (P,) number of faces around each node
    columns: Ints  # (P, M) lines of nodes across the plane, from left to right
    layers: Array  # (M,) initial x of the M nodes of each line, relative to the plane, mm
    flanks: Array  # (2, 5, 2) polygons (x, z) of the blade as a sharp wedge, for the right and (mirrored) the left side
    strain: Array  # (P,) Σ ε̄/(n ε_f) over the n faces around each node
    parted: Mask  # (P,) nodes that have parted
    offset: Array  # (N,) penetration of each node into the flank when it parted, mm
    front: Array  # (L,) z of the front under each line of the edge, `SKIN` or `NO_FRONT`
    ends: Ints  # (L, 4) nodes of the plane between which the front is interpolated
    shares: Array  # (L, 4) weights of these nodes in the interpolation


@kernel
def part(cut: Floats, exchange: Floats, body: Floats, tools: Floats) -> None:
    """Part the nodes of the plane around which the mean strain has reached the failure strain."""
    cut.strain[:] = 0.0
    for q in range(cut.faces.shape[0]):
        e = cut.behind[q]
        for k in range(4):
            p = cut.faces[q, k]
            cut.strain[p] += exchange.mean[e] / (exchange.failure_strain[e] * cut.around[p])
    for p in range(cut.nodes.shape[0]):
        if cut.parted[p] or cut.strain[p] < 1.0:
            continue
        for n in cut.columns[p]:
            _store_depth(cut, body.x, tools, n)
        cut.parted[p] = True
        if cut.twins.shape[0] == 0:
            body.free[cut.nodes[p], 0] = True


@inlined
def _store_depth(cut: Floats, x: Array, tools: Floats, n: int) -> None:
    """Store the penetration of a node that may touch the flank from now on: pushing it out would create energy."""
    px = x[n, 0] - tools.edge[cut.tool]
    if not may_touch_flank(cut, n, px):
        gap, _, _ = flank_distance(cut, n, px, x[n, 2] - tools.height[cut.tool])
        cut.offset[n] = max(-gap, 0.0)


@kernel
def close_plane(
    cut: Floats, edge: float, x: Array, v: Array, mass: Array, pushes: Floats, dt0: float, friction: Floats
) -> None:
    """Push back parted nodes that have crossed the mirror plane, or passed through their twins."""
    source = SURFACE * (pushes.force.shape[0] // 3) + cut.tool
    mirrored = cut.twins.shape[0] == 0
    for p in range(cut.nodes.shape[0]):
        if not cut.parted[p]:
            continue
        n = cut.nodes[p]
        gap, rate, reduced = x[n, 0] - edge, v[n, 0], mass[n]
        if not mirrored:
            other = cut.twins[p]
            gap, rate = x[n, 0] - x[other, 0], v[n, 0] - v[other, 0]
            reduced = mass[n] * mass[other] / (mass[n] + mass[other])
        if gap >= 0.0:
            continue
        k = friction.penalty * reduced / (dt0 * dt0)
        force = -k * gap - 2.0 * friction.damping * sqrt(k * reduced) * rate
        if force > 0.0:
            push(pushes, source, n, 0, force)
            if not mirrored:
                push(pushes, source, cut.twins[p], 0, -force)


@kernel
def tie(cut: Floats, mass: Array, rows: Any, forces: bool) -> None:
    """Make unparted twin nodes move as one: change their `rows` of forces or (if not `forces`) of velocities.

    The common force is shared in proportion to mass; the common velocity has the momentum of both.
    """
    for p in range(cut.twins.shape[0]):
        if not cut.parted[p]:
            a, b = cut.nodes[p], cut.twins[p]
            share = mass[a] / (mass[a] + mass[b])
            for i in range(3):
                first, second = float(rows[a, i]), float(rows[b, i])
                total = first + second if forces else share * first + (1.0 - share) * second
                rows[a, i] = share * total if forces else total
                rows[b, i] = (1.0 - share) * total if forces else total


@kernel
def find_front(cut: Floats, along: Array, x: Array, tip: float, reach: float) -> None:
    """Find the cut front under each line of the edge (at y = `along`): the highest point that has not parted.

    A line whose top has not parted has the front `SKIN`.
    """
    for line in range(along.shape[0]):
        front, top, whole = NO_FRONT, NO_FRONT, True
        for q in range(cut.faces.shape[0]):
            crosses, upper, lower = _crossings(cut, q, along[line], x)
            if not crosses:
                continue
            if upper[0] > top:
                top, whole = upper[0], not cut.parted[upper[1]] and not cut.parted[upper[2]]
            if upper[4] <= 0.0 and lower[4] <= 0.0:
                continue
            c = upper[4] / (upper[4] - lower[4]) if upper[4] <= 0.0 else 0.0
            height = upper[0] + c * (lower[0] - upper[0])
            if height > front:
                front = height
                cut.ends[line, 0], cut.ends[line, 1] = upper[1], upper[2]
                cut.ends[line, 2], cut.ends[line, 3] = lower[1], lower[2]
                cut.shares[line, 0], cut.shares[line, 1] = (1.0 - c) * (1.0 - upper[3]), (1.0 - c) * upper[3]
                cut.shares[line, 2], cut.shares[line, 3] = c * (1.0 - lower[3]), c * lower[3]
        cut.front[line] = SKIN if whole else front if front >= tip - reach else NO_FRONT


@inlined
def _crossings(cut: Floats, q: int, y: float, x: Array) -> Floats:
    """Return True if face q of the plane crosses y, and the two points where its sides cross y, the upper one first.

    A point is its z, the corners at the ends of the side, the weight of the second corner there, and the remaining
    share of the failure strain.
    """
    count = 0
    upper, lower = (0.0, 0, 0, 0.0, 0.0), (0.0, 0, 0, 0.0, 0.0)
    for k in range(4):
        a, b = cut.faces[q, k], cut.faces[q, (k + 1) % 4]
        n, m = cut.nodes[a], cut.nodes[b]
        if (x[n, 1] <= y) == (x[m, 1] <= y):
            continue
        s = (y - x[n, 1]) / (x[m, 1] - x[n, 1])
        left = (1.0 - s) * _left(cut, a) + s * _left(cut, b)
        lower, upper = upper, ((1.0 - s) * x[n, 2] + s * x[m, 2], int(a), int(b), s, left)
        count += 1
    return count == 2, upper if upper[0] >= lower[0] else lower, lower if upper[0] >= lower[0] else upper


@inlined
def _left(cut: Floats, p: int) -> float:
    """Return the remaining share of the failure strain at node p of the plane, negative after it has parted."""
    left = 1.0 - cut.strain[p]
    return float(min(left, -_LEAST) if cut.parted[p] else max(left, _LEAST))
