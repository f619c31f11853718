"""Force over diameter as a power law, F = a·dᵇ, fitted as a straight line of the logarithms."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, sqrt

import numpy as np


@dataclass(frozen=True)
class PowerLaw:
    """F = factor·d^exponent (N, mm), the exponent's 95 % interval (None through two points), R² of the logarithms."""

    factor: float
    exponent: float
    exponent_interval: tuple[float, float] | None
    r2: float
    n: int

    def at(self, diameter: float) -> float:
        """Return the force at a diameter."""
        return float(self.factor * diameter**self.exponent)


def fit_power_law(diameters: Sequence[float], forces: Sequence[float]) -> PowerLaw | None:
    """Return the law; None where fewer than two diameters differ, or a number is not positive."""
    from scipy.special import stdtrit

    if len(set(diameters)) < 2 or min(*diameters, *forces) <= 0.0:
        return None
    # ln F = ln a + b·ln d
    x, y = np.log(np.asarray(diameters, dtype=float)), np.log(np.asarray(forces, dtype=float))
    slope, intercept = map(float, np.polyfit(x, y, 1))
    unexplained, n = float(np.sum((y - intercept - slope * x) ** 2)), len(y)
    interval = None
    if n > 2:
        error = sqrt(unexplained / (n - 2) / float(np.sum((x - x.mean()) ** 2)))  # s/√Σ(x − x̄)²
        reach = float(stdtrit(n - 2, 0.975)) * error
        interval = (slope - reach, slope + reach)
    total = float(np.sum((y - y.mean()) ** 2))
    return PowerLaw(exp(intercept), slope, interval, 1.0 - unexplained / total if total else 1.0, n)
