import numpy as np
import pytest

from stemcal.doe.coding import Coding, term_columns, term_names
from stemcal.doe.designs import SurfaceOptions, central_composite, surface_runs
from stemcal.doe.regression.canonical import canonical_analysis
from stemcal.doe.regression.surface import fit_surface, reduce_surface
from stemcal.errors import UsageError

ABC = ["a", "b", "c"]


def surface_with(beta, k=3):
    names = [f"f{i}" for i in range(k)]
    design = central_composite(k, 4)
    return fit_surface(design, term_columns(design) @ beta, names)


# ---- canonical analysis


def shape_of(beta, k):
    surface = surface_with(beta, k)
    return canonical_analysis(surface, Coding(surface.names, (10.0,) * k, (2.0,) * k))


def test_stationary_point_of_a_known_surface():
    """10 − (x − 0.5)² − 2(y + 0.25)² has its maximum 10 at (0.5, −0.25), with curvatures −1 and −2."""
    shape = shape_of(np.array([10.0 - 0.25 - 0.125, 1.0, -1.0, 0.0, -1.0, -2.0]), 2)
    assert list(shape.coded.values()) == pytest.approx([0.5, -0.25])
    assert list(shape.natural.values()) == pytest.approx([11.0, 9.5])
    assert shape.predicted == pytest.approx(10.0)
    assert list(shape.eigenvalues) == pytest.approx([-1.0, -2.0])
    assert (shape.kind, shape.inside) == ("maximum", True)
    assert shape.coded_radius == pytest.approx(0.559, abs=5e-4) and not shape.ridge


def test_along_its_axes_a_surface_has_no_products():
    """ŷ(x_s + c·axis) = ŷ_s + λ·c² along each axis, products included."""
    beta = np.random.default_rng(1).normal(size=10)
    surface, shape = surface_with(beta), shape_of(beta, 3)
    point = np.array(list(shape.coded.values()))
    for value, axis in zip(shape.eigenvalues, shape.axes, strict=True):
        there = point + 0.7 * np.array(list(axis.values()))
        assert float(surface.predict(there)[0]) == pytest.approx(shape.predicted + 0.49 * value)


def test_planes_and_ridges_have_no_single_stationary_point():
    plane = shape_of(np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]), 2)
    assert plane.coded is None and plane.kind == "plane"
    ridge = shape_of(np.array([1.0, 0.0, 0.0, 0.0, -2.0, -0.05]), 2)
    assert (ridge.kind, ridge.ridge) == ("maximum", True)


# ---- reduction


def test_reduction_finds_the_true_terms_and_keeps_hierarchy():
    design = surface_runs(3, SurfaceOptions())
    noise = np.random.default_rng(3).normal(0.0, 0.5, len(design))
    y = 50.0 + 8.0 * design[:, 0] + 4.0 * design[:, 0] * design[:, 1] - 5.0 * design[:, 2] ** 2 + noise
    surface, steps = reduce_surface(design, y, ABC, 0.01)
    assert set(surface.terms) == {"1", "a", "b", "c", "a:b", "c^2"}  # b and c stay for a:b and c²
    assert {step.term for step in steps} == {"a:c", "b:c", "a^2", "b^2"} and all(step.p > 0.01 for step in steps)
    assert surface.df == 20 - len(surface.terms)


def test_a_reduced_surface_is_the_fit_of_its_terms(ccd_runs, coding):
    reduced = reduce_surface(ccd_runs.coded, ccd_runs.force, coding.names)[0]
    columns = [i for i, term in enumerate(term_names(coding.names)) if term in reduced.terms]
    beta, *_ = np.linalg.lstsq(term_columns(ccd_runs.coded)[:, columns], ccd_runs.force, rcond=None)
    assert reduced.beta[columns] == pytest.approx(beta)
    assert reduced.beta.size == 10 and np.count_nonzero(reduced.beta) == len(columns)
    assert reduced.predict([0.3, 0.2, -0.5]).shape == (1,)
    assert reduced.predicted_r2 > 0.92  # fewer terms predict no worse


def test_unknown_terms_are_refused(ccd_runs, coding):
    with pytest.raises(UsageError, match="unknown term 'X4:X5'"):
        fit_surface(ccd_runs.coded, ccd_runs.force, coding.names, terms=["X4:X5"])
