"""Statistics of a sample: mean, standard deviation, their confidence intervals, normality and outliers."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import fmean

import numpy as np

LEVEL = 0.95


@dataclass(frozen=True)
class Summary:
    """Statistics of a sample of n values; statistics that require more values are None.

    sd                           sample standard deviation (divisor n − 1)
    cv_percent                   100·sd/mean
    mean_interval, sd_interval   95 % confidence intervals, Student's t and χ²
    """

    n: int
    mean: float
    sd: float | None
    cv_percent: float | None
    mean_interval: tuple[float, float] | None
    sd_interval: tuple[float, float] | None


def summarise(values: Sequence[float]) -> Summary:
    """Return the statistics of at least one value.

    >>> low, high = summarise([7.0, 8.0, 9.0]).mean_interval
    >>> round(low, 4), round(high, 4)
    (5.5159, 10.4841)
    """
    from scipy.special import chdtri, stdtrit

    n, mean = len(values), fmean(values)
    if n < 2:
        return Summary(n, mean, None, None, None, None)
    sd = float(np.std(values, ddof=1))
    # mean ± t(1 − α/2; n − 1)·s/√n
    reach = float(stdtrit(n - 1, 0.5 + LEVEL / 2)) * sd / sqrt(n)
    # s·√((n − 1)/χ²)
    low, high = (sd * sqrt((n - 1) / float(chdtri(n - 1, 0.5 - side * LEVEL / 2))) for side in (1, -1))
    cv = 100.0 * sd / mean if mean else None
    return Summary(n, mean, sd, cv, (mean - reach, mean + reach), (low, high))


@dataclass(frozen=True)
class ShapiroWilk:
    """Result of Shapiro and Wilk's test of normality: its statistic and p-value."""

    statistic: float
    p: float


def shapiro_wilk(values: Sequence[float]) -> ShapiroWilk:
    """Return Shapiro and Wilk's test of a sample, computed by Royston's algorithm."""
    from scipy import stats

    result = stats.shapiro(np.asarray(values))
    return ShapiroWilk(float(result.statistic), float(result.pvalue))


def outlier_of(values: Sequence[float], alpha: float = 0.05) -> int | None:
    """Return the index of the outlier found by Grubbs' two-sided test at level `alpha`; None if there is none.

    Source: F. E. Grubbs, Technometrics 11 (1969) 1.

    >>> outlier_of([199.31, 199.53, 200.19, 200.82, 201.92, 201.95, 202.18, 245.57])
    7
    """
    from scipy.special import stdtrit

    n = len(values)
    sd = float(np.std(values, ddof=1)) if n > 2 else 0.0
    if sd <= 0.0:
        return None
    # G = max |xᵢ − x̄| / s > (n − 1)/√n · √(t²/(n − 2 + t²)), t = t(1 − α/2n; n − 2)
    distances = np.abs(np.asarray(values) - np.mean(values)) / sd
    index = int(np.argmax(distances))
    t2 = float(stdtrit(n - 2, 1.0 - alpha / (2 * n))) ** 2
    return index if distances[index] > (n - 1) / sqrt(n) * sqrt(t2 / (n - 2 + t2)) else None
