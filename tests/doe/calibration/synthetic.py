"""Forces at several diameters whose surfaces are known exactly: the same factors, growing differently."""

from __future__ import annotations

import numpy as np

from stemcal.doe.calibration.misfit import Misfit, Observation, misfit_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface, fit_surface

DIAMETERS = (7.0, 8.0, 9.0, 10.0, 11.0)
SIDE = 1.68


def force(x: Array, diameter: float) -> float:
    """F = (d/8)²·(150 + 12a + 5b + ab + b²)·(1 + 0.06·b·(d − 8)): b also changes how force grows."""
    a, b = x
    return float((diameter / 8.0) ** 2 * (150 + 12 * a + 5 * b + a * b + b * b) * (1 + 0.06 * b * (diameter - 8)))


def surfaces() -> list[Surface]:
    """Quadratics through the forces, taken for exact below."""
    coded = central_composite(2, 1, "rotatable")
    return [fit_surface(coded, [force(x, d) for x in coded], ["a", "b"]) for d in DIAMETERS]


def region() -> Region:
    return Region(np.full(2, -SIDE), np.full(2, SIDE), None)


def misfit(measured: Array, sd: float | None, n: int = 6, fitted: list[Surface] | None = None) -> Misfit:
    """Observations at all diameters, each with the coefficient of variation `sd` (a share of the force)."""
    fitted = fitted or surfaces()
    return misfit_of(
        [
            Observation(surface, float(y), None if sd is None else sd * float(y), n)
            for surface, y in zip(fitted, measured, strict=True)
        ]
    )


def exact(fitted: list[Surface], x: Array) -> Array:
    return np.array([float(surface.predict(x)[0]) for surface in fitted])
