"""Penalty contact with rigid tools: the position of a point relative to a tool, and the contact force on the point.

A tool is a convex polygon in the plane (x, z), offset outwards by a radius and extruded along y: a wedge with a rounded
edge, a block with filleted corners. The normal is that of the offset outline, so it turns smoothly around an edge.

Force on a point with mass m at a penetration δ into a tool:

    normal      f = max(0, kδ − c ẋₙ),   k = p m/Δt²,   c = 2 ζ √(k m)
    tangential  a spring of the same stiffness, limited to μ f (return mapping to Coulomb's cone)
    friction    μ = μ_d + (μ_s − μ_d) exp(−DC |ẋₜ|)
"""

from typing import Any, NamedTuple

import numpy as np
from numpy import exp, sqrt

from stemcal.arrays import Array, Floats, Ints, Mask
from stemcal.fem.kernels.compile import inlined, kernel
from stemcal.fem.kernels.nodes import EDGE, FRICTION, SURFACE, push


class ToolArrays(NamedTuple):
    """Rigid tools in the form that the kernels use; created by `stemcal.fem.tools.tool_arrays`."""

    corners: Array  # (T, P, 2) polygon corners (x, z) counter-clockwise, the last one repeated to fill
    radius: Array  # (T,) outward offset of the polygon
    height: Array  # (T,) current z of the tool's own origin; changes during the run
    speed: Array  # (T,) its velocity along z
    slide: Array  # (T,) its velocity along y
    edge: Array  # (T,) x of its edge
    spread: Array  # (T,) distance from the tool's edge within which nodes touch only the spread edge; 0: none
    reach: Array  # (T,) distance from the tool's edge within which faces can touch the spread edge; 0: none
    traction: Array  # (T, N, 3) friction spring of each node
    force: Array  # (T, 3) force of the stem on the tool in this step; changes during the run
    faces: Mask  # (T,) True if the tool touches the faces of the skin, False if it touches nodes
    skin: Ints  # (F, 5) corners and element of each face of the curved skin; (0, 5) if no tool touches faces
    crowns: Array  # (F,) height of the true surface over the middle of these faces
    skin_mass: Array  # (F, 4) share of these faces in the mass of each corner
    skin_traction: Array  # (T, F, SAMPLES, 3) friction springs of their samples
    sunk: Array  # (T, 2) Σ f δ and Σ f of the samples in this step; changes during the run


class FrictionNumbers(NamedTuple):
    """Contact and friction constants; created by `stemcal.fem.tools.Contact.numbers`."""

    static: float
    dynamic: float
    decay: float
    penalty: float
    damping: float


class EdgeArrays(NamedTuple):
    """Sample points along a tool's edge that touch element faces between the nodes."""

    tool: int  # index of the tool, −1 for none
    x: float  # position of the edge, mm
    y: Array  # (S,) positions of the samples
    per_face: float  # number of samples per element face
    traction: Array  # (2S, 3) friction spring of each sample on either side of the edge
    depth: float  # largest penetration that counts as contact


@inlined
def outline_distance(px: float, pz: float, corners: Array) -> Floats:
    """Return the signed distance of a point from a convex polygon (negative inside), and the polygon's normal there."""
    best, best_x, best_z = -1.0e30, 0.0, 1.0
    near, near_x, near_z = 1.0e30, 0.0, 0.0
    count = corners.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        ex, ez = corners[j, 0] - corners[i, 0], corners[j, 1] - corners[i, 1]
        length2 = ex * ex + ez * ez
        if length2 == 0.0:
            continue
        rx, rz = px - corners[i, 0], pz - corners[i, 1]
        length = sqrt(length2)
        nx, nz = ez / length, -ex / length
        side = rx * nx + rz * nz
        if side > best:
            best, best_x, best_z = side, nx, nz
        along = min(max((rx * ex + rz * ez) / length2, 0.0), 1.0)
        gx, gz = rx - along * ex, rz - along * ez
        gap2 = gx * gx + gz * gz
        if gap2 < near:
            near, near_x, near_z = gap2, gx, gz
    if best <= 0.0 or near == 0.0:
        return best, best_x, best_z
    gap = sqrt(near)
    return gap, near_x / gap, near_z / gap


@inlined
def flank_distance(cut: Floats, n: int, px: float, pz: float) -> Floats:
    """Return the signed distance of a node from the flank on its side, and the outward normal (x, z) there."""
    side = cut.side[n]
    gap, nx, nz = outline_distance(side * px, pz, cut.flanks[0 if side > 0.0 else 1])
    return gap + cut.offset[n], side * nx, nz


@inlined
def may_touch_flank(cut: Floats, n: int, px: float) -> bool:
    """Check that node n may touch the flanks; before its line parts, only off the plane and on its side (px) of it."""
    return bool(cut.parted[cut.line[n]] or (cut.number[n] < 0 and cut.side[n] * px >= 0.0))


@inlined
def friction_limit(normal_force: float, slip: float, friction: Floats) -> float:
    """Return the largest possible friction force μ f, for a normal force f and the slip speed |ẋₜ| = `slip`."""
    mu = friction.dynamic + (friction.static - friction.dynamic) * exp(-friction.decay * slip)
    return mu * normal_force


@inlined
def contact_force(
    depth: float, n: Floats, slip_velocity: Floats, old: Floats, mass: float, dt0: float, dt: float, friction: Floats
) -> Floats:
    """Return the force on a point at a penetration `depth` into a tool, and its new friction spring.

    n: Outward normal of the tool.
    slip_velocity: Velocity of the point relative to the tool.
    old: Friction spring force of the last step.
    dt0, dt: Time step that determines the stiffness, and current time step.
    """
    # k = p m/Δt₀², c = 2ζ √(km), normal force f = max(0, kδ − c ẋₙ)
    k = friction.penalty * mass / (dt0 * dt0)
    c = 2.0 * friction.damping * sqrt(k * mass)
    closing = slip_velocity[0] * n[0] + slip_velocity[1] * n[1] + slip_velocity[2] * n[2]
    normal = max(0.0, k * depth - c * closing)
    # slip velocity ẋₜ = ẋ − ẋₙ n, then the tangential spring s ← s − (s·n) n − k Δt ẋₜ
    tx, ty, tz = (
        slip_velocity[0] - closing * n[0],
        slip_velocity[1] - closing * n[1],
        slip_velocity[2] - closing * n[2],
    )
    off = old[0] * n[0] + old[1] * n[1] + old[2] * n[2]
    sx = old[0] - off * n[0] - k * dt * tx
    sy = old[1] - off * n[1] - k * dt * ty
    sz = old[2] - off * n[2] - k * dt * tz
    # return mapping to Coulomb's cone, |s| ≤ μ f
    size = sqrt(sx * sx + sy * sy + sz * sz)
    limit = friction_limit(normal, sqrt(tx * tx + ty * ty + tz * tz), friction)
    if size > limit:
        shrink = limit / size
        sx, sy, sz = shrink * sx, shrink * sy, shrink * sz
    return (normal * n[0] + sx, normal * n[1] + sy, normal * n[2] + sz), (sx, sy, sz)


@kernel
def push_nodes_out(
    tools: Floats, near: Any, counts: Any, x: Array, v: Array, mass: Array, pushes: Floats, dt0: float, dt: float,
    friction: Floats, cut: Floats,
) -> None:  # fmt: skip
    """Add the contact forces of all tools on the nodes near them, ``near[t, :counts[t]]``, to `pushes`.

    If a blade parts the body, nodes beside the cut plane touch the blade's sharp flanks. Other nodes near a spread edge
    are skipped here: `kernels.spread_edge` computes their forces.
    """
    tool_count = tools.radius.shape[0]
    for t in range(tool_count):
        for m in range(counts[t]):
            n = near[t, m]
            px, pz = x[n, 0], x[n, 2] - tools.height[t]
            if t == cut.tool and may_touch_flank(cut, n, px - tools.edge[t]):
                gap, nx, nz = flank_distance(cut, n, px - tools.edge[t], pz)
                depth = -gap
            elif (px - tools.edge[t]) ** 2 + pz**2 < tools.spread[t] ** 2:
                continue  # the spread edge pushes this node
            else:
                gap, nx, nz = outline_distance(px, pz, tools.corners[t])
                depth = tools.radius[t] - gap
            old = tools.traction[t, n]
            if depth <= 0.0:
                old[:] = 0.0
                continue
            relative = (v[n, 0], v[n, 1] - tools.slide[t], v[n, 2] - tools.speed[t])
            force, spring = contact_force(
                depth, (nx, 0.0, nz), relative, (old[0], old[1], old[2]), mass[n], dt0, dt, friction
            )
            for i in range(3):
                old[i] = spring[i]
                push(pushes, SURFACE * tool_count + t, n, i, force[i] - spring[i])
                push(pushes, FRICTION * tool_count + t, n, i, spring[i])
                tools.force[t, i] -= force[i]


@inlined
def shape_functions(xi: float, eta: float) -> Floats:
    """Return the four bilinear shape functions of a face at (ξ, η)."""
    return (
        0.25 * (1.0 - xi) * (1.0 - eta),
        0.25 * (1.0 + xi) * (1.0 - eta),
        0.25 * (1.0 + xi) * (1.0 + eta),
        0.25 * (1.0 - xi) * (1.0 + eta),
    )


@inlined
def sum_of_squares(shape: Floats) -> float:
    """Return Σ N² of shape functions N; a point of a face with nodes of mass m has the effective mass m/Σ N²."""
    return shape[0] * shape[0] + shape[1] * shape[1] + shape[2] * shape[2] + shape[3] * shape[3]


@inlined
def face_modes(a: float, b: float, c: float, d: float) -> Floats:
    """Return the amplitudes of the modes 1, ξ, η, ξη from the values at corners (−1,−1), (1,−1), (1,1), (−1,1)."""
    return 0.25 * (a + b + c + d), 0.25 * (b + c - a - d), 0.25 * (c + d - a - b), 0.25 * (a + c - b - d)


# Newton's iteration ends at steps below this: it converges quadratically, so the next step is negligible.
CLOSE = 1.0e-7


@inlined
def locate_in_face(px: float, py: float, fx: Floats, fy: Floats) -> Floats:
    """Return (ξ, η) of the point of a face that is above or below (px, py); (9, 9) if the face is vertical.

    fx, fy are the face's modes (`face_modes`). At most four Newton steps solve x(ξ,η) = px, y(ξ,η) = py; a
    parallelogram needs one, and a second to confirm it.
    """
    xi, eta = 0.0, 0.0
    for _ in range(4):
        rx = fx[0] + fx[1] * xi + fx[2] * eta + fx[3] * xi * eta - px
        ry = fy[0] + fy[1] * xi + fy[2] * eta + fy[3] * xi * eta - py
        xx, xe = fx[1] + fx[3] * eta, fx[2] + fx[3] * xi
        yx, ye = fy[1] + fy[3] * eta, fy[2] + fy[3] * xi
        determinant = xx * ye - xe * yx
        if abs(determinant) < 1.0e-12:
            return 9.0, 9.0
        by, across = (rx * ye - xe * ry) / determinant, (xx * ry - rx * yx) / determinant
        xi, eta = min(max(xi - by, -9.0), 9.0), min(max(eta - across, -9.0), 9.0)
        if abs(by) + abs(across) < CLOSE:
            break
    return xi, eta


@inlined
def face_normal(fx: Floats, fy: Floats, fz: Floats, xi: float, eta: float) -> Floats:
    """Return the unit normal, along ∂x/∂ξ × ∂x/∂η, of a face with the modes fx, fy, fz at (ξ, η)."""
    ax, ay, az = fx[1] + fx[3] * eta, fy[1] + fy[3] * eta, fz[1] + fz[3] * eta
    bx, by, bz = fx[2] + fx[3] * xi, fy[2] + fy[3] * xi, fz[2] + fz[3] * xi
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = sqrt(nx * nx + ny * ny + nz * nz) + 1.0e-30
    return nx / size, ny / size, nz / size


# Numbers of sample points of a face along the stem (many, because rollers roll over long elements) and around it.
ALONG, AROUND = 17, 4
SAMPLES = ALONG * AROUND


@inlined
def sample_of_skin(tools: Floats, f: int, s: int, x: Array) -> Floats:
    """Return the shape functions at sample s of face f of the skin, and x and z of the curved surface there."""
    a, b, c, d = tools.skin[f, 0], tools.skin[f, 1], tools.skin[f, 2], tools.skin[f, 3]
    fx = face_modes(x[a, 0], x[b, 0], x[c, 0], x[d, 0])
    fy = face_modes(x[a, 1], x[b, 1], x[c, 1], x[d, 1])
    fz = face_modes(x[a, 2], x[b, 2], x[c, 2], x[d, 2])
    along, around = 2.0 * (s % ALONG) / (ALONG - 1) - 1.0, (2.0 * (s // ALONG) + 1.0) / AROUND - 1.0
    xi, eta = (along, around) if abs(fx[1]) > abs(fx[2]) else (around, along)
    n = face_normal(fx, fy, fz, xi, eta)
    bulge = tools.crowns[f] * (1.0 - around * around)
    px = fx[0] + fx[1] * xi + fx[2] * eta + fx[3] * xi * eta + bulge * n[0]
    pz = fz[0] + fz[1] * xi + fz[2] * eta + fz[3] * xi * eta + bulge * n[2]
    return shape_functions(xi, eta), px, pz


@kernel
def push_skin_out(
    tools: Floats, near: Any, counts: Any, x: Array, v: Array, pushes: Floats, dt0: float, dt: float, friction: Floats
) -> None:
    """Add the contact forces of all tools on the faces near them, ``near[t, :counts[t]]``, to `pushes`.

    Contact is evaluated at samples of each face. With nodes alone, the last node in contact would carry the force until
    the tool reaches the next node, even if it rolls along the skin between them. The four nodes of a face share the
    force of a sample according to their shape functions.
    """
    tool_count = tools.radius.shape[0]
    for t in range(tool_count):
        tools.sunk[t, :] = 0.0
        for m in range(counts[t]):
            f = near[t, m]
            for s in range(SAMPLES):
                shape, px, pz = sample_of_skin(tools, f, s, x)
                gap, nx, nz = outline_distance(px, pz - tools.height[t], tools.corners[t])
                depth, old = tools.radius[t] - gap, tools.skin_traction[t, f, s]
                if depth <= 0.0:
                    old[:] = 0.0
                    continue
                weight = (0.5 if s % ALONG in (0, ALONG - 1) else 1.0) / (AROUND * (ALONG - 1))
                mass, u, w, uz = 0.0, 0.0, -tools.slide[t], -tools.speed[t]
                for corner in range(4):
                    node, share = tools.skin[f, corner], shape[corner]
                    mass += 4.0 * weight * share * tools.skin_mass[f, corner]
                    u, w, uz = u + share * v[node, 0], w + share * v[node, 1], uz + share * v[node, 2]
                force, spring = contact_force(
                    depth, (nx, 0.0, nz), (u, w, uz), (old[0], old[1], old[2]), mass, dt0, dt, friction
                )
                normal = (force[0] - spring[0]) * nx + (force[2] - spring[2]) * nz
                tools.sunk[t, 0] += normal * depth
                tools.sunk[t, 1] += normal
                for i in range(3):
                    old[i] = spring[i]
                    tools.force[t, i] -= force[i]
                    for corner in range(4):
                        node = tools.skin[f, corner]
                        push(pushes, SURFACE * tool_count + t, node, i, shape[corner] * (force[i] - spring[i]))
                        push(pushes, FRICTION * tool_count + t, node, i, shape[corner] * spring[i])


# The edge moves down and touches only faces whose normal is less than about 80° from the vertical (n_z > 0.17). A face
# includes samples up to |ξ| = |η| = 1 + HAIR, so that no gap opens between two faces.
STEEPEST = 0.17
HAIR = 1.0e-3


@kernel
def push_faces_out(
    tools: Floats, edge: Floats, faces: Any, corner_mass: Array, count: int, x: Array, v: Array, pushes: Floats,
    dt0: float, dt: float, friction: Floats,
) -> None:  # fmt: skip
    """Add the forces of the edge's sample points on the exposed faces under the edge, ``faces[:count]``, to `pushes`.

    A sample below a face, inside the body, pushes the face along the face's normal. The four nodes share the force
    according to their shape functions; the opposite force acts on the tool.
    """
    t, tool_count = edge.tool, tools.radius.shape[0]
    tip = tools.height[t]
    touched = np.zeros(edge.traction.shape[0], dtype=np.bool_)
    for m in range(count):
        a, b, c, d = faces[m, 0], faces[m, 1], faces[m, 2], faces[m, 3]
        low = min(min(x[a, 1], x[b, 1]), min(x[c, 1], x[d, 1]))
        high = max(max(x[a, 1], x[b, 1]), max(x[c, 1], x[d, 1]))
        fx = face_modes(x[a, 0], x[b, 0], x[c, 0], x[d, 0])
        fy = face_modes(x[a, 1], x[b, 1], x[c, 1], x[d, 1])
        fz = face_modes(x[a, 2], x[b, 2], x[c, 2], x[d, 2])
        first = np.searchsorted(edge.y, low)
        for j in range(first, edge.y.shape[0]):
            if edge.y[j] > high:
                break
            xi, eta = locate_in_face(edge.x, edge.y[j], fx, fy)
            if abs(xi) > 1.0 + HAIR or abs(eta) > 1.0 + HAIR:
                continue
            n = face_normal(fx, fy, fz, xi, eta)
            depth = (fz[0] + fz[1] * xi + fz[2] * eta + fz[3] * xi * eta - tip) * n[2]
            if n[2] < STEEPEST or depth <= 0.0 or depth > edge.depth:
                continue
            shape = shape_functions(xi, eta)
            sample_mass = corner_mass[m] / (edge.per_face * sum_of_squares(shape))
            relative = (
                shape[0] * v[a, 0] + shape[1] * v[b, 0] + shape[2] * v[c, 0] + shape[3] * v[d, 0],
                shape[0] * v[a, 1] + shape[1] * v[b, 1] + shape[2] * v[c, 1] + shape[3] * v[d, 1] - tools.slide[t],
                shape[0] * v[a, 2] + shape[1] * v[b, 2] + shape[2] * v[c, 2] + shape[3] * v[d, 2] - tools.speed[t],
            )
            # the tolerance keeps a face whose middle is under the edge on the same side in spite of round-off
            slot = 2 * j + (1 if fx[0] - edge.x > HAIR * edge.depth else 0)
            old = edge.traction[slot]
            # the tool's outward normal is opposite to the face's
            force, spring = contact_force(
                depth, (-n[0], -n[1], -n[2]), relative, (old[0], old[1], old[2]), sample_mass, dt0, dt, friction
            )
            touched[slot] = True
            for i in range(3):
                old[i] = spring[i]
            for corner in range(4):
                node = faces[m, corner]
                for i in range(3):
                    push(pushes, EDGE * tool_count + t, node, i, shape[corner] * (force[i] - spring[i]))
                    push(pushes, FRICTION * tool_count + t, node, i, shape[corner] * spring[i])
                    tools.force[t, i] -= shape[corner] * force[i]
    for slot in range(touched.shape[0]):
        if not touched[slot]:
            edge.traction[slot, :] = 0.0
