"""Nonlocal failure: the mean plastic strain around each element, which an internal length ℓ compares with the limit.

Without an internal length an element fails by itself, in `element`, where its plastic strain reaches the failure
strain. With an internal length ℓ what counts is the mean of the strain around it,

    ε̄(x) = ∫ w ε dV,   w ~ exp(−r²/ℓ²),

so that failure is a matter of a fixed piece of material and not of one element, whose size would else decide (nonlocal
damage: Pijaudier-Cabot and Bažant, J. Eng. Mech. 113, 1512-1533, 1987). The weight is that of a substance that has
spread for the time t = ℓ²/4 at unit diffusivity, so the mean is worked out as just that: passes of exchange between
elements that share a face,

    ε̄ₑ ← ε̄ₑ + τ/Vₑ Σ_f T_f (ε̄_n − ε̄ₑ),   T = area / distance of centres,   Σ τ = ℓ²/4.

Nothing passes through free surfaces and mirror planes, nor from one material to another: the mean never looks across
the bore, and the strain of a soft pith does not break the skin around it. It is over the body as it
was: elements that have failed keep the strain at which they went, as in the cited theory. Without them the most
strained material would no longer count: the mean around a gap would fall, and the more the smaller the elements are.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.block import ALIVE, LANES, PLASTIC_STRAIN, held
from stemcal.fem.kernels.compile import kernel
from stemcal.fem.kernels.llvm import maximum

Floats = Any
Array = NDArray[np.float64]

# Means are worked out anew from this share of the failure strain on, so that no rounding hides a failure.
_ROUNDED = 1.0 - 1.0e-9


class Exchange(NamedTuple):
    """How plastic strain spreads over neighbours; `stemcal.fem.state.exchange` makes it."""

    share: Array  # (E, 6) τ T/V across each face, 0 where there is nothing behind it
    around: NDArray[np.uint32]  # (E, 6) the element behind each face, itself where there is none
    passes: int  # 0 for local failure
    failure_strain: Array  # (E,)
    spared: NDArray[np.bool_]  # (E,) elements that are never deleted, near a plane on which the body parts
    mean: Array  # (E,) the mean strain, changes
    next: Array  # (E,) scratch
    known: Array  # (blocks, lanes) the strain that the mean was last worked out from, changes
    spare: Array  # (1,) the least by which the mean of a standing element may grow from then until it fails, changes


@kernel
def _spread_strains(exchange: Floats, topology: Floats, state: Array) -> None:
    """Set the mean plastic strain around each element, and how much those that are not eroded are spared."""
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
    """Return whether any mean strain can have reached the failure strain since the means were worked out.

    A mean weighs strains with shares of one: it has grown by no more than the strain that has grown most.
    """
    grown = 0.0
    for b in range(state.shape[0]):
        for lane in range(LANES):
            grown = maximum(grown, float(state[b, PLASTIC_STRAIN, lane] - exchange.known[b, lane]))
    return not grown < exchange.spare[0]


@kernel
def fail_by_mean_strain(exchange: Floats, topology: Floats, state: Array) -> bool:
    """Mark as failed the elements whose mean strain has reached the failure strain; returns whether there are any."""
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
