import json

import numpy as np
import pytest
from scipy import stats

from stemcal.doe.coding import term_columns, term_gradient, term_names
from stemcal.doe.designs import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.errors import RunsFailed, UsageError
from stemcal.storage.typed import to_json


def told(surface):
    """What a result tells of a surface, as JSON values."""
    return to_json([getattr(surface, name) for name in TOLD])


TOLD = (
    *("coefficients", "anova", "r2", "adjusted_r2", "predicted_r2", "press", "cv_percent"),
    *("runs_diagnostics", "notes"),
)


def test_summary_numbers(ccd):
    """As other software has them."""
    assert ccd.r2 == pytest.approx(0.9854928877234278, rel=1e-11)
    assert ccd.adjusted_r2 == pytest.approx(0.9724364866745128, rel=1e-11)
    assert ccd.predicted_r2 == pytest.approx(0.9217050116388393, rel=1e-11)
    assert ccd.press == pytest.approx(1289.0643473758219, rel=1e-10)
    assert ccd.adequate_precision == pytest.approx(32.062460877315466, rel=1e-10)
    assert ccd.cv_percent == pytest.approx(3.98305, abs=1e-5)
    assert ccd.lack_of_fit_testable


def test_the_covariance_is_that_of_the_coefficients(ccd):
    """s²(XᵀX)⁻¹ of a matrix written out here, with some terms and with all."""
    x = ccd.design
    columns = [np.ones(len(x)), *x.T, x[:, 0] * x[:, 1], x[:, 0] * x[:, 2], x[:, 1] * x[:, 2], *(x.T**2)]
    for kept, fitted in ((range(10), ccd), ((0, 1, 2, 3), fit_surface(x, ccd.response, ccd.names, ccd.names))):
        matrix = np.column_stack([columns[i] for i in kept])
        rest = ccd.response - matrix @ np.linalg.lstsq(matrix, ccd.response, rcond=None)[0]
        expected = rest @ rest / (len(x) - matrix.shape[1]) * np.linalg.inv(matrix.T @ matrix)
        np.testing.assert_allclose(fitted.covariance, expected, rtol=1e-9, atol=1e-9)
        errors = [row.standard_error for row in fitted.coefficients]
        assert np.sqrt(np.diag(fitted.covariance)) == pytest.approx(errors)


def test_the_published_point_shows_the_sign_of_the_last_square(ccd, coding):
    point = coding.to_coded([[17.96, 0.0387, 87.27]])
    assert ccd.predict(point)[0] == pytest.approx(159.26, abs=0.01)
    printed = np.array([120.42, 31.82, 11.20, 4.22, -4.75, -3.25, -1.75, 1.29, -0.8292, -2.88])
    assert float(term_columns(point)[0] @ printed) == pytest.approx(158.05, abs=0.01)
    assert ccd.mean_interval(point)[0] == pytest.approx([152.8, 165.7], abs=0.05)
    assert ccd.prediction_interval(point)[0] == pytest.approx([146.6, 171.9], abs=0.05)


@pytest.mark.parametrize("k", [1, 2, 4, 5])
def test_a_known_quadratic_comes_back(k):
    names = [f"f{i}" for i in range(k)]
    beta = np.random.default_rng(k).normal(0.0, 5.0, len(term_names(names)))
    design = central_composite(k, 3, 1.7)
    surface = fit_surface(design, term_columns(design) @ beta, names)
    assert [c.value for c in surface.coefficients] == pytest.approx(list(beta), abs=1e-10)
    assert surface.r2 == pytest.approx(1.0, abs=1e-12)
    assert surface.anova[0].f is None  # nothing is left to test against
    assert not surface.lack_of_fit_testable
    json.dumps(told(surface), allow_nan=False)


def test_gradient_is_the_slope(ccd):
    x, step = np.array([0.3, -0.7, 1.1]), 1e-6
    for j in range(3):
        ends = np.array([x, x])
        ends[:, j] += (-step, step)
        low, high = ccd.predict(ends)
        assert ccd.gradient(x)[j] == pytest.approx((high - low) / (2 * step), rel=1e-7)
    assert term_gradient(x).shape == (10, 3)


def test_a_deterministic_solver_has_no_lack_of_fit_test(ccd_runs, coding):
    centre = np.all(np.abs(ccd_runs.coded) < 1e-9, axis=1)
    force = np.where(centre, 120.0, ccd_runs.force)
    surface = fit_surface(ccd_runs.coded, force, coding.names)
    rows = {row.source: row for row in surface.anova}
    assert not surface.lack_of_fit_testable
    (note,) = (note for note in surface.notes if note.kind == "copies_only")
    assert "5 runs" in note.text and "5 residual degrees of freedom" in note.text and surface.copies == 5
    assert rows["Lack of fit"].f is None
    assert (rows["Pure error"].sum_of_squares, rows["Pure error"].df) == (0.0, 0)
    assert rows["Lack of fit"].sum_of_squares == pytest.approx(rows["Residual"].sum_of_squares)
    assert rows["X4"].f > 100.0
    json.dumps(told(surface), allow_nan=False)
    keep = ~centre | (np.arange(len(force)) == np.argmax(centre))
    once = fit_surface(ccd_runs.coded[keep], force[keep], coding.names)
    x = [[0.3, -0.4, 0.8]]
    assert surface.mean_square == once.mean_square and surface.df == once.df == 5
    assert surface.mean_interval(x) == pytest.approx(once.mean_interval(x), rel=1e-15)
    own = stats.chi2.cdf(5 * (surface.cv_percent / 3.0) ** 2, 5)  # the chance that it is rough by 3 % or more
    assert 0.9 < own < 1.0
    (mean_low, mean_high), (low, high) = surface.mean_interval(x)[0], surface.prediction_interval(x)[0]
    s_t = stats.t.ppf(0.975, 5) * surface.mean_square**0.5
    assert ((high - low) / 2) ** 2 - ((mean_high - mean_low) / 2) ** 2 == pytest.approx(own * s_t**2, rel=1e-12)
    assert (surface.adequate_precision, surface.press) == (once.adequate_precision, once.press)


def test_no_replicates_no_lack_of_fit_test():
    design = central_composite(2, 1)
    force = np.random.default_rng(5).normal(100.0, 5.0, len(design))
    surface = fit_surface(design, force, ["a", "b"])
    assert not surface.lack_of_fit_testable
    assert "nothing_repeated" in [note.kind for note in surface.notes]


def test_a_saturated_fit_has_no_error_and_no_nan():
    design = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    force = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
    surface = fit_surface(design, force, ["a", "b"])
    assert surface.predict(design) == pytest.approx(force, abs=1e-10)
    json.dumps(told(surface), allow_nan=False)
    assert surface.adjusted_r2 is surface.press is surface.adequate_precision is None
    assert all(c.standard_error is None for c in surface.coefficients)
    assert np.all(np.isnan(surface.mean_interval(design)))
    assert "saturated_surface" in [note.kind for note in surface.notes]


def test_a_flat_response(ccd_runs, coding):
    surface = fit_surface(ccd_runs.coded, np.full(20, 7.0), coding.names)
    assert surface.r2 is None
    json.dumps(told(surface), allow_nan=False)


def test_a_failed_run_is_left_out(ccd_runs, coding):
    force = ccd_runs.force.copy()
    force[2] = np.nan
    surface = fit_surface(ccd_runs.coded, force, coding.names)
    assert surface.runs_failed == 1
    assert surface.df == 9
    assert [run.run for run in surface.runs_diagnostics] == [1, 2, *range(4, 21)]
    rows = {row.source: row for row in surface.anova}
    assert rows["Lack of fit"].p == pytest.approx(0.017, abs=5e-4)


def test_too_many_failed_runs_are_refused_by_name(ccd_runs, coding):
    force = ccd_runs.force.copy()
    force[[6, 7]] = np.nan  # both axial runs of X4
    force[np.all(np.abs(ccd_runs.coded) < 1e-9, axis=1)] = np.nan
    force[[5, 19, 14]] = np.nan
    with pytest.raises(RunsFailed, match="cannot be estimated"):
        fit_surface(ccd_runs.coded, force, coding.names)
    with pytest.raises(RunsFailed):
        fit_surface(ccd_runs.coded, np.full(20, np.nan), coding.names)


def test_a_two_level_design_cannot_carry_squares():
    design = np.array([[a, b] for a in (-1.0, 1.0) for b in (-1.0, 1.0)] * 2)
    with pytest.raises(UsageError, match=r"the mean, a\^2, b\^2"):
        fit_surface(design, np.arange(8.0), ["a", "b"])


def test_a_run_of_full_leverage_has_no_residual_to_judge():
    design = np.array([[-1.0], [-1.0], [0.0], [0.0], [2.0]])
    surface = fit_surface(design, [1.0, 1.5, 2.0, 2.2, 9.0], ["a"])
    assert surface.runs_diagnostics[4].leverage == pytest.approx(1.0)
    assert surface.runs_diagnostics[4].studentised is None
    assert surface.runs_diagnostics[4].cooks_distance is None
    # of the runs that others can predict, (e/(1 − h))² of two runs at each of two points, e = ±s and h = 1/2
    assert surface.press == pytest.approx(4.0 * (2 * 0.25**2 + 2 * 0.1**2))
