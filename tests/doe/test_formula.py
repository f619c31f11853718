"""What a formula without mechanics reaches, against errors by hand."""

import numpy as np
import pytest

from stemcal.doe.comparison import Formula, formula_elsewhere, formula_left_out, standard_error

PUBLISHED = [(7.0, 120.0), (8.0, 159.2), (9.0, 213.8), (10.0, 300.0), (11.0, 378.2)]
GRID = np.linspace(2.0, 3.2, 12001)


def fitted(d: np.ndarray, f: np.ndarray) -> tuple[float, float]:
    """Return a and b of the least sum of squared relative errors over a grid: r = dᵇ/F, a = Σr/Σr²."""
    r = d ** GRID[:, None] / f
    a = r.sum(axis=1) / (r**2).sum(axis=1)
    best = int(np.argmin(((1.0 - a[:, None] * r) ** 2).sum(axis=1)))
    return a[best], GRID[best]


def test_the_published_forces() -> None:
    found = formula_left_out([(*force, None) for force in PUBLISHED])
    d, f = np.array(PUBLISHED).T
    left_out = []
    for i in range(5):
        a, b = fitted(np.delete(d, i), np.delete(f, i))
        left_out.append(100.0 * abs(1.0 - a * d[i] ** b / f[i]))
    assert found is not None
    assert found.exponent == pytest.approx(fitted(d, f)[1], abs=1e-4)
    assert found.worst_held_out_percent == pytest.approx(max(left_out), abs=0.01)


def test_an_exact_power_law_is_found() -> None:
    found = formula_left_out([(d, 3.0 * d**1.7, None) for d in (7.0, 8.0, 10.0, 12.0)])
    assert found is not None and found.exponent == pytest.approx(1.7, abs=1e-6)
    assert found.worst_held_out_percent == pytest.approx(0.0, abs=1e-4)


def test_through_one_fitted_diameter_there_is_no_comparison() -> None:
    """An exponent that is assumed is no formula of the measurements."""
    one, two = (8.0, 100.0, 1.0), (10.0, 180.0, 1.0)
    assert formula_left_out([one]) is formula_elsewhere([one], [two]) is formula_left_out([one, two]) is None
    assert formula_elsewhere([], [one]) is None
    assert formula_left_out([one, two, (11.0, 230.0, 3.0)]).standard_error_percent == 3.0


def test_errors_differ_only_beyond_the_scatter_of_the_means() -> None:
    """sd 12 % of nine specimens: a mean is known to 4 %, and at 95 % to 7.84 %."""
    error = standard_error(200.0, 24.0, 9)
    assert error == pytest.approx(4.0) and standard_error(200.0, None, 9) is standard_error(200.0, 24.0, None) is None
    formula = formula_elsewhere([(8.0, 64.0, 1.0), (10.0, 100.0, 1.0)], [(9.0, 81.0 / 1.02, error)])
    assert formula is not None and formula.worst_held_out_percent == pytest.approx(2.0, abs=1e-4)
    better = [formula.better(2.0 + difference) for difference in (-8.0, -7.8, 0.0, 7.8, 8.0)]
    assert better == ["model", "neither", "neither", "neither", "formula"]
    unknown = Formula(2.0, 2.0)
    assert [unknown.better(percent) for percent in (1.9, 2.1)] == ["model", "formula"]
