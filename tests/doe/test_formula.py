"""What a formula without mechanics reaches, against errors by hand."""

import numpy as np
import pytest

from stemcal.doe.comparison import formula_elsewhere, formula_left_out

PUBLISHED = [(7.0, 120.0), (8.0, 159.2), (9.0, 213.8), (10.0, 300.0), (11.0, 378.2)]
GRID = np.linspace(2.0, 3.2, 12001)


def fitted(d: np.ndarray, f: np.ndarray) -> tuple[float, float]:
    """Return a and b of the least sum of squared relative errors over a grid: r = dᵇ/F, a = Σr/Σr²."""
    r = d ** GRID[:, None] / f
    a = r.sum(axis=1) / (r**2).sum(axis=1)
    best = int(np.argmin(((1.0 - a[:, None] * r) ** 2).sum(axis=1)))
    return a[best], GRID[best]


def test_the_published_forces() -> None:
    found = formula_left_out(PUBLISHED)
    d, f = np.array(PUBLISHED).T
    left_out = []
    for i in range(5):
        a, b = fitted(np.delete(d, i), np.delete(f, i))
        left_out.append(100.0 * abs(1.0 - a * d[i] ** b / f[i]))
    assert found is not None
    assert found.exponent == pytest.approx(fitted(d, f)[1], abs=1e-4)
    assert found.worst_held_out_percent == pytest.approx(max(left_out), abs=0.01)


def test_an_exact_power_law_is_found() -> None:
    found = formula_left_out([(d, 3.0 * d**1.7) for d in (7.0, 8.0, 10.0, 12.0)])
    assert found is not None and found.exponent == pytest.approx(1.7, abs=1e-6)
    assert found.worst_held_out_percent == pytest.approx(0.0, abs=1e-4)


def test_few_diameters() -> None:
    """Through a single diameter the exponent is 2.5: 180 N at 10 mm predict 180/1.25^2.5 = 103.0 N at 8 mm."""
    assert formula_left_out([(8.0, 100.0)]) is None and formula_elsewhere([], [(8.0, 1.0)]) is None
    two = formula_left_out([(8.0, 100.0), (10.0, 180.0)])
    assert two is not None and two.exponent == 2.5
    assert two.worst_held_out_percent == pytest.approx(100.0 * (1.8 / 1.25**2.5 - 1.0), rel=1e-9)
