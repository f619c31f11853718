"""A surface over factors and conditions: its sections, their errors, bends, and left-out runs, by known answers."""

from collections.abc import Callable

import numpy as np
import pytest

from stemcal.arrays import Array
from stemcal.doe.calibration.observations import Contrasts
from stemcal.doe.coding import Coding, term_columns
from stemcal.doe.designs import axial_distance, central_composite
from stemcal.doe.regression.section import Bend, Place, Section, bend_of, fit_whole, left_out_percent
from stemcal.doe.regression.surface import fit_surface

MIDDLE, HALF, AT = np.log(77.0) / 2.0, np.log(11.0 / 7.0) / 2.0, 8.0
CODING = Coding(("yield_stress", "failure_strain", "growth"), (15.0, 0.03, 0.5), (5.0, 0.02, 0.75))
LAW = np.array([5.0, 0.4, 0.1, 0.45, 0.03, -0.02, 0.01, -0.05, 0.02, -0.01])  # of ln y in coded y_eff, ε, ln d


def diameter(coded: float) -> float:
    return float(np.exp(MIDDLE + HALF * coded))


def section(condition: float, logarithm: bool) -> Section:
    """Fit the law at a composite design; yield stress grows as (d/8)^growth."""
    points = central_composite(3, 1)
    values = term_columns(points) @ LAW
    whole = fit_whole(
        points, np.exp(values) if logarithm else values, ["yield_stress", "failure_strain", "d"], None, logarithm
    )
    growing = {0: (2, float(np.log(diameter(condition) / AT)))}
    return Section(whole, Place(CODING, condition, growing), logarithm)


@pytest.mark.parametrize("logarithm", [True, False])
@pytest.mark.parametrize("condition", [-1.0, 0.3, 1.0])
def test_a_section_is_the_law_at_a_condition(condition: float, logarithm: bool) -> None:
    """Growth acts through y·(d/8)^growth: at growth 1 it is the law at the yield stress with the same value at 0.5."""
    x = np.array([[0.2, -0.4, 2.0 / 3.0], [-0.5, 0.3, 0.0]])
    value = (15.0 + 5.0 * 0.2) * (diameter(condition) / AT) ** (1.0 - 0.5)
    z = np.array([[(value - 15.0) / 5.0, -0.4, condition], [-0.5, 0.3, condition]])
    expected = term_columns(z) @ LAW
    assert section(condition, logarithm).predict(x) == pytest.approx(np.exp(expected) if logarithm else expected)


@pytest.mark.parametrize("logarithm", [True, False])
def test_the_gradient_is_the_quotient_of_differences(logarithm: bool) -> None:
    here, x, step = section(0.7, logarithm), np.array([0.3, -0.2, 0.6]), 1e-6
    differences = [(here.predict(x + step * e)[0] - here.predict(x - step * e)[0]) / (2.0 * step) for e in np.eye(3)]
    assert here.gradient(x) == pytest.approx(differences, rel=1e-7)
    through = here.moved(x, 123.0)
    assert through.predict(x)[0] == pytest.approx(123.0)


@pytest.mark.parametrize("logarithm", [True, False])
def test_errors_at_two_conditions_are_correlated_by_the_runs_that_they_share(logarithm: bool) -> None:
    """ŷ(z) = φᵀ(XᵀX)⁻¹Xᵀy: of runs of variance σ² two predictions have the covariance σ² φ₁ᵀ(XᵀX)⁻¹φ₂."""
    random, points, x = np.random.default_rng(3), central_composite(3, 1), np.array([0.3, -0.2, 0.6])
    y = np.exp(term_columns(points) @ LAW + 0.02 * random.standard_normal(len(points)))
    whole = fit_whole(points, y, ["a", "b", "d"], None, logarithm)
    sections = [Section(whole, Place(CODING, d, {0: (2, 0.1 * d)}), logarithm) for d in (-1.0, 0.0, 1.0)]
    told = Contrasts.of(sections)
    phi = np.vstack([term_columns(s.place.z(x)) for s in sections])
    shared = phi @ np.linalg.inv(term_columns(points).T @ term_columns(points)) @ phi.T
    size = np.array([float(s.predict(x)[0]) for s in sections]) if logarithm else np.full(3, y.mean())
    found = told.covariance(x, np.zeros(1), np.array([0.01**2]), np.zeros((1, 3)))[0]
    assert found == pytest.approx(0.01**2 * (np.eye(3) + shared) * np.outer(size, size))
    assert told.counts.sum() == 5 and told.z2.sum() == pytest.approx(
        5 * whole.mean_square / (1.0 if logarithm else y.mean() ** 2)
    )
    fewer = told.only([0, 2]).covariance(x, np.zeros(1), np.array([0.01**2]), np.zeros((1, 2)))[0]
    assert fewer == pytest.approx(found[np.ix_([0, 2], [0, 2])])


def test_left_out_errors_are_those_of_fits_without_each_run() -> None:
    random = np.random.default_rng(5)
    points = random.uniform(-1.0, 1.0, (16, 3))
    y = np.exp(term_columns(points) @ LAW + 0.02 * random.standard_normal(16))
    for logarithm in (True, False):
        whole, missed = fit_whole(points, y, ["a", "b", "d"], None, logarithm), []
        for i, row in enumerate(whole.runs_diagnostics):
            if row.leverage < 0.9:
                rest = np.delete(np.arange(16), i)
                there = fit_surface(points[rest], np.log(y[rest]) if logarithm else y[rest], ["a", "b", "d"])
                predicted = float(there.predict(points[i])[0])
                missed.append(100.0 * (1.0 - (np.exp(predicted) if logarithm else predicted) / y[i]))
        assert len(missed) > 8
        assert left_out_percent(whole, logarithm) == pytest.approx(np.mean(np.square(missed)) ** 0.5)


# ---- bends

Law = Callable[[Array, float], float]


def power(random: np.random.Generator) -> Law:
    s, e, p = random.uniform(0.12, 0.3, 2), random.uniform([0.5, -0.5], [1.2, 0.5]), random.uniform(1.8, 2.6)
    return lambda x, d: float(100.0 * (d / 8.0) ** p * np.prod((1.0 + s * x) ** e))


def two_mechanisms(random: np.random.Generator) -> Law:
    s, share = random.uniform(0.12, 0.3, 2), random.uniform(0.3, 0.7)
    return lambda x, d: float(
        100.0
        * (share * (1.0 + s[0] * x[0]) * (d / 8.0) ** 2.4 + (1.0 - share) * (1.0 + s[1] * x[1]) * (d / 8.0) ** 1.6)
    )


def bend(law: Law, rough: float, random: np.random.Generator) -> Bend:
    points, reach = central_composite(3, 1), axial_distance(3)
    y = np.array([law(z[:2], diameter(z[2] / reach)) for z in points])
    y *= np.exp(rough * random.standard_normal(len(y)))
    found = bend_of(fit_whole(points, y, ["a", "b", "d"], None, True), True)
    assert found is not None
    return found


def kinked(smooth: Law, exponent: float) -> Law:
    """Return a law whose force rises with another exponent above 9 mm."""
    return lambda x, d: smooth(x, d) * max(d / 9.0, 1.0) ** exponent


@pytest.mark.parametrize("rough", [0.0, 0.004])
def test_a_kink_over_the_diameter_is_found_and_smooth_laws_are_not(rough: float) -> None:
    for study in range(20):
        random = np.random.default_rng([7, study])
        smooth, exponent = (power, two_mechanisms)[study % 2](random), random.uniform(1.0, 2.0)
        assert bend(kinked(smooth, exponent * random.choice([-1.0, 1.0])), rough, random).significant
        assert not bend(smooth, rough, random).significant
