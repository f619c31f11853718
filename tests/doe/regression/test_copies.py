"""Which runs only repeat others, and what the mean response may be off by."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.copies import copies_of
from stemcal.doe.regression.least_squares import t_quantile
from stemcal.doe.regression.reduction import reduce_surface
from stemcal.doe.regression.surface import fit_surface

POINTS = np.array([[0.0], [1.0], [0.0], [1.0], [-1.0]])


@pytest.mark.parametrize(
    ("response", "copies"),
    [
        ([5.0, 7.0, 5.0, 7.0, 2.0], [2, 3]),
        ([5.0, 7.0, 5.1, 7.0, 2.0], []),  # two centre runs differ: equal ones say something too
        ([np.nan, 7.0, 5.0, 7.0, 2.0], [3]),
        ([np.nan] * 5, []),
    ],
)
def test_copies_repeat_point_and_answer(response, copies) -> None:
    assert np.flatnonzero(copies_of(POINTS, np.array(response))).tolist() == copies


def test_reduction_chooses_terms_by_distinct_runs() -> None:
    """With six copies of the centre the p of a term is another; with or without them the same terms must stay."""
    random = np.random.default_rng(8)
    once, many = (central_composite(2, n, "rotatable") for n in (1, 6))
    y = 100.0 + once @ [10.0, 3.0] + random.normal(0.0, 2.0, len(once))
    copied = np.append(y, np.full(5, y[-1]))
    steps = [reduce_surface(design, r, ["a", "b"], 0.05)[1] for design, r in ((once, y), (many, copied))]
    assert [step.term for step in steps[0]] == [step.term for step in steps[1]]
    assert [step.p for step in steps[0]] == pytest.approx([step.p for step in steps[1]])


def test_the_mean_of_a_deterministic_surface_is_off_by_what_it_misses() -> None:
    """s²·(1 + h): all of the residual is what the quadratic misses."""
    design = central_composite(2, 6, "face")
    response = 100.0 + design @ [10.0, 3.0] + 4.0 * design[:, 0] ** 2 * design[:, 1]
    surface = fit_surface(design, response, ["a", "b"])
    point = np.array([[0.5, 0.5]])
    s2, h = surface.mean_square, float(surface.unscaled_variance(point)[0])
    assert s2 is not None and surface.df == 3
    assert surface.mean_variance(point) == pytest.approx(s2 * (1.0 + h))


@pytest.mark.parametrize("replicates", [2, 10])
def test_replicates_without_lack_of_fit_sharpen_the_mean(replicates: int) -> None:
    """s²·h, and h falls as 1/r: of nine points r times over the trace of h stays 6."""
    design = np.repeat(central_composite(2, 1, "face"), replicates, axis=0)
    noise = np.random.default_rng(4).normal(0.0, 1.0, len(design))
    surface = fit_surface(design, 100.0 + design @ [10.0, 3.0] + noise, ["a", "b"])
    lack = next(row for row in surface.anova if row.source == "Lack of fit")
    assert lack.p is not None and lack.p > 0.25
    assert float(np.mean(surface.mean_variance(design))) == pytest.approx(
        (surface.mean_square or 0.0) * 6 / len(design)
    )


def test_a_lack_of_fit_stays_however_often_runs_are_repeated() -> None:
    """σ_L² = (MS_L − MS_E)/r with r = 10 at every point, whose terms are told by MS_L; 3 df."""
    design = np.repeat(central_composite(2, 1, "face"), 10, axis=0)
    noise = np.random.default_rng(2).normal(0.0, 1.0, len(design))
    response = 100.0 + design @ [10.0, 3.0] + 4.0 * design[:, 0] ** 2 * design[:, 1] + noise
    surface = fit_surface(design, response, ["a", "b"])
    rows = {row.source: row for row in surface.anova}
    lack, pure = rows["Lack of fit"].mean_square, rows["Pure error"].mean_square
    error = surface.mean_error
    assert lack is not None and pure is not None and error is not None
    assert (error.of_terms, error.df) == (lack, 3)
    assert error.missed == pytest.approx((lack - pure) / 10.0)


@pytest.mark.parametrize(
    ("centre_points", "bent", "scatter", "own"),
    [
        (6, 0.0, 0.0, 0.0),
        (6, 4.0, 0.0, math.erf((32 / 27) ** 0.5) - (128 / 27 / math.pi) ** 0.5 * math.exp(-32 / 27)),
        (6, 12.0, 0.0, math.erf((32 / 3) ** 0.5) - (128 / 3 / math.pi) ** 0.5 * math.exp(-32 / 3)),
        (1, 4.0, 0.0, 1.0),
        (6, 4.0, 0.5, 1.0),
    ],
    ids=["a quadratic", "2.7 % rough", "8 % rough", "no copies", "scatter"],
)
def test_one_more_run_of_a_smooth_deterministic_solver_is_the_response_itself(
    centre_points: int, bent: float, scatter: float, own: float
) -> None:
    """t·s·√(own + h); of equal copies own is the chance that the response is rough by more than 3 % of the mean.

    Of x₁²x₂ on nine points the residual s is 2/3 with 3 df; P(χ²(3) < x) = erf √(x/2) − √(2x/π)·exp(−x/2).
    """
    design, point = central_composite(2, centre_points, "face"), np.array([[0.5, 0.5]])
    response = 100.0 + design @ [10.0, 3.0] + bent * design[:, 0] ** 2 * design[:, 1]
    surface = fit_surface(design, response + scatter * np.sin(np.arange(len(design))), ["a", "b"])
    s2, h = surface.mean_square or 0.0, float(surface.unscaled_variance(point)[0])
    middle, t = surface.predict(point)[0], t_quantile(0.95, surface.df)
    assert surface.mean_interval(point)[0, 1] == pytest.approx(middle + t * (s2 * h) ** 0.5)
    assert surface.prediction_interval(point)[0, 1] == pytest.approx(middle + t * (s2 * (own + h)) ** 0.5)
