"""I-optimal designs against every design there is, and against the known optimum of one factor."""

from itertools import combinations, product

import numpy as np
import pytest

from stemcal.doe.designs.d_optimal import d_optimal_runs
from stemcal.doe.designs.i_optimal import HalfSpace, i_optimal, inside, mean_variance, moments
from stemcal.doe.regression.terms import term_columns
from stemcal.errors import UsageError

CUT = (HalfSpace((1.0, 1.0), 0.5),)


def test_no_other_seven_runs_predict_better_under_a_constraint() -> None:
    """All 50,388 sets of seven among the grid points with a + b ≤ ½; M by integration on a finer grid."""
    grid = inside(np.array(list(product((-1.0, -0.5, 0.0, 0.5, 1.0), repeat=2))), CUT)
    assert len(grid) == 19
    axis = np.linspace(-1.0, 1.0, 401)
    fine = inside(np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2), CUT)
    phi_fine = term_columns(fine)
    region = phi_fine.T @ phi_fine / len(fine)
    phi = term_columns(grid)
    least = np.inf
    for start in range(19 - 6):
        sets = np.array([(start, *rest) for rest in combinations(range(start + 1, 19), 6)])
        information = np.einsum("sij,sik->sjk", phi[sets], phi[sets])
        sound = np.linalg.det(information) > 1e-6
        values = np.trace(np.linalg.solve(information[sound], np.broadcast_to(region, information[sound].shape)),
                          axis1=1, axis2=2)  # fmt: skip
        least = min(least, float(values.min(initial=np.inf)))
    found = i_optimal(2, 7, CUT)
    assert len(np.unique(found, axis=0)) == 7 and bool(np.all(found.sum(axis=1) <= 0.5))
    assert mean_variance(found, region) == pytest.approx(least, rel=0.02)
    assert mean_variance(found, region) < mean_variance(d_optimal_runs(np.empty((0, 2)), 7, grid), region)


def test_mean_variance_of_one_factor() -> None:
    """Three runs at −1, 0, 1: ŷ is Lagrange's, and ½∫(L₋² + L₀² + L₊²)dx = 2/15 + 8/15 + 2/15."""
    design = np.array([[-1.0], [0.0], [1.0]])
    assert mean_variance(design, moments(1, ())) == pytest.approx(12.0 / 15.0, rel=2e-3)


def test_constraints_that_leave_too_little_are_refused() -> None:
    with pytest.raises(UsageError, match="they leave 1 points for 7 runs"):
        i_optimal(2, 7, (HalfSpace((1.0, 1.0), -2.0),))
    with pytest.raises(UsageError, match="cannot carry a quadratic"):
        i_optimal(2, 6, (HalfSpace((1.0, 0.0), -0.5),))
