"""A flat valley of a joint fit: recognised, the point of its floor nearest to the centre; what presses outwards."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import exact, misfit, region, surfaces

from stemcal.doe.calibration.contradiction import contradiction, out_of_reach
from stemcal.doe.calibration.joint_fit import fit_jointly
from stemcal.doe.calibration.misfit import Misfit, Observation, best_fit, misfit_of
from stemcal.doe.calibration.ridge import flat_directions, presses_outwards
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.surface import Surface, fit_surface

CODED = central_composite(2, 1, "rotatable")


def plane(mean: float, a: float, b: float) -> Surface:
    """A surface that is the plane mean + a·x₁ + b·x₂."""
    return fit_surface(CODED, mean + CODED @ np.array([a, b]), ["a", "b"])


def measured(*pairs: tuple[Surface, float], sd: float | None = 2.0) -> Misfit:
    return misfit_of([Observation(surface, value, sd, 1000, f"y{i}") for i, (surface, value) in enumerate(pairs)])


def test_two_planes_alike_give_the_foot_of_the_perpendicular() -> None:
    """20a + 10b = 12: nearest to the centre is 12/500·(20, 10) = (0.48, 0.24), flat along (1, −2)/√5."""
    surface = plane(100.0, 20.0, 10.0)
    found = fit_jointly(measured((surface, 112.0), (surface, 112.0), (surface, 112.0)), region())
    assert found.coded == pytest.approx([0.48, 0.24], abs=2e-3)
    assert len(found.flat) == 1 and abs(found.flat[0] @ np.array([2.0, 1.0])) < 1e-6


def test_what_is_identified_is_left_where_it_is() -> None:
    truth = np.array([0.6, -0.4])
    fitted = surfaces()
    joint = misfit(exact(fitted, truth), 0.02, fitted=fitted)
    assert flat_directions(joint, region(), truth).shape == (0, 2)
    assert fit_jointly(joint, region()).coded == pytest.approx(truth, abs=1e-5)


def test_exact_means_are_taken_to_be_good_to_three_per_cent() -> None:
    """Without any sd two nearly parallel planes cross somewhere, wherever 0.1 N puts it: no reason to go there."""
    for shift in (-0.1, 0.1):
        pairs = (plane(100.0, 20.0, 10.0), 104.0), (plane(100.0, 20.0, 10.2), 104.0 + shift)
        found = fit_jointly(measured(*pairs, sd=None), region())
        assert len(found.flat) == 1 and found.coded == pytest.approx([0.16, 0.08], abs=0.01)


@pytest.mark.parametrize("shift", [-0.4, 0.4])
def test_along_a_bent_valley_the_flat_direction_is_that_of_the_point_taken(shift: float) -> None:
    """100 + 20a + 8b + 3b² at 104 N, and 0.2b more at so much more: b = ±2 fits best; flat along (−8 − 6b, 20)."""
    a, b = CODED.T
    bent = [fit_surface(CODED, 100.0 + 20.0 * a + slope * b + 3.0 * b * b, ["a", "b"]) for slope in (8.0, 8.2)]
    joint = measured((bent[0], 104.0), (bent[1], 104.0 + shift), sd=20.0)
    assert abs(best_fit(joint, region())[1]) > 1.5
    found = fit_jointly(joint, region())
    assert len(found.flat) == 1 and abs(found.coded[1]) < 0.2
    change = found.flat[0][0] / found.flat[0][1]
    assert change == pytest.approx(-(8.1 + 6.0 * found.coded[1]) / 20.0, rel=0.01)


def test_data_press_outwards_only_by_more_than_their_scatter() -> None:
    """a = 2.0 is asked for in a region that ends at 1.68: 20·0.32 = 6.4 N, against a standard error of 2 N or 20 N."""
    for sd, presses in ((2.0, True), (20.0, False)):
        pairs = [Observation(plane(100.0, 20.0, 0.0), 140.0, sd * 10.0, 100, "f")]
        pairs += [Observation(plane(100.0, 0.0, 20.0), 100.0, sd * 10.0, 100, "g")]
        joint = misfit_of(pairs)
        x = best_fit(joint, region())
        assert x == pytest.approx([1.68, 0.0], abs=1e-3)
        assert presses_outwards(joint, region(), x) is presses


def test_standard_errors_of_a_contradiction() -> None:
    """Both planes rise along a; one asks for a = 0, the other for a = 1: 20 N apart, each known to 2 N: 10/√2·1."""
    pairs = [
        Observation(plane(100.0, 20.0, 0.0), value, 20.0, 100, kind) for value, kind in ((100.0, "f"), (120.0, "g"))
    ]
    joint = misfit_of(pairs)
    found = contradiction(joint, region())
    assert found is not None and found.index == 1
    error = np.sqrt(joint.variance.sum())
    assert found.standard_errors == pytest.approx(20.0 / error, rel=1e-3) and found.p < 1e-6
    low, high = found.allowed
    reach = np.sqrt(joint.variance[0]) * 1.97
    assert (low, high) == pytest.approx((100.0 - reach, 100.0 + reach), abs=0.15)


@pytest.mark.parametrize(("other", "agrees"), [(150.0, True), (133.0, True), (100.0, False)])
def test_what_is_out_of_reach_contradicts_where_the_nearest_in_reach_does(other: float, agrees: bool) -> None:
    """100 ± 33.6 N is all that 20a reaches: 150 N is out of reach, and 133.6 N agrees with 133 N, not with 100 N."""
    joint = measured((plane(100.0, 20.0, 0.0), 150.0), (plane(100.0, 20.0, 1.0), other))
    assert 0 in out_of_reach(joint, region())
    assert (contradiction(joint, region()) is None) is agrees


def test_values_that_agree_are_none() -> None:
    joint = measured((plane(100.0, 20.0, 0.0), 110.0), (plane(100.0, 20.0, 1.0), 110.5))
    assert contradiction(joint, region()) is None
    assert contradiction(misfit(exact(surfaces(), np.zeros(2)), 0.02), region()) is None
