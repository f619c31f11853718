"""Backward elimination of terms from a quadratic model, which stays hierarchical.

An interaction or square is kept only together with its linear terms. Then the model does not depend on the coding of
the factors. Source: J. L. Peixoto, The American Statistician 44 (1990), 26–30.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.coding import term_columns, term_names
from stemcal.doe.regression.least_squares import copies_of, f_test, fit_least_squares, not_estimable
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import UsageError
from stemcal.vocabulary import Wording


@dataclass(frozen=True)
class ReductionStep:
    """A removed term and the p-value of its F test."""

    term: str
    p: float


def reduce_surface(
    coded: ArrayLike, response: ArrayLike, names: Sequence[str], alpha: float = 0.1, written: Wording = Wording()
) -> tuple[Surface, tuple[ReductionStep, ...]]:
    """Fit the quadratic model and remove the least significant term as long as its p > alpha.

    Returns the reduced surface and the removed terms. Raises `UsageError` if the runs cannot estimate the full model.
    """
    points, y, chosen = np.asarray(coded, dtype=float), np.asarray(response, dtype=float), list(term_names(names))
    present = np.isfinite(y) & ~copies_of(points, y)
    columns = term_columns(points[present])
    if not_estimable(columns, chosen):
        raise UsageError(
            f"rsm.reduce: backward elimination starts from the full quadratic model, but its {columns.shape[1]} "
            f"coefficients cannot be estimated from {np.count_nonzero(present)} runs; add runs"
        )
    steps: list[ReductionStep] = []
    while removable := _removable(chosen):
        fit = fit_least_squares(columns, y[present])
        tests = [f_test(float(fit.partial_ss[i]), 1, fit.mean_square, fit.df) for i in removable]
        ps = [test[1] if test and not fit.exact else 0.0 for test in tests]
        weakest = int(np.argmax(ps))
        if ps[weakest] <= alpha:
            break
        place = removable[weakest]
        steps.append(ReductionStep(chosen.pop(place), ps[weakest]))
        columns = np.delete(columns, place, axis=1)
    return fit_surface(coded, response, names, chosen, written), tuple(steps)


def _removable(chosen: Sequence[str]) -> list[int]:
    needed = {"1"}.union(*(term.removesuffix("^2").split(":") for term in chosen if ":" in term or "^2" in term))
    return [i for i, term in enumerate(chosen) if term not in needed]
