"""Coarse runs corrected by a few fine ones: fine forces that are known functions of the coarse, intervals that hold."""

from __future__ import annotations

import numpy as np
import pytest

from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.fidelity import corrected, correction_of, spread_runs
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.doe.regression.terms import term_columns
from stemcal.errors import RunsFailed

CODED = central_composite(2, 1, "rotatable")
COARSE = np.array([120.0, 20.0, 8.0, -3.0, 2.0, 1.5])
"""1, a, b, ab, a², b²."""


def made(coarse: Array, fine: Array, count: int, design: Array = CODED) -> Surface:
    surface, rows = fit_surface(design, coarse, ["a", "b"]), spread_runs(design, count)
    return corrected(surface, correction_of(surface, design[rows], coarse[rows], fine[rows], "rsm.correct_runs"))


def test_a_factor_and_a_tilt_are_found_exactly() -> None:
    """Fine = 0.9·coarse + 3a − 2b, from five fine runs of nine."""
    coarse = term_columns(CODED) @ COARSE
    found = made(coarse, 0.9 * coarse + CODED @ [3.0, -2.0], 5)
    assert found.beta == pytest.approx(0.9 * COARSE + [0.0, 3.0, -2.0, 0.0, 0.0, 0.0])
    assert [c.value for c in found.coefficients] == pytest.approx(found.beta)
    assert found.mean_square == pytest.approx(0.0, abs=1e-18)


def test_few_fine_runs_give_a_factor_alone() -> None:
    """Three points: least squares through the origin, ρ = Σ coarse·fine/Σ coarse²."""
    coarse = term_columns(CODED) @ COARSE
    fine, rows = 0.9 * coarse + CODED @ [3.0, -2.0], spread_runs(CODED, 3)
    ratio = float(coarse[rows] @ fine[rows] / (coarse[rows] @ coarse[rows]))
    assert made(coarse, fine, 3).beta == pytest.approx(ratio * COARSE)


def test_the_mean_has_what_an_unfitted_tilt_may_be() -> None:
    """Exact coarse runs, three fine ones: both intervals are ŷ ± t(2)·s_ε·√(1 + z(ZᵀZ)⁻¹z), Z the coarse responses."""
    coarse = term_columns(CODED) @ COARSE
    fine, rows = 0.9 * coarse + CODED @ [3.0, -2.0], spread_runs(CODED, 3)
    found, point = made(coarse, fine, 3), np.array([0.4, -0.7])
    left = fine[rows] - coarse[rows] * float(coarse[rows] @ fine[rows] / (coarse[rows] @ coarse[rows]))
    at = float(term_columns(point)[0] @ COARSE)
    spread = (left @ left / 2.0 * (1.0 + at**2 / float(coarse[rows] @ coarse[rows]))) ** 0.5
    for low, high in (found.mean_interval(point)[0], found.prediction_interval(point)[0]):
        assert (high - low) / 2.0 == pytest.approx(4.302653 * spread, rel=1e-6)


def test_coefficients_and_errors_are_those_of_the_sum_of_both_parts() -> None:
    """The variance at a point by numpy: ρ²s²h of the coarse surface and that of the regression of the fine runs."""
    random = np.random.default_rng(2)
    design = central_composite(2, 3, "rotatable")
    coarse = term_columns(design) @ COARSE + random.standard_normal(len(design))
    fine = 0.9 * coarse + design @ [3.0, -2.0] + 0.5 * random.standard_normal(len(design))
    surface, rows = fit_surface(design, coarse, ["a", "b"]), spread_runs(design, 7)
    found = made(coarse, fine, 7, design)
    z = np.column_stack([coarse[rows], design[rows]])
    slopes, left, *_ = np.linalg.lstsq(z, fine[rows], rcond=None)
    point = np.array([0.4, -0.7])
    at = np.array([surface.predict(point)[0], *point])
    of_both = slopes[0] ** 2 * surface.standard_error(point)[0] ** 2 + left[0] / 4 * at @ np.linalg.inv(z.T @ z) @ at
    assert found.standard_error(point)[0] ** 2 == pytest.approx(of_both)
    assert found.predict(point)[0] == pytest.approx(slopes @ at)
    assert surface.mean_square is not None
    assert found.mean_square == pytest.approx(slopes[0] ** 2 * surface.mean_square + left[0] / 4)
    assert found.df <= surface.df + 4


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 5, 7])
def test_a_further_fine_run_lies_within_its_interval(count: int) -> None:
    """1000 studies: coarse runs 1 N off their quadratic, fine 0.9 times that and 0.7 N off: 93 to 98 % are held."""
    random, held = np.random.default_rng(count), 0
    design = central_composite(2, 3, "rotatable")
    for _ in range(1000):
        point = random.uniform(-1.0, 1.0, 2)
        places = np.vstack([design, point])
        coarse = term_columns(places) @ COARSE + random.standard_normal(len(places))
        fine = 0.9 * coarse + 0.7 * random.standard_normal(len(places))
        low, high = made(coarse[:-1], fine[:-1], count, design).prediction_interval(point)[0]
        held += low <= fine[-1] <= high
    assert 0.93 < held / 1000 < 0.98


def test_runs_that_failed_are_left_out_and_two_are_too_few() -> None:
    coarse = term_columns(CODED) @ COARSE
    fine = 0.9 * coarse
    rows = spread_runs(CODED, 4)
    fine[rows[1]] = np.nan
    assert made(coarse, fine, 4).beta == pytest.approx(0.9 * COARSE)
    fine[rows[2]] = np.nan
    with pytest.raises(RunsFailed, match=r"^rsm\.correct_runs: of 4 points 2 succeeded .* or raise rsm\.correct_runs$"):
        made(coarse, fine, 4)


def test_fine_runs_lie_apart() -> None:
    chosen = CODED[spread_runs(CODED, 5)]
    assert np.linalg.norm(chosen[0]) == 0.0
    apart = [np.linalg.norm(a - b) for i, a in enumerate(chosen) for b in chosen[:i]]
    assert min(apart) == pytest.approx(2**0.5)
