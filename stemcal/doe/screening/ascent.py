"""The walk along the steepest slope of a screening, towards a target instead of a maximum.

The first-order model of a two-level screening, F = F₀ + Σ bⱼxⱼ with bⱼ half the effect, rises fastest along b
(Box and Wilson, J. R. Stat. Soc. B 13 (1951) 1–45). A study that wants one force walks up or down that line until
the force has passed the target.
"""

from __future__ import annotations

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
        Whether the target lies above the force at the centre.

    >>> ascent_path([40.0, -20.0], 2, rise=True).tolist()
    [[0.0, -0.0], [0.5, -0.25], [1.0, -0.5]]
    """
    slopes = np.asarray(effects, dtype=float)
    longest = float(np.abs(slopes).max(initial=0.0))
    if longest == 0.0:
        raise UsageError("climb: no active factor has an effect, so there is no slope to walk along")
    direction = slopes / longest * (1.0 if rise else -1.0)
    return np.linspace(0.0, 1.0, steps + 1)[:, None] * direction


def passed(forces: Sequence[float | None], target: float) -> bool:
    """Tell whether the forces so far lie on both sides of the target.

    >>> passed([100.0, None, 150.0], 159.2), passed([100.0, 150.0, 165.0], 159.2)
    (False, True)
    """
    known = [force for force in forces if force is not None]
    return bool(known) and min(known) <= target <= max(known)


def nearest_step(forces: Sequence[float | None], target: float) -> int:
    """Return the index of the force nearest to the target; failed steps are passed over."""
    known = [i for i, force in enumerate(forces) if force is not None]
    return min(known, key=lambda i: abs((forces[i] or 0.0) - target))
