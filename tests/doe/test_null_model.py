"""What formulas without mechanics reach, against errors by hand."""

import numpy as np
import pytest

from stemcal.doe.comparison import formula_elsewhere, null_model

PUBLISHED = ([7.0, 8.0, 9.0, 10.0, 11.0], [120.0, 159.2, 213.8, 300.0, 378.2])


def test_the_published_forces() -> None:
    """One constant with d^2.5: r = d^2.5/F, a = Σr/Σr²."""
    found = null_model(*PUBLISHED)
    d, f = np.array(PUBLISHED)
    left_out = []
    for i in range(5):
        r = np.delete(d**2.5 / f, i)
        left_out.append(100.0 * abs(1.0 - r.sum() / (r @ r) * d[i] ** 2.5 / f[i]))
    assert found.fixed_max_abs_left_out_error_percent == pytest.approx(max(left_out), rel=1e-9)
    grid = np.linspace(2.0, 3.2, 12001)
    missed = []
    for b in grid:
        r = d**b / f
        missed.append(np.sum((1.0 - r.sum() / (r @ r) * r) ** 2))
    assert found.exponent == pytest.approx(grid[int(np.argmin(missed))], abs=1e-4)
    best = min(found.max_abs_left_out_error_percent, found.fixed_max_abs_left_out_error_percent)
    assert found.beaten_by(best - 1e-9) is True and found.beaten_by(best) is False and found.beaten_by(None) is None


def test_an_exact_power_law_is_found() -> None:
    found = null_model([7.0, 8.0, 10.0, 12.0], [3.0 * d**1.7 for d in (7.0, 8.0, 10.0, 12.0)])
    assert found.exponent == pytest.approx(1.7, abs=1e-6)
    assert found.max_abs_left_out_error_percent == pytest.approx(0.0, abs=1e-4)
    assert found.fixed_max_abs_left_out_error_percent > 10.0


def test_few_diameters() -> None:
    assert null_model([8.0], [100.0]) is None
    two = null_model([8.0, 10.0], [100.0, 180.0])
    assert two.exponent is None and two.max_abs_left_out_error_percent is None
    assert formula_elsewhere([], [(8.0, 1.0)]) is None
