"""Linear constraints bind the region, and with it solution, ranges and intervals."""

from __future__ import annotations

import numpy as np
import pytest

from stemcal.doe.calibration.inversion import solve_target
from stemcal.doe.calibration.joint_fit import fit_jointly
from stemcal.doe.calibration.misfit import Observation, best_fit, misfit_of
from stemcal.doe.calibration.profile import profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.designs.i_optimal import HalfSpace
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import UsageError

LOW, HIGH = np.full(2, -2.0), np.full(2, 2.0)
A_AT_LEAST_HALF = HalfSpace((-1.0, 0.0), -0.5)
SUM_AT_MOST_NONE = HalfSpace((1.0, 1.0), 0.0)


def plane(a: float, b: float) -> Surface:
    coded = central_composite(2, 1, "rotatable")
    return fit_surface(coded, [100.0 + a * x + b * y for x, y in coded], ["a", "b"])


def test_the_nearest_points_of_a_cut_square() -> None:
    """x + y ≤ 0 of the square ±2: the corner (2, 2) is drawn to the origin, (2, 1) to (0.5, −0.5)."""
    region = Region(LOW, HIGH, None, (SUM_AT_MOST_NONE,))
    assert region.nearest(np.array([2.0, 2.0])) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert region.nearest(np.array([2.0, 1.0])) == pytest.approx([0.5, -0.5])
    assert region.nearest(np.array([-1.0, 0.5])) == pytest.approx([-1.0, 0.5])
    assert np.all(region.cloud(8).sum(axis=1) <= 1e-9) and region.contains(region.spread(8)).all()


def test_the_ends_of_a_disc_cut_by_a_line() -> None:
    """x + y ≤ −1 of the disc of radius 1: both coordinates from −1 to 0; nearest to the centre (−½, −½)."""
    region = Region(LOW, HIGH, 1.0, (HalfSpace((1.0, 1.0), -1.0),))
    low, high = region.bounds()
    assert low == pytest.approx([-1.0, -1.0], abs=1e-6) and high == pytest.approx([0.0, 0.0], abs=1e-6)
    assert region.middle == pytest.approx([-0.5, -0.5])


@pytest.mark.parametrize("radius", [None, 1.0])
def test_constraints_that_leave_nothing_are_refused(radius: float | None) -> None:
    with pytest.raises(UsageError, match="constraints: they leave no point of the region"):
        Region(LOW, HIGH, radius, (HalfSpace((1.0, 1.0), -1.5 if radius else -4.5),))


def test_solution_and_ranges_keep_a_constraint() -> None:
    """100 + 10a + 10b = 100 with a ≥ ½: nearest (½, −½), a from ½ to 2, b from −2 to −½."""
    found = solve_target(plane(10, 10), 100.0, LOW, HIGH, within=(A_AT_LEAST_HALF,))
    assert found.point.coded == pytest.approx((0.5, -0.5), abs=1e-6)
    assert np.array(found.ranges) == pytest.approx(np.array([[0.5, 2.0], [-2.0, -0.5]]), abs=1e-6)


def test_a_joint_fit_and_its_intervals_keep_a_constraint() -> None:
    """D = (a − 0.4)²/0.01 + (b + 0.1)²/0.04 with a ≥ ½, a + b ≤ 0 is least, 5, at (½, −½).

    With b = −a it is 5 + 3.84 at a = 0.5886, the root of 125a² − 85a + 16.25 = 8.84.
    """
    data = misfit_of([Observation(plane(20, 0), 108.0, 2.0), Observation(plane(0, 10), 99.0, 2.0)])
    region = Region(LOW, HIGH, None, (A_AT_LEAST_HALF, SUM_AT_MOST_NONE))
    fit = fit_jointly(data, region)
    assert fit.coded == pytest.approx([0.5, -0.5], abs=1e-4) and fit.misfit == pytest.approx(5.0, abs=1e-3)
    a, b = profiles_of(data, region, best_fit(data, region))
    top = max(np.roots([125.0, -85.0, 16.25 - 8.8415]).real)
    assert (a.low, a.high) == pytest.approx((0.5, top), abs=2e-3) and not a.bounded[0] and a.bounded[1]
    assert b.high == pytest.approx(-0.5, abs=1e-4)
