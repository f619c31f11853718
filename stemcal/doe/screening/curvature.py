"""Is the response curved within the ranges? Centre points beside a two-level design tell.

A plane has the same value at the centre as the corners have on average. The difference, with n_F corner runs and n_C
centre runs, has the sum of squares n_F·n_C·(ȳ_F − ȳ_C)²/(n_F + n_C) with one degree of freedom. Source: D. C.
Montgomery, Design and Analysis of Experiments, 8th ed., section 6.8. Centre runs that agree exactly are one run.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.regression.least_squares import NEGLIGIBLE, Array, f_test
from stemcal.doe.screening.error_term import ErrorTerm


@dataclass(frozen=True)
class Curvature:
    """Mean of the corners, mean of so many centre runs, what they differ by (corners − centre), and its test.

    `df` are the degrees of freedom of the error; `curved` tells whether p is below the level of significance.
    """

    corners: float
    centre: float
    runs: int
    difference: float
    sum_of_squares: float
    f: float | None
    p: float | None
    df: int
    curved: bool


def centre_runs(design: Array) -> NDArray[np.bool_]:
    """Return which runs of a two-level design are its centre points, (n,); none in any other design."""
    centre = ~np.any(design, axis=1)
    two_level = bool(np.all(np.abs(design[~centre]) == 1.0))
    return np.asarray(centre if two_level and not centre.all() else np.zeros(len(design), dtype=bool))


def with_centre(error: ErrorTerm, centre: Array) -> ErrorTerm:
    """Return the error term with the scatter of the centre runs in it; without it where they agree."""
    pure = _pure(centre)
    if error.source == "lenth" or not pure:
        return error
    if error.exact or not error.df:
        return replace(error, sum_of_squares=pure, df=len(centre) - 1, centre_df=len(centre) - 1, exact=False)
    total, df = error.sum_of_squares + pure, error.df + len(centre) - 1
    return replace(error, sum_of_squares=total, df=df, centre_df=len(centre) - 1)


def curvature_of(corners: Array, centre: Array, error: ErrorTerm, alpha: float) -> Curvature | None:
    """Return how far the centre lies off the plane of the corners; None without centre runs."""
    if not len(centre):
        return None
    n_f, n_c = len(corners), len(centre) if _pure(centre) else 1
    high, middle = float(corners.mean()), float(centre.mean())
    square = n_f * n_c * (high - middle) ** 2 / (n_f + n_c)
    test = f_test(square, 1, error.mean_square, error.df)
    f, p = test if test else (None, None)
    return Curvature(high, middle, n_c, high - middle, square, f, p, error.df, p is not None and p < alpha)


def _pure(centre: Array) -> float:
    """Return the scatter of centre runs; 0 where they agree but for rounding."""
    pure = float(np.sum((centre - centre.mean()) ** 2)) if len(centre) > 1 else 0.0
    return pure if pure > NEGLIGIBLE * float(centre @ centre) else 0.0
