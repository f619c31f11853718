"""Lenth's method: find significant effects in a design without degrees of freedom for an estimate of the error.

Most of the m effects are assumed to be inactive; the pseudo standard error PSE estimates the standard error of an
effect from these. A single effect is significant at level α if it exceeds the margin of error ME = t(1 − α/2; m/3)·PSE.
The simultaneous margin of error SME = t(γ; m/3)·PSE with γ = (1 + (1 − α)^(1/m))/2 allows for the m comparisons.

Source: R. V. Lenth, Technometrics 31 (1989), 469–473.
"""

from dataclasses import dataclass

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.regression.least_squares import t_quantile

FEWEST = 3  # number of effects that the method requires


@dataclass(frozen=True)
class Lenth:
    """Pseudo standard error, margin of error and simultaneous margin of error; None with fewer than three effects."""

    pse: float | None
    me: float | None
    sme: float | None


def lenth(effects: Array, alpha: float = 0.05) -> Lenth:
    """Compute Lenth's margins for `effects` cⱼ at significance level `alpha`.

    PSE = 1.5·median of all |cⱼ| < 2.5·s₀, with s₀ = 1.5·median |cⱼ|.

    >>> lenth(np.array([1.0, -1.0, 2.0, -2.0, 3.0, 30.0, -40.0])).pse
    3.0
    """
    sizes, m = np.abs(effects), len(effects)
    if m < FEWEST:
        return Lenth(None, None, None)
    inner = sizes[sizes < 2.5 * 1.5 * np.median(sizes)]
    pse = 1.5 * float(np.median(inner)) if len(inner) else 0.0
    return Lenth(pse, t_quantile(1.0 - alpha, m / 3.0) * pse, t_quantile((1.0 - alpha) ** (1.0 / m), m / 3.0) * pse)
