"""Nonlocal failure: an element fails when the weighted mean plastic strain around it reaches the failure strain.

Without an internal length, an element fails in `element` when its own plastic strain reaches the failure strain. With
an internal length ℓ, the mean of the strain around it is compared with the failure strain,

    ε̄(x) = ∫ w ε dV,   w ~ exp(−r²/ℓ²),

so that failure depends on a fixed volume of material instead of on the size of an element (nonlocal damage:
Pijaudier-Cabot and Bažant, J. Eng. Mech. 113, 1512-1533, 1987). This weight is the solution of the diffusion equation
at the time t = ℓ²/4 with unit diffusivity. The mean is therefore computed by explicit diffusion in several passes, with
exchange between elements that share a face,

    ε̄ₑ ← ε̄ₑ + τ/Vₑ Σ_f T_f (ε̄_n − ε̄ₑ),   T = area / distance of centres,   Σ τ = ℓ²/4.

Nothing is exchanged through free surfaces and mirror planes, nor between different materials: the mean does not extend
across the bore, and the strain of a soft pith does not break the skin around it. Failed elements remain in the mean
with their last strain, as in the cited theory. Without them the most strained material would no longer count, and the
mean around a gap would fall, more so with smaller elements.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array, Floats, Mask
from stemcal.fem.kernels.block import ALIVE, LANES, PLASTIC_STRAIN, held
from stemcal.fem.kernels.compile import kernel
from stemcal.fem.kernels.llvm import maximum

# Means are computed again when one may have reached this share of the failure strain; below 1 because of round-off.
_ROUNDED = 1.0 - 1.0e-9


class Exchange(NamedTuple):
    """Coefficients and results of the averaging over neighbours; created by `stemcal.fem.state.exchange`.

    Arrays from `mean` on change during the run.
    """

    share: Array  # (E, 6) τ T/V across each face, 0 where there is nothing behind it
    around: NDArray[np.uint32]  # (E, 6) index of the element behind each face; at a free face, of the element itself
    passes: int  # 0 for local failure
    failure_strain: Array  # (E,)
    spared: Mask  # (E,) elements that are never deleted, near a plane on which the body parts
    mean: Array  # (E,) mean plastic strain around each element
    next: Array  # (E,) scratch
    known: Array  # (blocks, lanes) plastic strains from which the means were last computed
    spare: Array  # (1,) smallest increase of a mean since then at which a standing element would fail


@kernel
def _spread_strains(exchange: Floats, topology: Floats, state: Array) -> None:
    """Compute the mean plastic strain around each element, and `spare`, the margin until the first element fails."""
    mean, after, share, around = exchange.mean, exchange.next, exchange.share, exchange.around
    slots, standing = topology.slots, topology.standing
    for e in range(mean.shape[0]):
        mean[e] = held(state, slots[e], PLASTIC_STRAIN)
    for b in range(state.shape[0]):
        for lane in range(LANES):
            exchange.known[b, lane] = state[b, PLASTIC_STRAIN, lane]
    for _ in range(exchange.passes):
        for e in range(mean.shape[0]):
            gained = 0.0
            for face in range(6):
                gained += share[e, face] * (mean[around[e, face]] - mean[e])
            after[e] = mean[e] + gained
        for e in range(mean.shape[0]):  # `mean[:] = after` takes longer to compile than all of this function
            mean[e] = after[e]
    exchange.spare[0] = np.inf
    for e in range(mean.shape[0]):
        if standing[e]:
            exchange.spare[0] = min(exchange.spare[0], _ROUNDED * exchange.failure_strain[e] - mean[e])


@kernel
def _may_have_failed(exchange: Floats, state: Array) -> bool:
    """Check for a possible failure since the means were last computed, without computing them.

    The weights of a mean add up to one, so a mean has increased by at most the largest increase of a strain.
    """
    grown = 0.0
    for b in range(state.shape[0]):
        for lane in range(LANES):
            grown = maximum(grown, float(state[b, PLASTIC_STRAIN, lane] - exchange.known[b, lane]))
    return not grown < exchange.spare[0]


@kernel
def fail_by_mean_strain(exchange: Floats, topology: Floats, state: Array) -> bool:
    """Mark the elements whose mean strain has reached the failure strain as failed; return True if there are any."""
    if not _may_have_failed(exchange, state):
        return False
    _spread_strains(exchange, topology, state)
    failed = False
    for e in range(exchange.mean.shape[0]):
        if topology.standing[e] and not exchange.spared[e] and exchange.mean[e] >= exchange.failure_strain[e]:
            slot = topology.slots[e]
            state[slot // LANES, ALIVE, slot % LANES] = 0.0
            failed = True
    return failed
