"""Lenth's method: significant effects without enough degrees of freedom for an error.

Most effects are taken to be chance; their pseudo standard error PSE represents the error of all. One effect is
significant beyond the margin of error ME = t(1 − α/2; m/3)·PSE, as one of m effects beyond the simultaneous margin
SME = t(γ; m/3)·PSE with γ = (1 + (1 − α)^(1/m))/2.

Source: R. V. Lenth, Technometrics 31 (1989), 469–473.
"""

from dataclasses import dataclass

import numpy as np

from stemcal.doe.coding import Array
from stemcal.doe.regression.least_squares import t_quantile

FEWEST = 3  # effects


@dataclass(frozen=True)
class Lenth:
    """Pseudo standard error, margin of error and simultaneous margin of error; None below three effects."""

    pse: float | None
    me: float | None
    sme: float | None


def lenth(effects: Array, alpha: float = 0.05) -> Lenth:
    """Return PSE = 1.5·median of the |c| < 2.5·s₀, s₀ = 1.5·median|c|, and its margins.

    >>> lenth(np.array([1.0, -1.0, 2.0, -2.0, 3.0, 30.0, -40.0])).pse
    3.0
    """
    sizes, m = np.abs(effects), len(effects)
    if m < FEWEST:
        return Lenth(None, None, None)
    inner = sizes[sizes < 2.5 * 1.5 * np.median(sizes)]
    pse = 1.5 * float(np.median(inner)) if len(inner) else 0.0
    return Lenth(pse, t_quantile(1.0 - alpha, m / 3.0) * pse, t_quantile((1.0 - alpha) ** (1.0 / m), m / 3.0) * pse)
