"""The power law F = a·dᵇ of the force F over the diameter d, fitted as a straight line to the logarithms."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, sqrt

import numpy as np


@dataclass(frozen=True)
class PowerLaw:
    """F = factor·d^exponent (N, mm), fitted to `n` points."""

    factor: float
    exponent: float
    exponent_interval: tuple[float, float] | None  # 95 % confidence interval; None for two points
    r2: float  # coefficient of determination of ln F
    n: int

    def at(self, diameter: float) -> float:
        """Return the force (N) at a diameter (mm)."""
        return float(self.factor * diameter**self.exponent)


def fit_power_law(diameters: Sequence[float], forces: Sequence[float]) -> PowerLaw | None:
    """Fit the law by least squares; None with fewer than two different diameters, or if a number is not positive."""
    from scipy.special import stdtrit

    if len(set(diameters)) < 2 or min(*diameters, *forces) <= 0.0:
        return None
    # ln F = ln a + b·ln d
    x, y = np.log(np.asarray(diameters, dtype=float)), np.log(np.asarray(forces, dtype=float))
    slope, intercept = map(float, np.polyfit(x, y, 1))
    residual, n = float(np.sum((y - intercept - slope * x) ** 2)), len(y)  # residual sum of squares
    interval = None
    if n > 2:
        # b ± t(0.975, n − 2)·s/√Σ(x − x̄)², with the residual standard deviation s
        error = sqrt(residual / (n - 2) / float(np.sum((x - x.mean()) ** 2)))
        half_width = float(stdtrit(n - 2, 0.975)) * error
        interval = (slope - half_width, slope + half_width)
    total = float(np.sum((y - y.mean()) ** 2))
    return PowerLaw(exp(intercept), slope, interval, 1.0 - residual / total if total else 1.0, n)
