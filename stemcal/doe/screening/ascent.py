"""The walk along the steepest slope of a screening, towards a target instead of a maximum.

The first-order model of a two-level screening, F = F₀ + Σ bⱼxⱼ with bⱼ half the effect, rises fastest along b
(Box and Wilson, J. R. Stat. Soc. B 13 (1951) 1–45). A study that wants one force walks up or down that line until
the force has passed the target.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError


def ascent_path(effects: ArrayLike, steps: int, rise: bool) -> Array:
    """Return (steps + 1, k) coded points from the centre to where the strongest factor meets its range.

    Parameters
    ----------
    effects : array (k,)
        Effects of the active factors, mean(high) − mean(low).
    rise : bool
        Whether the target is above the force at the centre.

    >>> ascent_path([40.0, -20.0], 2, rise=True).tolist()
    [[0.0, -0.0], [0.5, -0.25], [1.0, -0.5]]
    """
    slopes = np.asarray(effects, dtype=float)
    longest = float(np.abs(slopes).max(initial=0.0))
    if longest == 0.0:
        raise UsageError("climb: no active factor has an effect, so there is no slope to follow")
    direction = slopes / longest * (1.0 if rise else -1.0)
    return np.linspace(0.0, 1.0, steps + 1)[:, None] * direction


def own_path(effects: ArrayLike, sizes: Sequence[float | None], steps: int, rise: bool) -> Array:
    """Return (m + 1, k) coded points from the centre in given steps, m ≤ `steps` of which stay in the ranges.

    Parameters
    ----------
    sizes : sequence of k
        Coded length of a step; None for factors that follow in the ratio of their slope to that of the steepest
        factor with a size (D. C. Montgomery, Design and Analysis of Experiments, section 11.2).

    >>> own_path([40.0, -20.0], [0.4, None], 5, rise=True).tolist()
    [[0.0, -0.0], [0.4, -0.2], [0.8, -0.4]]
    """
    slopes = np.asarray(effects, dtype=float)
    own = np.array([np.nan if size is None else size for size in sizes])
    led = np.flatnonzero(np.isfinite(own) & (slopes != 0.0))
    if not len(led):
        raise UsageError("climb.step_sizes: none of these factors has an effect; choose an active factor")
    base = led[np.argmax(np.abs(slopes[led]))]
    along = np.abs(slopes) * own[base] / abs(slopes[base])
    step = np.where(np.isfinite(own), own, along) * np.sign(slopes) * (1.0 if rise else -1.0)
    inside = int(np.floor(1.0 / np.abs(step).max() + 1e-9))
    if inside < 1:
        raise UsageError("climb.step_sizes: the first step is outside the ranges; use smaller steps")
    return np.asarray(np.arange(min(steps, inside) + 1)[:, None] * step)


def passed(responses: Sequence[float | None], target: float) -> bool:
    """Return whether the forces so far lie on both sides of the target.

    >>> passed([100.0, None, 150.0], 159.2), passed([100.0, 150.0, 165.0], 159.2)
    (False, True)
    """
    known = [response for response in responses if response is not None]
    return bool(known) and min(known) <= target <= max(known)


def nearest_step(responses: Sequence[float | None], target: float) -> int:
    """Return the index of the force nearest to the target; failed steps are passed over."""
    known = [i for i, response in enumerate(responses) if response is not None]
    return min(known, key=lambda i: abs((responses[i] or 0.0) - target))
