"""A rigid cutting edge whose contact force is spread over a length, by constraints instead of a penalty.

A line force has no continuum limit: the strain under it grows without bound as the mesh gets finer. For an edge of
spread a, contact is a condition on the mean height H_j of the surface around positions y_j along the edge, weighted by
a bell w. Each such condition is called a row:

    H_j = Σ w(s) w(t) z(s, y_j + t),   w ~ (1 − (s/a)²)²,   s across and t along the edge, |s|, |t| < a.

The force λ_j of a row acts on the surface with the same weights. It is the smallest force that keeps the mean height
from rising above the edge, which moves at the velocity V,

    H_j + Δt (Ḣ_j − V) ≤ max(z_edge, H_j),   λ_j ≥ 0,   one of the two with equality,

with Ḣ = Σ N n·v / n_z at a fixed position, for a surface with normal n. Rows share nodes and are therefore solved
together by projected Gauss–Seidel sweeps, from the forces of the last step until the forces no longer change (time
stepping of Moreau and Jean, Comput. Methods Appl. Mech. Eng. 177, 235-257, 1999). A sweep changes the two rows at ±y at
the same time, so that a model with a mirror plane at y = 0 has the same forces as the full model. Friction opposes the
mean slip of a row with at most μ times its force.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy import sqrt
from numpy.typing import NDArray

from stemcal.arrays import Array, Floats, Ints, Mask
from stemcal.fem.kernels.compile import inlined, kernel
from stemcal.fem.kernels.contact import (
    HAIR,
    STEEPEST,
    face_modes,
    face_normal,
    friction_limit,
    locate_in_face,
    shape_functions,
)
from stemcal.fem.kernels.nodes import EDGE, FRICTION, force_on, push
from stemcal.fem.kernels.parting import NO_FRONT, SKIN, find_front

# Sweeps over the rows end when no force changes by more than _CLOSE of the largest, at most after _SWEEPS.
_CLOSE = 1.0e-4
_SWEEPS = 50
# A row whose surface is lower than the edge by more than this share of the spread is inactive until the next update.
_NEAR = 0.05


class SpreadEdge(NamedTuple):
    """Rows along a spread edge and their nodes and forces; created by `stemcal.fem.tools.spread_edge`.

    The surface is sampled along L lines across the edge, with Q samples each. A row is the bell around a position on
    the edge; it covers M lines, some of them mirror images beyond the plane y = 0. Arrays from `found` on change during
    the run.
    """

    tool: int  # index of its tool, −1 for none
    x: float  # position of the edge, mm
    spread: float  # a, mm
    mirrored: bool  # only the half x > 0 of body and bells is computed
    across: Array  # (Q,) positions of the samples across the edge
    weight: Array  # (Q,) w of the samples, from the bell across the edge
    along: Array  # (L,) position y of each line of samples
    lines: Ints  # (R, M) lines of each row, −1 beyond its last
    bell: Array  # (R, M) bell along the edge at these lines
    image: Array  # (R, M) −1 for mirror images, 1 for other lines
    pairs: Ints  # (P, 2) each row with y ≥ 0, from y = 0 outwards, and the row at −y; −1 if a mirror replaces it
    found: Ints  # (L, Q) face under each sample, −1 for none
    place: Array  # (L, Q, 6) ξ, η, height, additional height of the true surface, n_x/n_z, n_y/n_z
    line_sums: Array  # (L, 2) Σ w and Σ w z of the true surface over the samples above a face
    line_sizes: Ints  # (L,) number of nodes under each line
    line_nodes: Ints  # (L, 4 Q) nodes under each line
    line_hold: Array  # (L, 4 Q, 3) Σ w N, Σ w N n_x/n_z and Σ w N n_y/n_z
    sizes: Ints  # (R,) number of nodes of each row
    nodes: Ints  # (R, K) nodes of each row
    shape: Array  # (R, K, 3) Σ w N, with opposite sign where a mirror reverses the component
    normal: Array  # (R, K, 3) Σ w N n/n_z, with the same signs
    slope: Array  # (R, 2) mean n_x/n_z and n_y/n_z
    offset: Array  # (R,) mean height minus Σ normal·x
    compliance: Array  # (R, R) Σ normal·normal/m of two rows, symmetric
    own: Array  # (R,) compliance of a row with itself plus its compliance with the opposite row
    give: Array  # (R,) slip of a row per unit friction impulse on it and on the opposite row, Σ shape²/m along z
    force: Array  # (R, 4) λ and the friction force
    excess: Array  # (R,) scratch: by how much each mean height rises too fast (`_excess_rate`), mm/s
    velocity: Array  # (N, 3) scratch: velocities of the nodes after the kick
    met: Ints  # (N,) the first `met_count` entries are the nodes of all rows, each once
    met_count: NDArray[np.int64]  # (1,)
    is_met: Mask  # (N,) nodes that are among the entries of `met`
    cut: Any  # the plane on which the edge parts the body (`parting.CutPlane`)


@kernel
def update_surface(edge: Floats, candidates: Floats, body: Floats, ahead: float, tip: float) -> None:
    """Update the surface under each row, given by the highest of the faces near the edge, and the compliances.

    Under lines where the top of the cut plane has parted, the cut front replaces the faces. The nodes are at the
    positions x + v·`ahead` that they are about to reach.
    """
    faces, x = candidates.faces, edge.velocity
    for n in range(x.shape[0]):
        for i in range(3):
            x[n, i] = body.x[n, i] + ahead * body.v[n, i]
    _find_surface(edge, faces, candidates.crowns, candidates.face_count[0], x, tip)
    if edge.cut.tool >= 0:
        find_front(edge.cut, edge.along, x, tip, edge.spread)
    for line in range(edge.along.shape[0]):
        if edge.cut.tool < 0 or edge.cut.front[line] == SKIN:
            _gather_line(edge, line, faces)
        else:
            _gather_front(edge, line)
    if edge.cut.twins.shape[0] > 0:
        for line in range(edge.along.shape[0]):
            _share_with_twins(edge, line, body.mass)
    for j in range(edge.lines.shape[0]):
        edge.shape[j, : edge.sizes[j]] = 0.0
        edge.normal[j, : edge.sizes[j]] = 0.0
        edge.sizes[j] = 0
        edge.slope[j, :] = 0.0
        total, height = _mean_height(edge, j)
        if height >= tip - _NEAR * edge.spread:  # lower surfaces cannot reach the edge before the next update
            for m in range(edge.lines.shape[1]):
                if edge.lines[j, m] >= 0:
                    _add_line(edge, j, edge.lines[j, m], edge.image[j, m], edge.bell[j, m] / total)
            edge.offset[j] = height - _along_normal(edge, j, x)
    _list_met(edge)
    _work_out_compliance(edge, body.free, body.inverse_mass)


@kernel
def _find_surface(edge: Floats, faces: Any, crowns: Array, count: int, x: Array, tip: float) -> None:
    """Find for each sample the highest face on its vertical within the spread of the edge, and the point on it."""
    edge.found[:, :] = -1
    for m in range(count):
        a, b, c, d = faces[m, 0], faces[m, 1], faces[m, 2], faces[m, 3]
        fx = face_modes(x[a, 0], x[b, 0], x[c, 0], x[d, 0])
        fy = face_modes(x[a, 1], x[b, 1], x[c, 1], x[d, 1])
        fz = face_modes(x[a, 2], x[b, 2], x[c, 2], x[d, 2])
        left = min(min(x[a, 0], x[b, 0]), min(x[c, 0], x[d, 0])) - edge.x
        right = max(max(x[a, 0], x[b, 0]), max(x[c, 0], x[d, 0])) - edge.x
        near = min(min(x[a, 1], x[b, 1]), min(x[c, 1], x[d, 1]))
        far = max(max(x[a, 1], x[b, 1]), max(x[c, 1], x[d, 1]))
        first, last = np.searchsorted(edge.across, left), np.searchsorted(edge.across, right)
        for l in range(np.searchsorted(edge.along, near), np.searchsorted(edge.along, far)):
            for q in range(first, last):
                xi, eta = locate_in_face(edge.x + edge.across[q], edge.along[l], fx, fy)
                if abs(xi) > 1.0 + HAIR or abs(eta) > 1.0 + HAIR:
                    continue
                height = fz[0] + fz[1] * xi + fz[2] * eta + fz[3] * xi * eta
                n = face_normal(fx, fy, fz, xi, eta)
                if abs(height - tip) > edge.spread or n[2] < STEEPEST:
                    continue
                if edge.found[l, q] < 0 or height > edge.place[l, q, 2]:
                    round_about = xi if abs(fy[1]) > abs(fy[2]) else eta
                    edge.found[l, q] = m
                    edge.place[l, q, 0], edge.place[l, q, 1], edge.place[l, q, 2] = xi, eta, height
                    edge.place[l, q, 3] = crowns[m] * max(1.0 - round_about * round_about, 0.0) / n[2]
                    edge.place[l, q, 4], edge.place[l, q, 5] = n[0] / n[2], n[1] / n[2]


@inlined
def _gather_line(edge: Floats, line: int, faces: Any) -> None:
    """Add up weights, weighted heights and weights per node (`line_hold`) of the samples of a line above a face."""
    edge.line_hold[line, : edge.line_sizes[line]] = 0.0
    edge.line_sizes[line] = 0
    total, height = 0.0, 0.0
    last, places = -1, (0, 0, 0, 0)
    for q in range(edge.weight.shape[0]):
        face, weight = edge.found[line, q], edge.weight[q]
        if face < 0:
            continue
        if face != last:  # successive samples are often in the same face
            last, places = face, _places_of_face(edge, line, faces[face])
        total += weight
        height += weight * (edge.place[line, q, 2] + edge.place[line, q, 3])
        shape = shape_functions(edge.place[line, q, 0], edge.place[line, q, 1])
        for corner in range(4):
            k, share = places[corner], weight * shape[corner]
            edge.line_hold[line, k, 0] += share
            edge.line_hold[line, k, 1] += share * edge.place[line, q, 4]
            edge.line_hold[line, k, 2] += share * edge.place[line, q, 5]
    edge.line_sums[line, 0], edge.line_sums[line, 1] = total, height


@inlined
def _gather_front(edge: Floats, line: int) -> None:
    """Do the same as `_gather_line` for a cut front, with samples on the layers of nodes beside the cut plane."""
    cut, total = edge.cut, 0.0
    edge.line_hold[line, : edge.line_sizes[line]] = 0.0
    edge.line_sizes[line] = 0
    for q in range(edge.weight.shape[0] if cut.front[line] != NO_FRONT else 0):
        layer = 0
        while layer < cut.layers.shape[0] - 2 and cut.layers[layer + 1] < edge.across[q]:
            layer += 1
        within = (edge.across[q] - cut.layers[layer]) / (cut.layers[layer + 1] - cut.layers[layer])
        within = min(max(within, 0.0), 1.0)
        total += edge.weight[q]
        for end in range(4):
            for next_layer in range(2):
                share = cut.shares[line, end] * (within if next_layer == 1 else 1.0 - within)
                if share > 0.0:
                    node = cut.columns[cut.ends[line, end], layer + next_layer]
                    k = _place_of(edge.line_sizes, edge.line_nodes, line, node)
                    edge.line_hold[line, k, 0] += edge.weight[q] * share
    edge.line_sums[line, 0], edge.line_sums[line, 1] = total, total * cut.front[line] if total > 0.0 else 0.0


@inlined
def _share_with_twins(edge: Floats, line: int, mass: Array) -> None:
    """Distribute weights of a line between unparted twin nodes in proportion to mass, because they move as one."""
    cut = edge.cut
    for k in range(edge.line_sizes[line]):
        n = edge.line_nodes[line, k]
        p = cut.number[n]
        if p < 0 or cut.parted[p]:
            continue
        other = cut.twins[p] if cut.nodes[p] == n else cut.nodes[p]
        also = _place_of(edge.line_sizes, edge.line_nodes, line, other)
        if also > k:  # each pair once
            for i in range(3):
                total = edge.line_hold[line, k, i] + edge.line_hold[line, also, i]
                edge.line_hold[line, k, i] = total * mass[n] / (mass[n] + mass[other])
                edge.line_hold[line, also, i] = total - edge.line_hold[line, k, i]


@inlined
def _places_of_face(edge: Floats, line: int, corners: Floats) -> Floats:
    """Return the places of the four corners of a face in the line's list of nodes."""
    sizes, nodes = edge.line_sizes, edge.line_nodes
    first, second = _place_of(sizes, nodes, line, corners[0]), _place_of(sizes, nodes, line, corners[1])
    return first, second, _place_of(sizes, nodes, line, corners[2]), _place_of(sizes, nodes, line, corners[3])


@inlined
def _mean_height(edge: Floats, j: int) -> Floats:
    """Return the sum of a row's weights over the samples above a face, and the mean height of the surface there."""
    total, height = 0.0, 0.0
    for m in range(edge.lines.shape[1]):
        line = edge.lines[j, m]
        if line >= 0:
            total += edge.bell[j, m] * edge.line_sums[line, 0]
            height += edge.bell[j, m] * edge.line_sums[line, 1]
    return (total, height / total) if total > 0.0 else (0.0, -1.0e30)


@inlined
def _add_line(edge: Floats, j: int, line: int, image: float, share: float) -> None:
    """Add `share` × the nodal weights of a line of samples to row j; `image` is −1 for a mirror image, else 1."""
    for m in range(edge.line_sizes[line]):
        k = _place_of(edge.sizes, edge.nodes, j, edge.line_nodes[line, m])
        if k < 0:
            continue
        held = share * edge.line_hold[line, m, 0]
        edge.shape[j, k, 0] += 0.0 if edge.mirrored else held
        edge.shape[j, k, 1] += image * held
        edge.shape[j, k, 2] += held
        along_x, along_y = share * edge.line_hold[line, m, 1], share * edge.line_hold[line, m, 2]
        edge.normal[j, k, 0] += along_x
        edge.normal[j, k, 1] += along_y
        edge.slope[j, 0] += 0.0 if edge.mirrored else along_x
        edge.slope[j, 1] += image * along_y
        edge.normal[j, k, 2] += held


@inlined
def _place_of(sizes: Ints, nodes: Ints, row: int, node: int) -> int:
    """Return the place of a node in the list of a row, adding the node if it is new; −1 if the list is full."""
    for k in range(sizes[row]):
        if nodes[row, k] == node:
            return k
    k = sizes[row]
    if k == nodes.shape[1]:
        return -1
    sizes[row] = k + 1
    nodes[row, k] = node
    return int(k)


@inlined
def _list_met(edge: Floats) -> None:
    """List the nodes of all rows, each once, and set their scratch velocities to zero."""
    for m in range(edge.met_count[0]):
        edge.is_met[edge.met[m]] = False
    count = 0
    for j in range(edge.sizes.shape[0]):
        for k in range(edge.sizes[j]):
            n = edge.nodes[j, k]
            if not edge.is_met[n]:
                edge.is_met[n] = True
                edge.met[count] = n
                count += 1
                for i in range(3):
                    edge.velocity[n, i] = 0.0
    edge.met_count[0] = count


@kernel
def _work_out_compliance(edge: Floats, free: Any, inverse_mass: Array) -> None:
    """Compute the accelerations of mean heights (`compliance`, `own`) and slip (`give`) per unit force of each row."""
    answer = edge.velocity
    for j in range(edge.sizes.shape[0]):
        edge.give[j] = 0.0
        for k in range(edge.sizes[j]):
            n = edge.nodes[j, k]
            edge.give[j] += edge.shape[j, k, 2] ** 2 * inverse_mass[n]
            for i in range(3):
                answer[n, i] = edge.normal[j, k, i] * inverse_mass[n] * free[n, i]
        for other in range(j, edge.sizes.shape[0]):
            edge.compliance[other, j] = edge.compliance[j, other] = _along_normal(edge, other, answer)
        for k in range(edge.sizes[j]):
            answer[edge.nodes[j, k], :] = 0.0
    for p in range(edge.pairs.shape[0]):
        j, across = edge.pairs[p, 0], edge.pairs[p, 1]
        edge.own[j] = edge.compliance[j, j] + (edge.compliance[j, across] if across >= 0 else 0.0)
        if across >= 0:
            edge.own[across] = edge.compliance[across, across] + edge.compliance[j, across]
            common = _common_give(edge, j, across, inverse_mass)
            edge.give[j] += common
            edge.give[across] += common


@inlined
def _common_give(edge: Floats, j: int, other: int, inverse_mass: Array) -> float:
    """Return Σ shape·shape/m along z over the common nodes of two rows."""
    common, answer = 0.0, edge.velocity
    for k in range(edge.sizes[j]):
        answer[edge.nodes[j, k], 2] = edge.shape[j, k, 2]
    for k in range(edge.sizes[other]):
        n = edge.nodes[other, k]
        common += edge.shape[other, k, 2] * answer[n, 2] * inverse_mass[n]
    for k in range(edge.sizes[j]):
        answer[edge.nodes[j, k], 2] = 0.0
    return common


@kernel
def push_spread_edge(edge: Floats, tools: Floats, body: Floats, kick: float, dt: float, friction: Floats) -> None:
    """Solve for the contact forces that keep the stem's surface below the blade edge; add them to `body.pushes`."""
    speed, slide, tip = tools.speed[edge.tool], tools.slide[edge.tool], tools.height[edge.tool]
    _predict_velocities(edge, body, kick)
    for j in range(edge.sizes.shape[0]):
        if edge.sizes[j] == 0:
            edge.force[j, :] = 0.0
        elif _has_force(edge, j):
            _change_velocities(edge, body, j, edge.force[j], kick)
    for j in range(edge.sizes.shape[0]):
        edge.excess[j] = _excess_rate(edge, body, j, speed, tip, dt) if edge.sizes[j] > 0 else 0.0
    _solve_rows(edge, kick)
    for p in range(edge.pairs.shape[0]):
        j, across = edge.pairs[p, 0], edge.pairs[p, 1]
        first = _add_friction(edge, j, slide, speed, kick, friction)
        second = _add_friction(edge, across, slide, speed, kick, friction)
        _change_velocities(edge, body, j, first, kick)
        if across >= 0:
            _change_velocities(edge, body, across, second, kick)
    _add_to_pushes(edge, tools, body)


@inlined
def _add_to_pushes(edge: Floats, tools: Floats, body: Floats) -> None:
    """Add the forces of the rows to `body.pushes` and the opposite to the tool."""
    tool_count = tools.speed.shape[0]
    pressing, rubbing = EDGE * tool_count + edge.tool, FRICTION * tool_count + edge.tool
    for j in range(edge.sizes.shape[0]):
        if not _has_force(edge, j):
            continue
        for k in range(edge.sizes[j]):
            n = edge.nodes[j, k]
            for i in range(3):
                pressed, rubbed = edge.normal[j, k, i] * edge.force[j, 0], edge.shape[j, k, i] * edge.force[j, 1 + i]
                push(body.pushes, pressing, n, i, -pressed)
                push(body.pushes, rubbing, n, i, rubbed)
                tools.force[edge.tool, i] += pressed - rubbed


@inlined
def _along_normal(edge: Floats, j: int, u: Array) -> float:
    """Return Σ normal·u of a row; if u are velocities, this is the rate of its mean height.

    Three independent sums let the processor add them in parallel.
    """
    x, y, z = 0.0, 0.0, 0.0
    for k in range(edge.sizes[j]):
        n = edge.nodes[j, k]
        x += edge.normal[j, k, 0] * u[n, 0]
        y += edge.normal[j, k, 1] * u[n, 1]
        z += edge.normal[j, k, 2] * u[n, 2]
    return x + y + z


@inlined
def _has_force(edge: Floats, j: int) -> bool:
    """Check that row j has a force; most rows have none and need no further computation."""
    force = edge.force[j]
    return bool(force[0] != 0.0 or force[1] != 0.0 or force[2] != 0.0 or force[3] != 0.0)


@inlined
def _predict_velocities(edge: Floats, body: Floats, kick: float) -> None:
    """Compute the velocities that the nodes of all rows would have after the kick without the edge."""
    for m in range(edge.met_count[0]):
        n = edge.met[m]
        for i in range(3):
            gain = kick * force_on(body, n, i) * body.inverse_mass[n] * body.free[n, i]
            edge.velocity[n, i] = body.v[n, i] + gain


@inlined
def _change_velocities(edge: Floats, body: Floats, j: int, force: Floats, kick: float) -> None:
    """Change the velocities of a row's nodes by a force (λ, friction); λ acts downwards, against the normal."""
    for k in range(edge.sizes[j]):
        n = edge.nodes[j, k]
        gain = kick * body.inverse_mass[n]
        for i in range(3):
            pushed = edge.shape[j, k, i] * force[1 + i] - edge.normal[j, k, i] * force[0]
            edge.velocity[n, i] += gain * pushed * body.free[n, i]


@inlined
def _excess_rate(edge: Floats, body: Floats, j: int, speed: float, tip: float, dt: float) -> float:
    """Return the excess of the rate of a row's mean height over the rate that the constraint allows, mm/s.

    The height is computed with the same normals as its rate; otherwise slip along a slope would count as a rise. A
    surface above the edge, for example one exposed by a failed element, may move with the edge but is not pushed back
    to it, because that would add energy.
    """
    # Ḣ − V + min(H − z_edge, 0)/Δt
    above = edge.offset[j] + _along_normal(edge, j, body.x) - tip
    return _along_normal(edge, j, edge.velocity) - speed + min(above, 0.0) / dt


@inlined
def _solve_rows(edge: Floats, kick: float) -> None:
    """Change the forces λ of all rows until no surface rises faster than allowed and no row pulls."""
    rows = edge.sizes.shape[0]
    for _ in range(_SWEEPS):
        largest, change = 0.0, 0.0
        for p in range(edge.pairs.shape[0]):
            j, across = edge.pairs[p, 0], edge.pairs[p, 1]
            here, there = _wanted_change(edge, j, kick), _wanted_change(edge, across, kick)
            _change_row(edge, j, here, kick)
            _change_row(edge, across, there, kick)
            change = max(change, max(abs(here), abs(there)))
        for j in range(rows):
            largest = max(largest, edge.force[j, 0])
        if change <= _CLOSE * largest:
            return


@inlined
def _wanted_change(edge: Floats, j: int, kick: float) -> float:
    """Return the change of λ that removes the excess rate of row j; 0 for j < 0 or a row without nodes."""
    if j < 0 or edge.sizes[j] == 0:
        return 0.0
    # Δλ = excess / (Δt · own compliance), but λ + Δλ ≥ 0
    return max(-edge.force[j, 0], edge.excess[j] / (kick * edge.own[j]))


@inlined
def _change_row(edge: Floats, j: int, change: float, kick: float) -> None:
    """Change the force λ of row j, and the excess rates of all rows accordingly."""
    if change != 0.0:
        edge.force[j, 0] += change
        for other in range(edge.sizes.shape[0]):
            edge.excess[other] -= kick * edge.compliance[j, other] * change


@inlined
def _add_friction(edge: Floats, j: int, slide: float, speed: float, kick: float, friction: Floats) -> Floats:
    """Set row j's friction, which stops its mean slip within Coulomb's limit; return the change of (λ, friction)."""
    if j < 0 or not _has_force(edge, j):
        return 0.0, 0.0, 0.0, 0.0
    # mean velocity Σ w N v of the row's nodes relative to the tool
    slip = (0.0, -slide, -speed)
    nx, ny = edge.slope[j, 0], edge.slope[j, 1]
    for k in range(edge.sizes[j]):
        n, shape = edge.nodes[j, k], edge.shape[j, k]
        u = edge.velocity[n]
        slip = (slip[0] + shape[0] * u[0], slip[1] + shape[1] * u[1], slip[2] + shape[2] * u[2])
    # slip is the velocity without its component along the mean normal (nx, ny, 1)
    size = sqrt(nx * nx + ny * ny + 1.0)
    n = (nx / size, ny / size, 1.0 / size)
    off = slip[0] * n[0] + slip[1] * n[1] + slip[2] * n[2]
    slip = (slip[0] - off * n[0], slip[1] - off * n[1], slip[2] - off * n[2])
    # friction that stops the slip, f − slip / (Δt Σ shape²/m), reduced to μ λ |(nx, ny, 1)| where it is larger
    gain = 1.0 / (kick * edge.give[j])
    held = (edge.force[j, 1] - gain * slip[0], edge.force[j, 2] - gain * slip[1], edge.force[j, 3] - gain * slip[2])
    total = sqrt(held[0] * held[0] + held[1] * held[1] + held[2] * held[2])
    limit = friction_limit(edge.force[j, 0] * size, sqrt(slip[0] ** 2 + slip[1] ** 2 + slip[2] ** 2), friction)
    shrink = limit / total if total > limit else 1.0
    step = (
        0.0,
        shrink * held[0] - edge.force[j, 1],
        shrink * held[1] - edge.force[j, 2],
        shrink * held[2] - edge.force[j, 3],
    )
    for i in range(1, 4):
        edge.force[j, i] += step[i]
    return step
