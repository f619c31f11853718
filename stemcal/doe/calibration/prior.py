"""What is known of a factor beforehand: a normal or lognormal distribution of its value, in its own unit.

With z = (v − μ)/σ of the value v, or z = (ln v − m)/s with s² = ln(1 + (sd/mean)²), m = ln(mean) − s²/2, a prior adds
z² to the misfit D as one more measurement would, of known variance. The likelihood has the factor exp(−z²/2), of a
lognormal prior exp(−z²/2)/v.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from stemcal.doe.regression.least_squares import Array

Kind = Literal["normal", "lognormal"]


@dataclass(frozen=True)
class Prior:
    """The prior of the factor at place `j`, whose value is centre + half_step·xⱼ; `mean` and `sd` in its unit."""

    j: int
    kind: Kind
    mean: float
    sd: float
    centre: float
    half_step: float

    def z(self, points: Array) -> Array:
        """Return z at (m, k) coded points."""
        value = self._value(points)
        if self.kind == "normal":
            return np.asarray((value - self.mean) / self.sd)
        m, s = self._logarithmic
        return np.asarray((np.log(value) - m) / s)

    def slope(self, points: Array) -> Array:
        """Return ∂z/∂xⱼ at (m, k) coded points."""
        if self.kind == "normal":
            return np.full(len(points), self.half_step / self.sd)
        return np.asarray(self.half_step / (self._logarithmic[1] * self._value(points)))

    def log_density(self, points: Array) -> Array:
        """Return the log density at (m, k) coded points, up to a constant."""
        jacobian = np.log(self._value(points)) if self.kind == "lognormal" else 0.0
        return np.asarray(-0.5 * self.z(points) ** 2 - jacobian)

    @property
    def _logarithmic(self) -> tuple[float, float]:
        """Mean and standard deviation of the logarithm."""
        s = float(np.sqrt(np.log1p((self.sd / self.mean) ** 2)))
        return float(np.log(self.mean) - 0.5 * s**2), s

    def _value(self, points: Array) -> Array:
        """Return the value; of a lognormal prior one above 0 also where a region is continued below it."""
        value = self.centre + self.half_step * points[:, self.j]
        return np.asarray(np.maximum(value, 1e-12 * self.mean) if self.kind == "lognormal" else value)
