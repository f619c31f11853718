"""A blade that parts a body on a known plane: cohesion ahead of the edge, the edge itself, the flanks behind it.

The plane is the mirror plane x = 0 of a body of which one half is computed; an opening w is 2 x there, an edge of unit
length is resisted by half of everything. Three laws share the area of the plane, each rigid as long as it holds:

    cohesion   σ(w) = σ_c (1 − w/w_c),  w_c = 2G/σ_c,   back along σ/w;   w ≥ 0       (pulls the halves together)
    edge       0 ≤ λ ≤ G_left + F_nose per length,   ż_material ≤ ż_edge,   one with equality
    flanks     gap + Δt·ġ ≥ 0,  λ ≥ 0, one with equality, and friction up to μ λ

What the edge passes is parted: its area is taken from the cohesion of the nodes around it, with the weights by which
they bear the edge's force. So an area costs G once, however it is parted: G_left is what tension has left of it.

None has a stiffness of its own: the forces are those that the motion of the step leaves no choice about, found together
by sweeps of Gauss–Seidel from those of the step before, as in `spread`. The cohesion is that of Camacho and Ortiz (Int.
J. Solids Struct. 33, 2899-2938, 1996), with a force that is continuous where it begins to open (Papoulia, Sam and
Vavasis, Int. J. Numer. Methods Eng. 58, 679-701, 2003).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy import sqrt
from numpy.typing import NDArray

from stemcal.fem.kernels.compile import inlined, kernel
from stemcal.fem.kernels.contact import HAIR, face_modes, friction_limit, locate_in_face, shape_functions
from stemcal.fem.kernels.nodes import COHESION, EDGE, FRICTION, SURFACE, force_on, push

Floats = Any
Array = NDArray[np.float64]
Ints = NDArray[np.int32]

# The laws are solved together until no force changes by more than this share of the largest of its kind, or so often.
_CLOSE = 1.0e-4
_SWEEPS = 50
# What lies inside a flank is brought out by at most this share of its depth in a step, and at most so many times as
# fast as the blade moves: nodes get inside when the edge passes them.
_BROUGHT_OUT = 0.1
_FASTEST = 5.0


class CutPlane(NamedTuple):
    """The plane that a blade parts a body on; `stemcal.fem.cohesive.cut_plane` makes it.

    P nodes lie on it, F faces; the edge meets it at S stations along y.
    """

    tool: int  # the blade, −1 where nothing is parted
    strength: float  # σ_c
    toughness: float  # G
    nose: float  # F_nose, what the rounding of the edge adds while the plane ahead is closed, per length
    nose_width: float  # the opening by which it needs to push no more, mm
    near: float  # nodes farther than this from the flanks are left alone
    nodes: Ints  # (P,)
    whole: Array  # (P,) ∫N dA before the test
    area: Array  # (P,) what of it the edge has not passed, changes
    widest: Array  # (P,) the largest opening so far, changes
    reach: Array  # (P,) a node this far above the edge has been passed altogether
    pull: Array  # (P,) force along x, changes
    columns: Ints  # (P, R) each of them and those next to it along x, as far as the rounding bears
    faces: Ints  # (F, 4) their nodes
    places: Ints  # (F, 4) where those stand in `nodes`
    before: Array  # (F, 4, 2) y and z of the corners before the test
    along: Array  # (S,) y of the stations
    spacing: float
    found: Ints  # (S,) the face that each station lies in, −1 none, changes
    shape: Array  # (S, 4) shape functions there, changes
    bearing: Array  # (S, R) which share of the edge's force each row of the columns bears there, changes
    stretch: Array  # (S,) area before the test over area now, there, changes
    most: Array  # (S,) the largest force of each, changes
    rounding: Array  # (S,) which share of that is F_nose, changes
    behind: Array  # (S,) how far the edge has drawn back from the end of its cut, mm, changes
    force: Array  # (S,) λ · spacing / 2, changes
    flank: Array  # (N, 4) λ and friction of each node at the flanks, changes
    gap: Array  # (N, 3) its distance from the nearest, and the normal's x and z, changes
    touching: Ints  # (N,) nodes at the flanks, the first `many`, changes
    many: NDArray[np.int64]  # (1,) changes
    velocity: Array  # (N, 3) scratch: velocities after the kick with the forces so far


@kernel
def part(
    cut: Floats, tools: Floats, candidates: Floats, body: Floats, kick: float, dt: float, friction: Floats
) -> None:
    """Add to `body.pushes` what holds the plane together and what parts it; all other forces must be there."""
    speed, tip = tools.speed[cut.tool], tools.height[cut.tool]
    find_touching(cut, tools, candidates, body, tip)
    foresee(cut, body, kick)
    for s in range(cut.along.shape[0]):
        find_station(cut, body, s, tip)
    take_up(cut, body, kick)
    for _ in range(_SWEEPS):
        pressed, held = press_edge(cut, body, speed, kick, dt), hold_plane(cut, body, kick, dt)
        pushed = push_flanks(cut, body, speed, kick, dt, friction)
        if settled(pressed) and settled(held) and settled(pushed):
            break
    advance_cut(cut, body, speed, tip, dt)
    hand_over(cut, tools, body)


@inlined
def settled(forces: Floats) -> bool:
    """Return whether the largest change of some forces is nothing against the largest of them."""
    return bool(forces[0] <= _CLOSE * forces[1])


@inlined
def flank_distance(px: float, pz: float, corners: Array) -> Floats:
    """Return the distance of a point from the planes of a convex polygon, negative inside, and the normal there.

    Outside the distance is that from the plane, not from its end: no point meets the edge's line.
    """
    best, best_x, best_z = -1.0e30, 0.0, 1.0
    count = corners.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        ex, ez = corners[j, 0] - corners[i, 0], corners[j, 1] - corners[i, 1]
        length = sqrt(ex * ex + ez * ez)
        if length == 0.0:
            continue
        nx, nz = ez / length, -ex / length
        side = (px - corners[i, 0]) * nx + (pz - corners[i, 1]) * nz
        if side > best:
            best, best_x, best_z = side, nx, nz
    return best, best_x, best_z


@inlined
def find_touching(cut: Floats, tools: Floats, candidates: Floats, body: Floats, tip: float) -> None:
    """List the nodes that may touch the flanks in this step; the others have no force of theirs."""
    many = 0
    for m in range(candidates.node_counts[cut.tool]):
        n = candidates.nodes[cut.tool, m]
        # on the mirror plane itself the flank is that of this half
        x = max(body.x[n, 0], 1.0e-12)
        gap, nx, nz = flank_distance(x, body.x[n, 2] - tip, tools.corners[cut.tool])
        if gap < cut.near:
            cut.gap[n, 0], cut.gap[n, 1], cut.gap[n, 2] = gap, nx, nz
            cut.touching[many] = n
            many += 1
        else:
            cut.flank[n, :] = 0.0
    cut.many[0] = many


@inlined
def foresee(cut: Floats, body: Floats, kick: float) -> None:
    """Set the velocities that nodes of the plane, at edge and flanks would have after the kick without these laws."""
    for p in range(cut.nodes.shape[0]):
        for r in range(cut.columns.shape[1]):
            foresee_node(cut, body, cut.columns[p, r], kick)
    for m in range(cut.many[0]):
        foresee_node(cut, body, cut.touching[m], kick)


@inlined
def foresee_node(cut: Floats, body: Floats, n: int, kick: float) -> None:
    """Set the velocity that a node would have after the kick without these laws."""
    for i in range(3):
        gain = kick * force_on(body, n, i) * body.inverse_mass[n] * body.free[n, i]
        cut.velocity[n, i] = body.v[n, i] + gain


@inlined
def impart(cut: Floats, body: Floats, n: int, i: int, force: float, kick: float) -> None:
    """Let a force change the velocity of a node."""
    cut.velocity[n, i] += kick * force * body.inverse_mass[n] * body.free[n, i]


@inlined
def take_up(cut: Floats, body: Floats, kick: float) -> None:
    """Begin with the forces of the step before."""
    for p in range(cut.nodes.shape[0]):
        impart(cut, body, cut.nodes[p], 0, cut.pull[p], kick)
    for s in range(cut.along.shape[0]):
        if cut.found[s] >= 0:
            press_station(cut, body, s, cut.force[s], kick)
    for m in range(cut.many[0]):
        n = cut.touching[m]
        for i in range(3):
            impart(cut, body, n, i, flank_normal(cut, n, i) * cut.flank[n, 0] + cut.flank[n, 1 + i], kick)


@inlined
def flank_normal(cut: Floats, n: int, i: int) -> float:
    """Return component i of the flank's normal at a node."""
    return float(cut.gap[n, 1] if i == 0 else cut.gap[n, 2] if i == 2 else 0.0)


@inlined
def find_station(cut: Floats, body: Floats, s: int, tip: float) -> None:
    """Find the face in which the edge meets the plane at a station, and how it is resisted there.

    Outside the body there is no cut to draw back from.
    """
    face = cut.found[s]
    if face >= 0 and not lies_in(cut, body, s, face, tip):
        face = -1
    if face < 0:
        for f in range(cut.faces.shape[0]):
            if lies_in(cut, body, s, f, tip):
                face = f
                break
    cut.found[s] = face
    if face < 0:
        cut.behind[s], cut.force[s] = 0.0, 0.0


@inlined
def lies_in(cut: Floats, body: Floats, s: int, face: int, tip: float) -> bool:
    """Return whether the edge at a station lies in a face; if so, set its shape, stretch and largest force."""
    a, b, c, d = cut.faces[face, 0], cut.faces[face, 1], cut.faces[face, 2], cut.faces[face, 3]
    x, y, before = body.x, cut.along[s], cut.before[face]
    if (
        max(max(x[a, 2], x[b, 2]), max(x[c, 2], x[d, 2])) < tip
        or min(min(x[a, 2], x[b, 2]), min(x[c, 2], x[d, 2])) > tip
    ):
        return False
    if max(max(x[a, 1], x[b, 1]), max(x[c, 1], x[d, 1])) < y or min(min(x[a, 1], x[b, 1]), min(x[c, 1], x[d, 1])) > y:
        return False
    fy, fz = face_modes(x[a, 1], x[b, 1], x[c, 1], x[d, 1]), face_modes(x[a, 2], x[b, 2], x[c, 2], x[d, 2])
    xi, eta = locate_in_face(y, tip, fy, fz)
    if abs(xi) > 1.0 + HAIR or abs(eta) > 1.0 + HAIR:
        return False
    gy = face_modes(before[0, 0], before[1, 0], before[2, 0], before[3, 0])
    gz = face_modes(before[0, 1], before[1, 1], before[2, 1], before[3, 1])
    cut.stretch[s] = abs(jacobian(gy, gz, xi, eta) / jacobian(fy, fz, xi, eta))
    shape = shape_functions(xi, eta)
    intact, ahead, below = 0.0, 0.0, 1.0e-30
    critical = 2.0 * cut.toughness / cut.strength
    for k in range(4):
        cut.shape[s, k] = shape[k]
        n, p = cut.faces[face, k], cut.places[face, k]
        if cut.area[p] > 0.0:
            intact += shape[k] * share_left(2.0 * x[n, 0] / critical, cut.widest[p] / critical)
        if x[n, 2] < tip:
            ahead, below = ahead + shape[k] * 2.0 * max(x[n, 0], 0.0), below + shape[k]
    closed = max(1.0 - ahead / below / cut.nose_width, 0.0) if cut.nose > 0.0 else 0.0
    nose, resistance = cut.nose * closed, cut.toughness * intact * cut.stretch[s] + cut.nose * closed
    cut.most[s] = 0.5 * cut.spacing * resistance
    cut.rounding[s] = nose / resistance if resistance > 0.0 else 0.0
    bear(cut, body, s, face)
    return True


@inlined
def bear(cut: Floats, body: Floats, s: int, face: int) -> None:
    """Share the edge's force at a station among the rows of nodes along x.

    The edge is a line on the plane; the rounding bears evenly from there to half its width, which gives each row the
    integral of its shape function.
    """
    rows, near, left = cut.bearing[s], 0.0, 0.5 * cut.nose_width
    rows[:] = 0.0
    for r in range(rows.shape[0]):
        far = 0.0
        for k in range(4):
            far += cut.shape[s, k] * body.x[cut.columns[cut.places[face, k], r], 0]
        if r > 0 and far > near:
            borne = min(far - near, left)
            further = 0.5 * borne * borne / (far - near)
            rows[r - 1], rows[r], left = rows[r - 1] + borne - further, further, left - borne
        near = far
    total = rows.sum()
    if total > 0.0:
        rows[:] *= cut.rounding[s] / total
    rows[0] += 1.0 - rows.sum()


@inlined
def share_left(opening: float, widest: float) -> float:
    """Return which share of G it still takes to part what is open by w and was open by m, both in parts of w_c.

    (1 − m)² beyond m, and before it the way back up the line σ/w: (1 − m)(m² − w²)/m.
    """
    if widest >= 1.0:
        return 0.0
    back = max(widest * widest - max(opening, 0.0) ** 2, 0.0)
    return float((1.0 - widest) ** 2 + ((1.0 - widest) * back / widest if widest > 0.0 else 0.0))


@inlined
def jacobian(fy: Floats, fz: Floats, xi: float, eta: float) -> float:
    """Return ∂(y, z)/∂(ξ, η) of a face given by its modes."""
    return float((fy[1] + fy[3] * eta) * (fz[2] + fz[3] * xi) - (fy[2] + fy[3] * xi) * (fz[1] + fz[3] * eta))


@inlined
def press_station(cut: Floats, body: Floats, s: int, force: float, kick: float) -> None:
    """Let the edge at a station press down what bears it."""
    for k in range(4):
        column = cut.columns[cut.places[cut.found[s], k]]
        for r in range(column.shape[0]):
            impart(cut, body, column[r], 2, -force * cut.shape[s, k] * cut.bearing[s, r], kick)


@inlined
def slip_of(cut: Floats, s: int, speed: float) -> float:
    """Return how fast the material at a station rises against the edge, mm/s."""
    rate = -speed
    for k in range(4):
        column = cut.columns[cut.places[cut.found[s], k]]
        for r in range(column.shape[0]):
            rate += cut.shape[s, k] * cut.bearing[s, r] * cut.velocity[column[r], 2]
    return rate


@inlined
def press_edge(cut: Floats, body: Floats, speed: float, kick: float, dt: float) -> Floats:
    """Let the edge at every station keep the end of its cut below it, as far as its force goes.

    Returns the largest change and the largest force.
    """
    change, largest = 0.0, 0.0
    for s in range(cut.along.shape[0]):
        if cut.found[s] < 0:
            continue
        give = 0.0
        for k in range(4):
            column = cut.columns[cut.places[cut.found[s], k]]
            for r in range(column.shape[0]):
                give += kick * (cut.shape[s, k] * cut.bearing[s, r]) ** 2 * body.inverse_mass[column[r]]
        old = cut.force[s]
        new = min(max(old + (slip_of(cut, s, speed) - cut.behind[s] / dt) / give, 0.0), cut.most[s])
        if new != old:
            press_station(cut, body, s, new - old, kick)
            cut.force[s] = new
        change, largest = max(change, abs(new - old)), max(largest, new)
    return change, largest


@inlined
def hold_plane(cut: Floats, body: Floats, kick: float, dt: float) -> Floats:
    """Give every node of the plane the force of its cohesion; returns the largest change and the largest force."""
    change, largest = 0.0, 0.0
    for p in range(cut.nodes.shape[0]):
        n, old = cut.nodes[p], cut.pull[p]
        without = cut.velocity[n, 0] - kick * old * body.inverse_mass[n]
        give = 2.0 * dt * kick * body.inverse_mass[n]
        new = cohesion(cut, p, 2.0 * (body.x[n, 0] + dt * without), give)
        if new != old:
            impart(cut, body, n, 0, new - old, kick)
            cut.pull[p] = new
        change, largest = max(change, abs(new - old)), max(largest, abs(new))
    return change, largest


@inlined
def cohesion(cut: Floats, p: int, opening: float, give: float) -> float:
    """Return the force on a node that would be open by so much at the end of the step, if a force opens it by `give`.

    The force f leaves the opening w = opening − give f. Where it opens further than ever, it is that half way from the
    widest opening to w, so that a step takes what lies under σ(w); else that of w.
    """
    if opening <= 0.0:
        return -opening / give
    critical, widest, area = 2.0 * cut.toughness / cut.strength, cut.widest[p], cut.area[p]
    if area == 0.0 or widest >= critical:
        return 0.0
    most = give * area * cut.strength
    further = (opening - most * (1.0 - 0.5 * widest / critical)) / (1.0 - 0.5 * most / critical)
    if further > widest:  # opens on
        return -area * cut.strength * max(1.0 - 0.5 * (widest + further) / critical, 0.0)
    if widest == 0.0:  # holds
        return -opening / give
    stiffness = area * cut.strength * (1.0 / widest - 1.0 / critical)
    return -stiffness * opening / (1.0 + give * stiffness)


@inlined
def push_flanks(cut: Floats, body: Floats, speed: float, kick: float, dt: float, friction: Floats) -> Floats:
    """Keep the nodes out of the flanks, and give them friction; returns the largest change and the largest force."""
    change, largest = 0.0, 0.0
    for m in range(cut.many[0]):
        n = cut.touching[m]
        gap, nx, nz = cut.gap[n, 0], cut.gap[n, 1], cut.gap[n, 2]
        u, mobility = cut.velocity[n], kick * body.inverse_mass[n]
        wanted = -gap / dt if gap > 0.0 else min(-_BROUGHT_OUT * gap / dt, _FASTEST * abs(speed))
        give = mobility * (nx * nx * body.free[n, 0] + nz * nz * body.free[n, 2])
        old = cut.flank[n, 0]
        new = max(old + (wanted - nx * u[0] - nz * (u[2] - speed)) / give, 0.0)
        if new == 0.0 and old == 0.0:
            continue
        impart(cut, body, n, 0, nx * (new - old), kick)
        impart(cut, body, n, 2, nz * (new - old), kick)
        cut.flank[n, 0] = new
        change, largest = max(change, abs(new - old)), max(largest, new)
        change = max(change, rub(cut, body, n, speed, kick, friction))
    return change, largest


@inlined
def rub(cut: Floats, body: Floats, n: int, speed: float, kick: float, friction: Floats) -> float:
    """Give a node at a flank the friction that stops its slip, or as much as Coulomb's law allows."""
    u, nx, nz = cut.velocity[n], cut.gap[n, 1], cut.gap[n, 2]
    off = nx * u[0] + nz * (u[2] - speed)
    slip = (u[0] - off * nx, u[1], u[2] - speed - off * nz)
    gain = 1.0 / (kick * body.inverse_mass[n])
    old = (cut.flank[n, 1], cut.flank[n, 2], cut.flank[n, 3])
    along = old[0] * nx + old[2] * nz  # the normal may have turned since
    tx = old[0] - along * nx - gain * slip[0]
    ty = (old[1] - gain * slip[1]) * body.free[n, 1]
    tz = old[2] - along * nz - gain * slip[2]
    size = sqrt(tx * tx + ty * ty + tz * tz)
    limit = friction_limit(cut.flank[n, 0], sqrt(slip[0] ** 2 + slip[1] ** 2 + slip[2] ** 2), friction)
    shrink = limit / size if size > limit else 1.0
    new = (shrink * tx, shrink * ty, shrink * tz)
    change = 0.0
    for i in range(3):
        impart(cut, body, n, i, new[i] - old[i], kick)
        cut.flank[n, 1 + i] = new[i]
        change = max(change, abs(new[i] - old[i]))
    return change


@inlined
def advance_cut(cut: Floats, body: Floats, speed: float, tip: float, dt: float) -> None:
    """Take from the plane what the edge passes in this step, and remember how far each node has opened."""
    for s in range(cut.along.shape[0]):
        if cut.found[s] < 0:
            continue
        ahead = slip_of(cut, s, speed) * dt - cut.behind[s]
        cut.behind[s] = max(-ahead, 0.0)
        passed = max(ahead, 0.0) * cut.spacing * cut.stretch[s]
        for k in range(4):
            p = cut.places[cut.found[s], k]
            cut.area[p] = max(cut.area[p] - cut.shape[s, k] * passed, 0.0)
    for p in range(cut.nodes.shape[0]):
        n = cut.nodes[p]
        if body.x[n, 2] > tip + cut.reach[p]:
            cut.area[p] = 0.0
        cut.widest[p] = max(cut.widest[p], 2.0 * (body.x[n, 0] + dt * cut.velocity[n, 0]))


@inlined
def hand_over(cut: Floats, tools: Floats, body: Floats) -> None:
    """Add all forces to `body.pushes`, and to the blade the opposite of those that are its."""
    count, t = tools.speed.shape[0], cut.tool
    for p in range(cut.nodes.shape[0]):
        if cut.pull[p] != 0.0:
            push(body.pushes, COHESION * count + t, cut.nodes[p], 0, cut.pull[p])
    for s in range(cut.along.shape[0]):
        if cut.found[s] >= 0 and cut.force[s] > 0.0:
            share = cut.rounding[s]
            for k in range(4):
                column = cut.columns[cut.places[cut.found[s], k]]
                for r in range(column.shape[0]):
                    force = cut.shape[s, k] * cut.bearing[s, r] * cut.force[s]
                    push(body.pushes, EDGE * count + t, column[r], 2, -(1.0 - share) * force)
                    push(body.pushes, SURFACE * count + t, column[r], 2, -share * force)
            tools.force[t, 2] += cut.force[s]
    for m in range(cut.many[0]):
        n = cut.touching[m]
        if cut.flank[n, 0] == 0.0:
            cut.flank[n, :] = 0.0
            continue
        for i in range(3):
            pressed, rubbed = flank_normal(cut, n, i) * cut.flank[n, 0], cut.flank[n, 1 + i]
            push(body.pushes, SURFACE * count + t, n, i, pressed)
            push(body.pushes, FRICTION * count + t, n, i, rubbed)
            tools.force[t, i] -= pressed + rubbed
