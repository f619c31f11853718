"""Does a sample look as if drawn from a normal distribution?

Sources: S. S. Shapiro and M. B. Wilk, Biometrika 52 (1965) 591; T. W. Anderson and D. A. Darling, J. Am. Stat.
Assoc. 49 (1954) 765; for the p-value of the latter with estimated mean and variance M. A. Stephens in R. B.
D'Agostino and M. A. Stephens, Goodness-of-Fit Techniques, Dekker 1986, table 4.9.
"""

from collections.abc import Sequence
from dataclasses import dataclass

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
    from statsmodels.stats.diagnostic import normal_ad

    n = len(values)
    a2, p = normal_ad(np.asarray(values, dtype=float))
    return NormalityTest("Anderson–Darling", float(a2) * (1.0 + 0.75 / n + 2.25 / n**2), float(p))
