import pytest

from stemcal.power_law import fit_power_law


def test_power_law_of_the_published_means() -> None:
    law = fit_power_law([7, 8, 9, 10, 11], [120.0, 159.2, 213.8, 300.0, 378.2])
    assert law is not None and law.exponent_interval is not None
    assert law.exponent == pytest.approx(2.59, abs=0.005)
    assert law.exponent_interval == pytest.approx((2.25, 2.93), abs=0.01)


def test_power_law_is_exact_on_its_own_points() -> None:
    diameters = [5.0, 7.0, 11.0, 13.0]
    law = fit_power_law(diameters, [0.7 * d**2.3 for d in diameters])
    assert law is not None
    assert (law.factor, law.exponent, law.r2) == pytest.approx((0.7, 2.3, 1.0))
    assert law.at(9.0) == pytest.approx(0.7 * 9.0**2.3)


def test_power_law_needs_two_diameters_and_forces_above_zero() -> None:
    assert fit_power_law([8.0, 8.0], [1.0, 2.0]) is None
    assert fit_power_law([7.0, 8.0], [0.0, 2.0]) is None
    two = fit_power_law([1.0, 2.0], [1.0, 8.0])
    assert two is not None and two.exponent == pytest.approx(3.0) and two.exponent_interval is None
