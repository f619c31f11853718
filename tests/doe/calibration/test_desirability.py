"""The desirability of several responses: the textbook's optimum, targets that can all be met, ends beyond reach."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from stemcal.doe.calibration.desirability import Aim, most_desirable
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.surface import Surface, fit_surface

NAMES = ("time", "temperature", "catalyst")
CUBE = Region(np.full(3, -1.682), np.full(3, 1.682), None)
# Conversion and activity over three factors: Myers and Montgomery, Response Surface Methodology, the fitted surfaces.
CONVERSION = (
    81.09,
    [1.0284, 4.043, 6.2037],
    [-1.8366, 2.9382, -5.1915],
    {(0, 1): 2.2150, (0, 2): 11.375, (1, 2): -3.875},
)
ACTIVITY = (
    59.85,
    [3.583, 0.2546, 2.2298],
    [0.83479, 0.07484, 0.05716],
    {(0, 1): -0.3875, (0, 2): -0.375, (1, 2): 0.3125},
)


def values(law: tuple, x: NDArray[np.float64]) -> NDArray[np.float64]:
    constant, linear, square, mixed = law
    found = constant + x @ np.array(linear) + x**2 @ np.array(square)
    return found + sum(weight * x[:, i] * x[:, j] for (i, j), weight in mixed.items())


def surface(law: tuple) -> Surface:
    design = np.asarray(central_composite(3))
    return fit_surface(design, values(law, design), NAMES)


def test_textbook_example() -> None:
    """Conversion as large as can be (80 to 97), activity 57.5 (55 to 60).

    The book's optimum, (−0.51, 1.68, −0.59) with 95.1 and 57.5, which an independent search finds too.
    """
    found = most_desirable([Aim(surface(CONVERSION), 80.0, 97.0, 1e9), Aim(surface(ACTIVITY), 55.0, 57.5, 60.0)], CUBE)

    def undesirable(x: NDArray[np.float64]) -> float:
        conversion, activity = values(CONVERSION, x[None, :])[0], values(ACTIVITY, x[None, :])[0]
        d1 = min(max((conversion - 80.0) / 17.0, 0.0), 1.0)
        d2 = max(min((activity - 55.0) / 2.5, (60.0 - activity) / 2.5), 0.0)
        return -float((d1 * d2) ** 0.5)

    best = differential_evolution(undesirable, [(-1.682, 1.682)] * 3, seed=1, tol=1e-12, maxiter=3000, popsize=40)
    assert found.overall == pytest.approx(-best.fun, abs=2e-5)
    assert found.overall >= -best.fun - 1e-6
    assert found.coded == pytest.approx(best.x, abs=2e-2)
    assert found.coded == pytest.approx([-0.51, 1.68, -0.59], abs=0.01)
    assert found.predicted == pytest.approx((95.1, 57.5), abs=0.05)
    assert found.predicted[0] == pytest.approx(80.0 + 17.0 * found.each[0], rel=1e-6)


def test_targets_that_can_all_be_met_are_met_nearest_to_the_centre() -> None:
    truth = np.array([[0.3, -0.2, 0.4]])
    aims = [Aim(surface(law), 0.0, float(values(law, truth)[0]), 200.0) for law in (CONVERSION, ACTIVITY)]
    found = most_desirable(aims, CUBE)
    assert found.overall == pytest.approx(1.0, abs=1e-6) and found.each == pytest.approx((1.0, 1.0), abs=1e-5)
    assert np.linalg.norm(found.coded) <= np.linalg.norm(truth) + 1e-3


def test_a_response_out_of_reach_makes_all_of_it_worthless() -> None:
    found = most_desirable(
        [Aim(surface(CONVERSION), 500.0, 600.0, 700.0), Aim(surface(ACTIVITY), 55.0, 57.5, 60.0)], CUBE
    )
    assert found.overall == 0.0 and found.each[0] == 0.0


def test_stays_inside_the_sphere() -> None:
    ball = Region(np.full(3, -1.682), np.full(3, 1.682), 1.0)
    found = most_desirable([Aim(surface(CONVERSION), 0.0, 300.0, 400.0)], ball)
    assert np.linalg.norm(found.coded) == pytest.approx(1.0, abs=1e-5)
