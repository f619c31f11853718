"""Nodal part of a step: kick (change of velocities by forces), drift (change of positions), and sums for energies."""

from typing import Any, NamedTuple

import numpy as np
from numpy import sqrt
from numpy.typing import NDArray

from stemcal.arrays import Array, Ints, Mask
from stemcal.fem.kernels.compile import entry, inlined, kernel, summing
from stemcal.fem.kernels.llvm import maximum, store_position, store_velocity

# Number of nodes in a chunk; their data fit into the first-level cache. Sums are formed for each chunk, then added in a
# fixed order, so that the total is bit-identical for any number of threads.
CHUNK = 512
# Sources of contact forces: the surface of a tool, its edge, and the friction of both.
SURFACE, EDGE, FRICTION = 0, 1, 2
KINDS = 3


class Pushes(NamedTuple):
    """Contact forces on the nodes by source, and lists of the few nodes that have any.

    Source s is the kind s // T (`SURFACE`, `EDGE`, `FRICTION`) of tool s % T. The operating system allocates memory
    only for the parts of the arrays that are written.
    """

    force: Array  # (S, N, 3)
    nodes: Ints  # (S, N) nodes with a force, the first `many` entries
    many: NDArray[np.int64]  # (S,)
    listed: Mask  # (S, N) nodes that are listed in `nodes`


@entry
def kick_and_drift(body: Any, kick: float, drift: float, sums: Array, begin: int, end: int) -> None:
    """Advance velocities by the time `kick` and positions by `drift` in chunks begin…end−1; set forces to zero.

        v ← v + kick·(f + load)/m on free components (held ones keep their velocity),   x ← x + drift·v

    Contact forces act before (`kick_by_pushes`) and are cleared afterwards (`clear_pushes`). Row c of `sums` gets, for
    chunk c, the work of loads and driven components (force times mean velocity times `kick`) and the largest speed.
    """
    for c in range(begin, end):
        first, last = c * CHUNK, min((c + 1) * CHUNK, body.x.shape[0])
        loaded, work = body.loads.shape[0] > 0, 0.0
        if body.driven.shape[0] > 0:
            work -= 2.0 * _power_of_holding(body, first, last)
        if loaded:
            work += _kick_by_loads(body, kick, first, last)
        for i in range(3):
            _move_component(body, i, kick, drift, first, last)
        if loaded:
            work += _power_of_loads(body, first, last)
        sums[c, 0], sums[c, 1] = 0.5 * kick * work, _largest_speed(body.v, first, last)


@kernel
def _move_component(body: Any, i: int, kick: float, drift: float, first: int, last: int) -> None:
    """Advance component i of the nodes first…last−1 under the forces of the elements, and set these forces to zero."""
    mine = slice(first, last)  # on a slice, the loop begins at 0, so that numba omits the check for negative indices
    x, v, f = body.x.T[i, mine], body.v.T[i, mine], body.f.T[i, mine]
    free, inverse_mass = body.free.T[i, mine], body.inverse_mass[mine]
    places, velocities, unit = body.seen.x.T[i, mine], body.seen.v.T[i, mine], body.seen.unit
    for n in range(x.shape[0]):
        v[n] += kick * float(f[n]) * inverse_mass[n] * free[n]
        x[n] += drift * v[n]
        f[n] = 0.0
        store_position(places, n, x[n], unit)
        store_velocity(velocities, n, v[n])


@inlined
def _contact_on(pushes: Any, n: int, i: int) -> float:
    force = 0.0
    for s in range(pushes.force.shape[0]):
        force += pushes.force[s, n, i]
    return force


@inlined
def force_on(body: Any, n: int, i: int) -> float:
    """Return component i of all forces on a node: internal, contact, load."""
    force = body.f[n, i] + _contact_on(body.pushes, n, i)
    return float(force + body.loads[n, i] if body.loads.shape[0] > 0 else force)


@kernel
def kinetic_energy_within(body: Any, kick: float) -> float:
    """Return ½ Σ m v⁻·v⁺ with the velocities v⁻ now and v⁺ after the coming kick.

    This is the kinetic energy at the time of the forces; central differences conserve its sum with the strain energy of
    the same time.
    """
    total = 0.0
    for n in range(body.x.shape[0]):
        for i in range(3):
            old = body.v[n, i]
            new = old + kick * force_on(body, n, i) * body.inverse_mass[n] * body.free[n, i]
            total += body.mass[n] * old * new
    return 0.5 * total


@kernel
def _power_of_holding(body: Any, first: int, last: int) -> float:
    """Return Σ f·v of all forces on the driven components of nodes first…last−1."""
    total = 0.0
    for n in range(first, last):
        for i in range(3):
            total += force_on(body, n, i) * body.driven[n, i]
    return total


@kernel
def _power_of_loads(body: Any, first: int, last: int) -> float:
    total = 0.0
    for n in range(first, last):
        for i in range(3):
            total += body.loads[n, i] * body.v[n, i]
    return total


@kernel
def _kick_by_loads(body: Any, kick: float, first: int, last: int) -> float:
    """Kick nodes first…last−1 by the loads; return the loads' power at the velocities before all kicks."""
    before = 0.0
    for n in range(first, last):
        for i in range(3):
            gain = kick * body.inverse_mass[n] * body.free[n, i]
            before += body.loads[n, i] * (body.v[n, i] - gain * _contact_on(body.pushes, n, i))
            body.v[n, i] += gain * body.loads[n, i]
    return before


@inlined
def push(pushes: Any, source: int, n: int, i: int, force: float) -> None:
    """Add component i of a contact force on node n to `pushes`, and list the node."""
    if not pushes.listed[source, n]:
        pushes.listed[source, n] = True
        pushes.nodes[source, pushes.many[source]] = n
        pushes.many[source] += 1
    pushes.force[source, n, i] += force


@kernel
def kick_by_pushes(body: Any, kick: float, tools: Any, held: Array) -> None:
    """Kick the nodes in contact by the contact forces.

    Contact stores or dissipates the energy kick·f·(V − v) with the tool's velocity V and the mean of the nodal
    velocities before and after all kicks. Half of it, with v before, is added to `held` (S,) here; `clear_pushes` adds
    the other half, with v after.
    """
    pushes = body.pushes
    for s in range(pushes.force.shape[0]):
        held[s] += 0.5 * kick * _power_held(body, s, tools)
    for s in range(pushes.force.shape[0]):
        for m in range(pushes.many[s]):
            n = pushes.nodes[s, m]
            for i in range(3):
                body.v[n, i] += kick * pushes.force[s, n, i] * body.inverse_mass[n] * body.free[n, i]


@kernel
def _power_held(body: Any, source: int, tools: Any) -> float:
    """Return Σ f·(V − v) over the nodes of a source: the power of the tool that contact does not pass to the nodes."""
    pushes, power, t = body.pushes, 0.0, source % tools.speed.shape[0]
    for m in range(pushes.many[source]):
        n, force = pushes.nodes[source, m], pushes.force[source]
        power += force[n, 2] * tools.speed[t]
        power += force[n, 1] * tools.slide[t]
        for i in range(3):
            power -= force[n, i] * body.v[n, i]
    return power


@kernel
def clear_pushes(body: Any, kick: float, tools: Any, held: Array) -> None:
    """Add the second half of the energy of contact to `held` (see `kick_by_pushes`), and clear the contact forces."""
    pushes = body.pushes
    for s in range(pushes.force.shape[0]):
        held[s] += 0.5 * kick * _power_held(body, s, tools)
        for m in range(pushes.many[s]):
            n = pushes.nodes[s, m]
            for i in range(3):
                pushes.force[s, n, i] = 0.0
            pushes.listed[s, n] = False
        pushes.many[s] = 0


@summing
def _largest_speed(v: Array, first: int, last: int) -> float:
    """Return the largest speed of nodes first…last−1; NaN if a velocity is not a number."""
    x, y, z = v.T[0, first:last], v.T[1, first:last], v.T[2, first:last]
    fastest = 0.0
    for n in range(x.shape[0]):
        fastest = maximum(fastest, x[n] * x[n] + y[n] * y[n] + z[n] * z[n])
    return float(sqrt(fastest))


@kernel
def add_chunks(sums: Array) -> tuple[float, float]:
    """Return the work of loads and driven components, and the largest speed, from the `sums` of all chunks (C, 2)."""
    work, fastest = 0.0, 0.0
    for c in range(sums.shape[0]):
        work += sums[c, 0]
        fastest = maximum(fastest, sums[c, 1])
    return work, fastest


@kernel
def add_late_forces(body: Any, mine: Any) -> None:
    """Add the separate rows of f (its last rows) with the indices `mine` to the rows of their nodes, in this order."""
    f, late = body.f, body.late
    first = f.shape[0] - late.shape[0]
    for i in range(3):
        for m in range(mine.shape[0]):
            k = mine[m]
            f[late[k], i] += f[first + k, i]
            f[first + k, i] = 0.0


@entry
def copy_for_elements(body: Any) -> None:
    """Copy the positions and velocities of all nodes into the form that the elements read."""
    for n in range(body.x.shape[0]):
        for i in range(3):
            store_position(body.seen.x.T[i], n, body.x[n, i], body.seen.unit)
            store_velocity(body.seen.v.T[i], n, body.v[n, i])


@entry
def kinetic_energy(v: Array, mass: Array) -> float:
    """Return ½ Σ m v², mJ."""
    total = 0.0
    for n in range(v.shape[0]):
        total += mass[n] * (v[n, 0] * v[n, 0] + v[n, 1] * v[n, 1] + v[n, 2] * v[n, 2])
    return 0.5 * total
