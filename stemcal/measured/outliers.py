"""Grubbs' test: is the value farthest from the mean too far for a normal sample?

It names one suspect and drops nothing: who knows the specimen decides. Source: F. E. Grubbs, Technometrics 11
(1969) 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np


@dataclass(frozen=True)
class Grubbs:
    """The value farthest from the mean, its distance in standard deviations, and the largest credible distance."""

    index: int
    statistic: float
    critical: float
    alpha: float
    is_outlier: bool


def grubbs(values: Sequence[float], alpha: float = 0.05) -> Grubbs | None:
    """Return the two-sided test, None for fewer than three values or none that differ."""
    n = len(values)
    sd = float(np.std(values, ddof=1)) if n > 2 else 0.0
    if sd <= 0.0:
        return None
    # G = max |xᵢ − x̄| / s
    distances = np.abs(np.asarray(values) - np.mean(values)) / sd
    index = int(np.argmax(distances))
    statistic, critical = float(distances[index]), critical_value(n, alpha)
    return Grubbs(index, statistic, critical, alpha, statistic > critical)


def critical_value(n: int, alpha: float = 0.05) -> float:
    """Return the largest credible G of `n` values.

    >>> round(critical_value(6), 3), round(critical_value(10), 3)
    (1.887, 2.29)
    """
    from scipy import stats

    # G = (n − 1)/√n · √(t²/(n − 2 + t²)), t = t(1 − α/2n; n − 2)
    t2 = float(stats.t.ppf(1.0 - alpha / (2 * n), n - 2)) ** 2
    return (n - 1) / sqrt(n) * sqrt(t2 / (n - 2 + t2))
