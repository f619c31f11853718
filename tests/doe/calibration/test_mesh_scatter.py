"""The scatter of the mesh: its parts by the two-way layout, its place in the misfit, degrees of freedom, intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from stemcal.doe.calibration.mesh_scatter import MeshScatter, scatter_of, size_factors
from stemcal.doe.calibration.misfit import Misfit, Observation, misfit_of
from stemcal.doe.calibration.profile import allowed_rises
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.naming import FIRST

NONE = np.zeros((1, 0))


def test_one_diameter_is_the_variance_of_the_logarithms() -> None:
    forces = [102.0, 98.0, 101.0, 99.5]
    found = scatter_of([100.0], np.array([forces]), NONE)
    assert found.own == pytest.approx(np.var(np.log(forces), ddof=1), rel=1e-12)
    assert (found.common, found.df, found.placements) == (0.0, 3.0, 4)
    assert found.mean_factor == pytest.approx(stats.gmean(forces) / 100.0, rel=1e-12)
    assert found.over(4).variance == pytest.approx(found.variance / 4)


def test_parts_of_two_ways_are_those_of_the_anova() -> None:
    """Mean squares by statsmodels: place against residual, as in a randomised block design."""
    import pandas as pd
    from statsmodels.formula.api import ols
    from statsmodels.stats.anova import anova_lm

    random = np.random.default_rng(3)
    table = np.exp(5.0 + 0.02 * random.standard_normal((1, 6)) + 0.01 * random.standard_normal((4, 6)))
    found = scatter_of(np.ones(4), table, np.zeros((4, 0)))
    rows = [{"d": i, "m": j, "y": np.log(table[i, j])} for i in range(4) for j in range(6)]
    anova = anova_lm(ols("y ~ C(d) + C(m)", pd.DataFrame(rows)).fit())
    residual, place = anova.loc["Residual", "mean_sq"], anova.loc["C(m)", "mean_sq"]
    assert found.own == pytest.approx(residual, rel=1e-9)
    assert found.common == pytest.approx((place - residual) / 4, rel=1e-9)
    assert (found.own_df, found.common_df) == (15.0, 5.0)


def test_a_size_is_a_factor_and_no_scatter() -> None:
    own, placed = [100.0, 130.0], np.array([[101.0, 99.0], [131.3, 128.7]])
    sized = 0.95 * np.array([[100.0], [130.0]])
    scatter = scatter_of(own, placed, sized)
    assert scatter.own == pytest.approx(0.0, abs=1e-6) and scatter.common > 1e-5
    (size,) = size_factors(own, sized, ["d/24"], scatter)
    assert size.factor == pytest.approx(0.95) and size.element_size == "d/24"


def joint() -> Misfit:
    coded = central_composite(2, 3, "rotatable")
    surfaces = [
        fit_surface(coded, (d / 8) ** 2 * (150 + 12 * coded[:, 0] + 5 * coded[:, 1] * (d - 7)), ["a", "b"])
        for d in (7.0, 8.0, 9.0)
    ]
    measured = [118.0, 152.0, 190.0]
    return misfit_of([Observation(s, f, 0.03 * f, 6) for s, f in zip(surfaces, measured, strict=True)])


MESH = MeshScatter(1e-4, 20.0, 4e-4, 5.0, 1.0, 6)


def test_the_misfit_is_that_of_the_whole_covariance() -> None:
    misfit = joint().with_mesh(MESH, 0.0)
    points = np.random.default_rng(1).uniform(-1, 1, (5, 2))
    covariance = np.diag(misfit.variance) + 4e-4 * np.outer(misfit.measured, misfit.measured)
    gap = misfit.measured - misfit.predict(points)
    assert misfit.many(points) == pytest.approx(np.einsum("ij,jk,ik->i", gap, np.linalg.inv(covariance), gap))
    numeric = [(misfit.value(points[0] + h) - misfit.value(points[0] - h)) / 2e-6 for h in 1e-6 * np.eye(2)]
    assert misfit.gradient(points[0]) == pytest.approx(numeric, rel=1e-5)
    assert misfit.only([0, 2]).value(points[0]) < misfit.value(points[0]) + 1e-9


def with_travel() -> Misfit:
    """Two forces and two travels of the same diameters."""
    coded = central_composite(2, 3, "rotatable")
    forces = [
        fit_surface(coded, f * (1.0 + 0.1 * coded[:, 0] + 0.02 * coded[:, 1]), ["a", "b"]) for f in (100.0, 150.0)
    ]
    travels = [fit_surface(coded, u * (1.0 + 0.2 * coded[:, 1]), ["a", "b"]) for u in (1.0, 1.2)]
    observations = [
        Observation(surface, 1.03 * surface.beta[0], 0.03 * surface.beta[0], 6, kind)
        for kind, of in ((FIRST, forces), ("travel", travels))
        for surface in of
    ]
    return misfit_of(observations)


TRAVEL = MeshScatter(3e-4, 20.0, 9e-4, 5.0, 1.0, 6)


def test_force_and_travel_have_each_what_their_diameters_share() -> None:
    plain = with_travel()
    misfit = plain.with_mesh(MESH, 0.0, {"travel": TRAVEL})
    measured = plain.measured
    relative = np.diag([1e-4, 1e-4, 3e-4, 3e-4])
    relative[:2, :2] += 4e-4
    relative[2:, 2:] += 9e-4
    covariance = np.diag(plain.variance) + relative * np.outer(measured, measured)
    points = np.random.default_rng(1).uniform(-1, 1, (5, 2))
    gap = measured - misfit.predict(points)
    assert misfit.many(points) == pytest.approx(np.einsum("ij,jk,ik->i", gap, np.linalg.inv(covariance), gap))
    numeric = [(misfit.value(points[0] + h) - misfit.value(points[0] - h)) / 2e-6 for h in 1e-6 * np.eye(2)]
    assert misfit.gradient(points[0]) == pytest.approx(numeric, rel=1e-5)


def test_the_likelihood_of_known_variances_has_the_whole_covariance() -> None:
    plain = with_travel()
    force, travel = (replace(mesh, own_df=np.inf, common_df=np.inf) for mesh in (MESH, TRAVEL))
    misfit = plain.with_mesh(force, 0.0, {"travel": travel})
    misfit = replace(misfit.of_sources([replace(source, df=np.inf) for source in misfit.sources]), scale_df=np.inf)
    covariance = np.diag(misfit.variance) + misfit.shared.T @ misfit.shared
    assert np.count_nonzero(misfit.shared) == 4
    points = np.random.default_rng(2).uniform(-1, 1, (5, 2))
    found = misfit.log_likelihood(points)
    gap = misfit.measured - misfit.predict(points)
    known = stats.multivariate_normal(np.zeros(4), covariance, allow_singular=False).logpdf(gap)
    assert found - found[0] == pytest.approx(known - known[0], rel=1e-6)


def test_travel_of_few_places_is_told_by_few_degrees_of_freedom() -> None:
    """Factor b is told by the travel, and nearly all of the travel's variance is what its diameters share, of 5 df."""
    misfit = with_travel().with_mesh(MESH, 0.0, {"travel": replace(TRAVEL, own=1e-6, common=0.04)})
    _, freedom = misfit.freedom(np.zeros(2))
    assert 5.0 < freedom[1] < 5.5


def test_what_all_share_is_not_averaged_away() -> None:
    """Factor a is told by the level of the force, which the common part moves: few degrees of freedom. b by its growth:
    more. The intervals of both are wider than without the mesh."""
    plain, misfit = joint(), joint().with_mesh(MESH, 0.0)
    share, freedom = misfit.freedom(np.zeros(2))
    assert 5.0 < freedom[0] < freedom[1]
    rises = allowed_rises(misfit, np.zeros(2))
    assert rises == pytest.approx(share * stats.f.ppf(0.95, 1, freedom))
    assert misfit.value(np.ones(2)) < plain.value(np.ones(2))


def test_the_likelihood_of_one_source_is_students() -> None:
    """Nothing but the mesh is uncertain: Student's t."""
    coded = central_composite(1, 3, "rotatable")
    surface = fit_surface(coded, 100.0 + 5.0 * coded[:, 0] + coded[:, 0] ** 2, ["a"])
    misfit = misfit_of([Observation(surface, 101.0)]).with_mesh(MeshScatter(4e-4, 4.0, 0.0, 4.0, 1.0, 5), 0.0)
    points = np.array([[0.2], [0.6], [1.0]])
    found = misfit.log_likelihood(points)
    student = stats.t.logpdf(101.0 - misfit.predict(points)[:, 0], 4, scale=2.02)
    assert found - found[0] == pytest.approx(student - student[0], rel=1e-6)


def test_a_scatter_told_by_the_misfit_gets_the_common_part_alone() -> None:
    observations = [Observation(o.surface, o.measured) for o in joint().observations]
    misfit = misfit_of(observations)
    assert misfit.scatter == "misfit"
    meshed = misfit.with_mesh(MESH, 3e-4)
    assert [source.name for source in meshed.sources] == ["misfit", "mesh, all alike"]
    assert meshed.scale_known and len(meshed.shared) == 1


def test_the_interval_of_another_mesh_is_that_of_one_more_value() -> None:
    mesh = MeshScatter(1e-4, 4.0, 0.0, 4.0, 0.99, 5)
    low, high = mesh.interval(100.0)
    reach = stats.t.ppf(0.975, 4) * 0.01 * 99.0 * (1 + 1 / 5) ** 0.5
    assert (low, high) == pytest.approx((99.0 - reach, 99.0 + reach))
