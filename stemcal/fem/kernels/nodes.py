"""Nodal part of a step: kick, hold, drift; and the sums over nodes that the energy balance needs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import sqrt
from numpy.typing import NDArray

from stemcal.fem.kernels.compile import entry, kernel, summing
from stemcal.fem.kernels.vectors import maximum

Array = NDArray[np.float64]


# Nodes are advanced in chunks of this many, each with its own sums, so that threads may share the chunks out and the
# sums of all keep their bits.
CHUNK = 4096


@entry
def kick_and_drift(body: Any, kick: float, drift: float, sums: Array, begin: int, end: int) -> None:
    """Advance velocities by `kick` and positions by `drift` in chunks begin…end−1, and set forces back to the loads.

        v ← v + kick·(f + push)/m on free components, the driven velocity on the others,   x ← x + drift·v

    Work is force times mean velocity times `kick`. Row c of `sums` gets chunk c's work of the contact forces, work of
    loads and driven components, largest speed, and kinetic energy ½ m v⁻·v⁺ of the velocities before and after: it
    belongs to the time of the forces, and with the strain energy of that time it is what central differences conserve.
    """
    for c in range(begin, end):
        first, last = c * CHUNK, min((c + 1) * CHUNK, body.x.shape[0])
        work, external, kinetic = 0.0, 0.0, 0.0
        for i in range(3):
            pushed, loaded, product = move_component(body, i, kick, drift, first, last)
            work += 0.5 * kick * pushed
            external += 0.5 * kick * loaded
            kinetic += 0.5 * product
        sums[c, 0], sums[c, 1], sums[c, 2], sums[c, 3] = work, external, largest_speed(body.v, first, last), kinetic


@summing
def move_component(body: Any, i: int, kick: float, drift: float, first: int, last: int) -> Any:
    """Advance component i of nodes first…last−1; returns twice the works over `kick`, and twice the kinetic energy."""
    mine = slice(first, last)  # counted from 0, n is never taken for one of Python's negative indices
    x, v, f, push, loads = (
        body.x.T[i, mine],
        body.v.T[i, mine],
        body.f.T[i, mine],
        body.push.T[i, mine],
        body.loads.T[i, mine],
    )
    free, driven, mass, inverse_mass = (
        body.free.T[i, mine],
        body.driven.T[i, mine],
        body.mass[mine],
        body.inverse_mass[mine],
    )
    pushed, loaded, product = 0.0, 0.0, 0.0
    for n in range(x.shape[0]):
        old, pressed, load = v[n], push[n], loads[n]
        force = f[n] + pressed
        new = (old + kick * force * inverse_mass[n]) * free[n] + driven[n]
        pushed += pressed * (old + new)
        loaded += load * (old + new) * free[n] - 2.0 * (force - load) * driven[n]
        product += mass[n] * old * new
        v[n] = new
        x[n] += drift * new
        f[n] = load
        if pressed != 0.0:  # most nodes touch nothing, and zeros that nobody writes take no memory
            push[n] = 0.0
    return pushed, loaded, product


@summing
def largest_speed(v: Array, first: int, last: int) -> float:
    """Return the largest speed of nodes first…last−1, NaN if one is not a number."""
    x, y, z = v.T[0, first:last], v.T[1, first:last], v.T[2, first:last]
    fastest = 0.0
    for n in range(x.shape[0]):
        fastest = maximum(fastest, x[n] * x[n] + y[n] * y[n] + z[n] * z[n])
    return float(sqrt(fastest))


@kernel
def add_chunks(sums: Array) -> tuple[float, float, float]:
    """Return over all chunks the work of contact, that of loads and driven components, and the largest speed."""
    work, external, fastest = 0.0, 0.0, 0.0
    for c in range(sums.shape[0]):
        work += sums[c, 0]
        external += sums[c, 1]
        fastest = maximum(fastest, sums[c, 2])
    return work, external, fastest


@entry
def add_late_forces(body: Any) -> None:
    """Add the forces in the rows apart, the last of all, to those of the nodes in `late`, one after the other."""
    f, late = body.f, body.late
    first = f.shape[0] - late.shape[0]
    for i in range(3):
        for k in range(late.shape[0]):
            f[late[k], i] += f[first + k, i]
            f[first + k, i] = 0.0


@kernel
def mirror_ghosts(x: Array, v: Array, ghosts: Any) -> None:
    """Set each ghost (g, s) of `ghosts` to the mirror image of its source in the plane x = 0."""
    for m in range(ghosts.shape[0]):
        g, s = ghosts[m, 0], ghosts[m, 1]
        x[g, 0], x[g, 1], x[g, 2] = -x[s, 0], x[s, 1], x[s, 2]
        v[g, 0], v[g, 1], v[g, 2] = -v[s, 0], v[s, 1], v[s, 2]


@entry
def kinetic_energy(v: Array, mass: Array) -> float:
    """Return ½ Σ m v²."""
    total = 0.0
    for n in range(v.shape[0]):
        total += mass[n] * (v[n, 0] * v[n, 0] + v[n, 1] * v[n, 1] + v[n, 2] * v[n, 2])
    return 0.5 * total
