"""Does a sample look as if drawn from a normal distribution?

Sources: S. S. Shapiro and M. B. Wilk, Biometrika 52 (1965) 591; T. W. Anderson and D. A. Darling, J. Am. Stat.
Assoc. 49 (1954) 765; for the p-value of the latter with estimated mean and variance M. A. Stephens in R. B.
D'Agostino and M. A. Stephens, Goodness-of-Fit Techniques, Dekker 1986, table 4.9.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp

import numpy as np

LEAST = 8  # values below which Stephens' formula does not hold


@dataclass(frozen=True)
class NormalityTest:
    """One test: its statistic, and how likely as large a departure is if the population is normal."""

    name: str
    statistic: float
    p: float


def shapiro_wilk(values: Sequence[float]) -> NormalityTest:
    """Return Shapiro and Wilk's test, as computed by Royston's algorithm."""
    from scipy import stats

    result = stats.shapiro(np.asarray(values))
    return NormalityTest("Shapiro–Wilk", float(result.statistic), float(result.pvalue))


def anderson_darling(values: Sequence[float]) -> NormalityTest:
    """Return Anderson and Darling's test, mean and variance estimated; the statistic is A² for n → ∞."""
    from scipy import stats

    x = np.sort(np.asarray(values, dtype=float))
    n = len(x)
    z = (x - x.mean()) / x.std(ddof=1)
    i = np.arange(1, n + 1)
    # A² = −n − Σ (2i − 1)/n · (ln Φ(zᵢ) + ln(1 − Φ(zₙ₊₁₋ᵢ)))
    a2 = -n - float(np.sum((2 * i - 1) / n * (stats.norm.logcdf(z) + stats.norm.logsf(z[::-1]))))
    a2 *= 1.0 + 0.75 / n + 2.25 / n**2
    return NormalityTest("Anderson–Darling", a2, _p_of(a2))


def _p_of(a2: float) -> float:
    """Return Stephens' p-value."""
    if a2 >= 0.6:
        return exp(1.2937 - 5.709 * a2 + 0.0186 * a2**2) if a2 < 10.0 else 0.0
    if a2 > 0.34:
        return exp(0.9177 - 4.279 * a2 - 1.38 * a2**2)
    if a2 > 0.2:
        return 1.0 - exp(-8.318 + 42.796 * a2 - 59.938 * a2**2)
    return 1.0 - exp(-13.436 + 101.14 * a2 - 223.73 * a2**2)
