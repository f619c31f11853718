"""Which runs only repeat others, and what one more run of a deterministic solver adds."""

import math

import numpy as np
import pytest

from stemcal.doe.designs import central_composite
from stemcal.doe.regression.least_squares import copies_of, t_quantile
from stemcal.doe.regression.surface import fit_surface, reduce_surface

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
