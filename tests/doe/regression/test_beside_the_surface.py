from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stemcal.doe.designs.catalogue import SurfaceOptions, central_composite, surface_runs
from stemcal.doe.regression.canonical import analyse_shape, quadratic_form, ridge_path
from stemcal.doe.regression.reduction import METHODS, reduce_surface
from stemcal.doe.regression.surface import fit_surface
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.doe.regression.transform import box_cox
from stemcal.errors import UsageError

ABC = ["a", "b", "c"]


def surface_with(beta, k=3):
    names = [f"f{i}" for i in range(k)]
    design = central_composite(k, 4)
    return fit_surface(design, term_columns(design) @ beta, names)


# ---- canonical analysis and ridge


def test_quadratic_form_is_the_surface():
    beta = np.random.default_rng(1).normal(size=10)
    surface = surface_with(beta)
    b0, b, b_matrix = quadratic_form(surface)
    x = np.array([0.4, -0.9, 1.3])
    assert b0 + b @ x + x @ b_matrix @ x == pytest.approx(float(surface.predict(x)[0]))


def test_stationary_point_of_a_known_surface():
    """10 − (x − 0.5)² − 2(y + 0.25)² has its maximum 10 at (0.5, −0.25), with curvatures −1 and −2."""
    beta = np.array([10.0 - 0.25 - 0.125, 1.0, -1.0, 0.0, -1.0, -2.0])
    shape = analyse_shape(surface_with(beta, 2))
    assert shape.point == pytest.approx([0.5, -0.25])
    assert shape.predicted == pytest.approx(10.0)
    assert list(shape.eigenvalues) == pytest.approx([-1.0, -2.0])
    assert (shape.kind, shape.inside) == ("maximum", True)
    assert shape.radius == pytest.approx(0.559, abs=5e-4) and not shape.ridge


def test_planes_and_ridges_have_no_single_stationary_point():
    plane = analyse_shape(surface_with(np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]), 2))
    assert plane.point is None and plane.kind == "plane"
    ridge = analyse_shape(surface_with(np.array([1.0, 0.0, 0.0, 0.0, -2.0, -0.05]), 2))
    assert (ridge.kind, ridge.ridge) == ("maximum", True)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.1, 3.0), st.booleans())
def test_ridge_is_the_best_point_on_the_sphere(seed, radius, ascend):
    random = np.random.default_rng(seed)
    surface = surface_with(random.normal(size=10))
    point = ridge_path(surface, [radius], ascend)[0]
    assert np.linalg.norm(point.coded) == pytest.approx(radius, rel=1e-9)
    directions = random.normal(size=(4000, 3))
    others = surface.predict(radius * directions / np.linalg.norm(directions, axis=1)[:, None])
    sign = 1.0 if ascend else -1.0
    assert sign * point.predicted >= (sign * others).max() - 1e-9


def test_ridge_leaves_a_centre_without_slope_along_the_steepest_axis():
    surface = surface_with(np.array([5.0, 0.0, 0.0, 0.0, 2.0, -1.0]), 2)
    point = ridge_path(surface, [0.0, 1.5])[1]
    assert np.abs(point.coded) == pytest.approx([1.5, 0.0], abs=1e-6)
    assert point.predicted == pytest.approx(5.0 + 2.0 * 1.5**2)


# ---- reduction


@pytest.mark.parametrize("method", METHODS)
def test_reduction_finds_the_true_terms_and_keeps_hierarchy(method):
    design = surface_runs(3, SurfaceOptions())
    noise = np.random.default_rng(3).normal(0.0, 0.5, len(design))
    y = 50.0 + 8.0 * design[:, 0] + 4.0 * design[:, 0] * design[:, 1] - 5.0 * design[:, 2] ** 2 + noise
    found = reduce_surface(design, y, ABC, method, 0.01)
    true = {"1", "a", "b", "c", "a:b", "c^2"}  # b and c stay for a:b and c²
    assert set(found.surface.terms) == true | ({"a:c"} if method == "aicc" else set())  # AICc is more lenient
    assert set(found.surface.terms).isdisjoint(found.dropped)
    assert found.surface.df == 20 - len(found.surface.terms)


def test_a_reduced_surface_is_the_fit_of_its_terms(ccd_runs, coding):
    reduced = reduce_surface(ccd_runs.coded, ccd_runs.force, coding.names).surface
    columns = [i for i, term in enumerate(term_names(coding.names)) if term in reduced.terms]
    beta, *_ = np.linalg.lstsq(term_columns(ccd_runs.coded)[:, columns], ccd_runs.force, rcond=None)
    assert reduced.beta[columns] == pytest.approx(beta)
    assert reduced.beta.size == 10 and np.count_nonzero(reduced.beta) == len(columns)
    assert reduced.predict([0.3, 0.2, -0.5]).shape == (1,)
    assert reduced.predicted_r2 > 0.92  # fewer terms predict no worse


def test_aicc_prefers_the_smaller_value_by_hand(ccd_runs, coding):
    found = reduce_surface(ccd_runs.coded, ccd_runs.force, coding.names, "aicc")
    n = 20

    def aicc(surface):
        q = len(surface.terms) + 1
        rss = sum(run.residual**2 for run in surface.runs_diagnostics)
        return n * np.log(rss / n) + 2 * q + 2 * q * (q + 1) / (n - q - 1)

    full = fit_surface(ccd_runs.coded, ccd_runs.force, coding.names)
    assert aicc(found.surface) == pytest.approx(found.steps[-1].measure)
    assert aicc(found.surface) < aicc(full)


def test_unknown_terms_and_methods_are_refused(ccd_runs, coding):
    with pytest.raises(UsageError, match=r"rsm\.reduce: no method 'best'"):
        reduce_surface(ccd_runs.coded, ccd_runs.force, coding.names, "best")
    with pytest.raises(UsageError, match="no term 'X4:X5'"):
        fit_surface(ccd_runs.coded, ccd_runs.force, coding.names, terms=["X4:X5"])


# ---- weights, blocks, terms


def test_a_weight_of_two_is_a_run_made_twice():
    random = np.random.default_rng(5)
    design = central_composite(2, 3)
    y = random.normal(100.0, 5.0, len(design))
    twice = np.arange(len(design)) < 4
    heavy = fit_surface(design, y, ["a", "b"], weights=np.where(twice, 2.0, 1.0))
    doubled = fit_surface(np.vstack([design, design[twice]]), np.concatenate([y, y[twice]]), ["a", "b"])
    assert heavy.beta == pytest.approx(doubled.beta)
    assert heavy.unscaled_covariance == pytest.approx(doubled.unscaled_covariance)


@pytest.mark.parametrize("weights", [[1.0] * 10, [0.0] * 11, [-1.0] * 11])
def test_senseless_weights_and_blocks_are_refused(weights):
    design = central_composite(2, 3)
    with pytest.raises(UsageError, match="positive numbers"):
        fit_surface(design, np.arange(11.0), ["a", "b"], weights=weights)
    with pytest.raises(UsageError, match="one per run"):
        fit_surface(design, np.arange(11.0), ["a", "b"], blocks=[1, 2])


def test_one_block_is_no_block(ccd_runs, coding, ccd):
    surface = fit_surface(ccd_runs.coded, ccd_runs.force, coding.names, blocks=["x"] * 20)
    assert surface.block_effects == {} and surface.anova == ccd.anova


# ---- Box–Cox


def test_box_cox_finds_the_logarithm_and_says_so():
    design = central_composite(2, 4)
    noise = np.random.default_rng(2).normal(0.0, 0.02, len(design))
    y = np.exp(3.0 + design[:, 0] + 0.5 * design[:, 1] + noise)
    found = box_cox(np.column_stack([np.ones(len(design)), design]), y)
    assert found.best == pytest.approx(0.0, abs=0.05) and found.low < 0.0 < found.high
    assert found.advised == 0.0


def test_box_cox_has_no_sense_for_some_responses():
    matrix = np.column_stack([np.ones(6), np.arange(6.0)])
    assert box_cox(matrix, np.array([1.0, 2.0, 3.0, 0.0, 5.0, 6.0])) is None
    assert box_cox(matrix, np.full(6, 2.0)) is None
    assert box_cox(np.eye(6), np.arange(1.0, 7.0)) is None
