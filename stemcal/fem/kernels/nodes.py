"""Nodal part of a step: kick, hold, drift; and the sums over nodes that the energy balance needs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import sqrt
from numpy.typing import NDArray

from stemcal.fem.kernels.compile import entry, kernel

Array = NDArray[np.float64]


# Nodes are advanced in chunks of this many, each with its own sums, so that threads may share the chunks out and the
# sums of all keep their bits.
CHUNK = 4096


@entry
def kick_and_drift(body: Any, kick: float, drift: float, sums: Array, begin: int, end: int) -> None:
    """Advance velocities by `kick` and positions by `drift` in chunks begin…end−1, and set forces back to the loads.

        v ← v + kick·(f + push)/m on free components, the driven velocity on the others,   x ← x + drift·v

    Work is force times mean velocity times `kick`. Row c of `sums` gets chunk c's work of the contact forces, work of
    loads and driven components, largest and summed squared speed, and kinetic energy ½ m v⁻·v⁺ of the velocities before
    and after: it belongs to the time of the forces, and with the strain energy of that time it is what central
    differences conserve.
    """
    x, v, f, push, loads = body.x, body.v, body.f, body.push, body.loads
    inverse_mass, free, driven = body.inverse_mass, body.free, body.driven
    for c in range(begin, end):
        work, external, fastest, total, kinetic = 0.0, 0.0, 0.0, 0.0, 0.0
        for n in range(c * CHUNK, min((c + 1) * CHUNK, x.shape[0])):
            speed2, product, pushed, loaded = 0.0, 0.0, 0.0, 0.0
            for i in range(3):
                old, pressed = v[n, i], push[n, i]
                force = f[n, i] + pressed
                new = (old + kick * force * inverse_mass[n]) * free[n, i] + driven[n, i]
                pushed += pressed * (old + new)
                loaded += loads[n, i] * (old + new) * free[n, i] - 2.0 * (force - loads[n, i]) * driven[n, i]
                v[n, i] = new
                x[n, i] += drift * new
                speed2 += new * new
                product += old * new
                f[n, i] = loads[n, i]
                if pressed != 0.0:  # most nodes touch nothing, and zeros that nobody writes take no memory
                    push[n, i] = 0.0
            work += pushed
            external += loaded
            fastest = max(fastest, speed2)
            total += speed2
            kinetic += body.mass[n] * product
        sums[c, 0], sums[c, 1], sums[c, 2], sums[c, 3] = 0.5 * kick * work, 0.5 * kick * external, fastest, total
        sums[c, 4] = 0.5 * kinetic


@kernel
def add_chunks(sums: Array) -> tuple[float, float, float]:
    """Return over all chunks the work of contact, that of loads and driven components, and the largest speed.

    `max` passes over NaN; 0·Σv² is NaN if any speed is not finite.
    """
    work, external, fastest, total = 0.0, 0.0, 0.0, 0.0
    for c in range(sums.shape[0]):
        work += sums[c, 0]
        external += sums[c, 1]
        fastest = max(fastest, sums[c, 2])
        total += sums[c, 3]
    return work, external, sqrt(fastest) + 0.0 * total


@entry
def add_late_forces(body: Any) -> None:
    """Add the forces in the rows apart, the last of all, to those of the nodes in `late`, one after the other."""
    f, late = body.f, body.late
    first = f.shape[0] - late.shape[0]
    for k in range(late.shape[0]):
        for i in range(3):
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
