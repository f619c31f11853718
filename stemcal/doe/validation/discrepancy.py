"""What the model misses at every diameter, as one scale with scatter: measured = ρ·simulated·(1 + ε).

The simplest discrepancy of M. C. Kennedy and A. O'Hagan, J. R. Statist. Soc. B 63 (2001) 425–464, over the condition: a
constant of the logarithms, ln ρ their mean over the fitted diameters and s their standard deviation, which holds the
scatter of the laboratory too. A force predicted at a diameter lies, with 95 %, within exp(ln ρ ± t·s·√(1 + 1/m)) of the
simulated one, t with m − 1 degrees of freedom. A fitted diameter is predicted from the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, sqrt

import numpy as np

from stemcal.doe.regression.least_squares import t_quantile

FEWEST = 3


@dataclass(frozen=True)
class Discrepancy:
    """The scale ρ of so many fitted diameters, and the standard deviation about it, percent."""

    scale: float
    sd_percent: float
    diameters: int


@dataclass(frozen=True)
class Corrected:
    """A force, or other response, predicted with the scale, and where a measured one lies with 95 %."""

    force: float
    interval: tuple[float, float]


def discrepancy(ratios: Sequence[float]) -> Discrepancy | None:
    """Return the scale of measured over simulated forces; None of fewer than three.

    >>> found = discrepancy([1.0, 1.1, 1.21])
    >>> round(found.scale, 6), round(found.sd_percent, 3)
    (1.1, 9.531)
    """
    if len(ratios) < FEWEST:
        return None
    logs = np.log(np.asarray(ratios, dtype=float))
    return Discrepancy(exp(float(logs.mean())), 100.0 * float(logs.std(ddof=1)), len(ratios))


def corrected(simulated: float, ratios: Sequence[float], level: float = 0.95) -> Corrected | None:
    """Return the prediction of a measured force by the ratios at other diameters; None of fewer than two."""
    m = len(ratios)
    if m < FEWEST - 1:
        return None
    logs = np.log(np.asarray(ratios, dtype=float))
    middle = log(simulated) + float(logs.mean())
    reach = t_quantile(level, m - 1) * float(logs.std(ddof=1)) * sqrt(1.0 + 1.0 / m)
    return Corrected(exp(middle), (exp(middle - reach), exp(middle + reach)))
