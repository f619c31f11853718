"""Lenth's method: which effects stand out, when there are too few degrees of freedom for an error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.least_squares import Array, t_quantile


@dataclass(frozen=True)
class Lenth:
    """Pseudo standard error, margin of error and simultaneous margin of error (None below three effects)."""

    pse: float | None
    me: float | None
    sme: float | None
    df: float = 0.0

    def p_value(self, effect: float) -> float | None:
        """Return the two-sided p of one effect, taking |c|/PSE as Student's t with m/3 degrees of freedom."""
        if not self.pse:
            return None
        from scipy.special import stdtr

        return float(2.0 * stdtr(self.df, -abs(effect) / self.pse))


def lenth(effects: Array, alpha: float = 0.05) -> Lenth:
    """Take the effects themselves as the measure of noise, assuming that most of them are noise.

    s₀ = 1.5·median|c|, PSE = 1.5·median of the |c| < 2.5·s₀, ME = t(1 − α/2; m/3)·PSE,
    SME = t((1 + (1 − α)^(1/m))/2; m/3)·PSE.

    Source: R. V. Lenth, Quick and Easy Analysis of Unreplicated Factorials, Technometrics 31 (1989), 469–473.
    """
    sizes = np.abs(effects)
    m = sizes.size
    if m < 3:
        return Lenth(None, None, None)
    s0 = 1.5 * float(np.median(sizes))
    inner = sizes[sizes < 2.5 * s0]
    pse = 1.5 * float(np.median(inner)) if inner.size else 0.0
    df = m / 3.0
    return Lenth(pse, t_quantile(1.0 - alpha, df) * pse, t_quantile((1.0 - alpha) ** (1.0 / m), df) * pse, df)
