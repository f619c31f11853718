"""Nodal part of a step: kick, hold, drift; and the sums over nodes that the energy balance needs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import sqrt
from numpy.typing import NDArray

from stemcal.fem.kernels.compile import kernel

Array = NDArray[np.float64]


@kernel
def kick_and_drift(
    x: Array,
    v: Array,
    f: Array,
    push: Array,
    loads: Array,
    inverse_mass: Array,
    free: Array,
    driven: Array,
    kick: float,
    drift: float,
) -> tuple[float, float, float]:
    """Advance velocities by `kick` and positions by `drift`, and set the forces back to the loads.

        v ← v + kick·(f + push)/m on free components, the driven velocity on the others,   x ← x + drift·v

    Work is force times mean velocity times `kick`. Returns that of the contact forces, that of loads and driven
    components, and the largest speed.
    """
    work, external, fastest, total = 0.0, 0.0, 0.0, 0.0
    for n in range(x.shape[0]):
        speed2 = 0.0
        for i in range(3):
            old, force = v[n, i], f[n, i] + push[n, i]
            new = (old + kick * force * inverse_mass[n]) * free[n, i] + driven[n, i]
            work += push[n, i] * (old + new)
            external += loads[n, i] * (old + new) * free[n, i] - 2.0 * (force - loads[n, i]) * driven[n, i]
            v[n, i] = new
            x[n, i] += drift * new
            speed2 += new * new
            f[n, i] = loads[n, i]
            push[n, i] = 0.0
        fastest = max(fastest, speed2)
        total += speed2
    # `max` passes over NaN; 0·Σv² is NaN if any speed is not finite
    return 0.5 * kick * work, 0.5 * kick * external, sqrt(fastest) + 0.0 * total


@kernel
def mirror_ghosts(x: Array, v: Array, ghosts: Any) -> None:
    """Set each ghost (g, s) of `ghosts` to the mirror image of its source in the plane x = 0."""
    for m in range(ghosts.shape[0]):
        g, s = ghosts[m, 0], ghosts[m, 1]
        x[g, 0], x[g, 1], x[g, 2] = -x[s, 0], x[s, 1], x[s, 2]
        v[g, 0], v[g, 1], v[g, 2] = -v[s, 0], v[s, 1], v[s, 2]


@kernel
def kinetic_energy(v: Array, mass: Array) -> float:
    """Return ½ Σ m v²."""
    total = 0.0
    for n in range(v.shape[0]):
        total += mass[n] * (v[n, 0] * v[n, 0] + v[n, 1] * v[n, 1] + v[n, 2] * v[n, 2])
    return 0.5 * total
