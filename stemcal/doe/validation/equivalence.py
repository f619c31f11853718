"""Measured mean against simulated force: are they different, are they equal enough?

    Welch    t = (m₁ − m₂)/√(v₁ + v₂), v = sd²/n, df = (v₁ + v₂)²/(v₁²/(n₁ − 1) + v₂²/(n₂ − 1))
             (Welch, Biometrika 34 (1947) 28–35); a simulation without scatter has v₂ = 0: the one-sample test
    TOST     equal within ±margin if both one-sided tests reject (Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987)
             657–680)

A large p of Welch's test is no proof of agreement; the equivalence test is what can show it.
"""

from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.least_squares import t_quantile


@dataclass(frozen=True)
class Sample:
    """Mean, standard deviation and size; a computed value has sd 0 and n 1.

    `df` are the degrees of freedom behind the standard deviation where these are not n − 1.
    """

    mean: float
    sd: float = 0.0
    n: int = 1
    df: float | None = None

    @property
    def variance(self) -> float:
        """Variance of the mean."""
        return self.sd**2 / self.n


@dataclass(frozen=True)
class Comparison:
    """`low` and `high` end the 95 % interval of the measured mean; p-values are None without scatter."""

    low: float | None
    high: float | None
    t: float | None
    df: float | None
    p: float | None
    margin: float
    p_equivalent: float | None


def compare_means(measured: Sample, simulated: Sample, margin: float) -> Comparison:
    """Compare two means; `margin` is the difference that does not matter, in their unit.

    >>> found = compare_means(Sample(100.0, 6.0, 9), Sample(104.0), margin=10.0)
    >>> round(found.t, 2), found.df, round(found.p, 4), round(found.p_equivalent, 4)
    (-2.0, 8.0, 0.0805, 0.0085)
    """
    from scipy.special import stdtr

    low, high = mean_interval(measured)
    variance = measured.variance + simulated.variance
    df = _welch_df(measured, simulated)
    if variance == 0.0 or df is None:
        return Comparison(low, high, None, None, None, margin, None)
    error, difference = float(np.sqrt(variance)), measured.mean - simulated.mean
    t = difference / error
    # P(T ≥ t) of the two one-sided tests: difference ≤ −margin, difference ≥ +margin
    sides = [float(stdtr(df, -(difference + margin) / error)), float(stdtr(df, (difference - margin) / error))]
    return Comparison(low, high, t, df, float(2.0 * stdtr(df, -abs(t))), margin, max(sides))


def compare_with_simulated(
    measured: Sample, simulated: float, margin_percent: float, scatter: tuple[float, float] | None
) -> Comparison:
    """Compare a measured mean with a simulated value; the margin is a percentage of the mean.

    `scatter` is the standard deviation of the simulated value as a share of it, and the degrees of freedom behind it.
    """
    share, df = scatter or (0.0, None)
    computed = Sample(simulated, share * abs(simulated), df=df)
    return compare_means(measured, computed, 0.01 * margin_percent * measured.mean)


def mean_interval(sample: Sample, level: float = 0.95) -> tuple[float | None, float | None]:
    """Return the interval of a mean: m ± t·sd/√n."""
    if sample.n < 2 or sample.sd == 0.0:
        return None, None
    half_width = t_quantile(level, sample.n - 1) * float(np.sqrt(sample.variance))
    return sample.mean - half_width, sample.mean + half_width


def _welch_df(a: Sample, b: Sample) -> float | None:
    """Return the degrees of freedom of Welch and Satterthwaite; None if a scatter rests on one value."""
    parts = [(s.variance, s.n - 1 if s.df is None else s.df) for s in (a, b) if s.variance > 0.0]
    if not parts or any(df < 1 for _, df in parts):
        return None
    return float(sum(v for v, _ in parts) ** 2 / sum(v**2 / df for v, df in parts))
