"""Erosion: removal of failed elements from the topology, and fixing of nodes without elements.

Elements are marked as failed in `element` or, with an internal length, in `nonlocal_mean`.
"""

from stemcal.arrays import Array, Floats
from stemcal.fem.kernels.block import ALIVE, held
from stemcal.fem.kernels.compile import kernel


@kernel
def erode(topology: Floats, state: Array, v: Array, mass: Array, inverse_mass: Array) -> Floats:
    """Remove the elements that have just failed from the topology.

    Returns the number of these elements, and the kinetic energy of the nodes that lost their last element. These nodes
    are fixed from now on and have no contact.
    """
    count, energy = 0, 0.0
    for e in range(topology.standing.shape[0]):
        if not topology.standing[e] or held(state, topology.slots[e], ALIVE) > 0.0:
            continue
        topology.standing[e] = False
        count += 1
        for a in range(8):
            n = topology.hexes[e, a]
            topology.live[n] -= 1
            if topology.live[n] == 0:
                energy += 0.5 * mass[n] * (v[n, 0] ** 2 + v[n, 1] ** 2 + v[n, 2] ** 2)
                v[n, :] = 0.0
                inverse_mass[n] = 0.0
    return count, energy
