"""Force over diameter as a power law, F = a·dᵇ, fitted as a straight line of the logarithms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import exp
from typing import Any

import numpy as np


@dataclass(frozen=True)
class PowerLaw:
    """F = factor·d^exponent (N, mm), the exponent's 95 % interval, R² of the logarithms."""

    factor: float
    exponent: float
    exponent_interval: tuple[float, float] | None
    r2: float
    n: int

    def at(self, diameter: float) -> float:
        """Return the force at a diameter."""
        return float(self.factor * diameter**self.exponent)

    def as_dict(self) -> dict[str, Any]:
        """Return the law as JSON values."""
        return asdict(self)


def fit_power_law(diameters: Sequence[float], forces: Sequence[float], level: float = 0.95) -> PowerLaw | None:
    """Return the law through positive forces; None where fewer than two diameters differ."""
    from scipy import stats

    if len(set(diameters)) < 2:
        return None
    # ln F = ln a + b·ln d
    line = stats.linregress(np.log(diameters), np.log(forces))
    n, slope = len(forces), float(line.slope)
    interval = None
    if n > 2:
        reach = float(stats.t.ppf(0.5 + level / 2, n - 2) * line.stderr)
        interval = (slope - reach, slope + reach)
    return PowerLaw(exp(float(line.intercept)), slope, interval, float(line.rvalue) ** 2, n)
