"""Analysis of variance of a fitted quadratic: Model, terms, Residual, Lack of fit, Pure error, Cor total."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.copies import same_points
from stemcal.doe.regression.least_squares import NEGLIGIBLE, Array, LeastSquares, f_test, stars


@dataclass(frozen=True)
class AnovaRow:
    """One line of the table; f, p and the mean square are None where they have no value."""

    source: str
    sum_of_squares: float
    df: int
    mean_square: float | None
    f: float | None
    p: float | None
    stars: str


@dataclass(frozen=True)
class LackOfFit:
    """The residual split into what replicates scatter (pure error) and what the quadratic misses."""

    sum_of_squares: float
    df: int
    pure_sum_of_squares: float
    pure_df: int
    f: float | None
    p: float | None
    deterministic: bool

    @property
    def testable(self) -> bool:
        """Whether an F could be formed."""
        return self.f is not None


def lack_of_fit(coded: Array, fit: LeastSquares) -> LackOfFit:
    """Split the residual over exactly repeated design points.

    Identical replicates (pure-error SS ≤ 1e-12 of the total) mean a deterministic solver: no test.
    """
    group = same_points(coded)
    counts = np.bincount(group)
    means = np.bincount(group, weights=fit.response) / counts
    pure = float(np.sum((fit.response - means[group]) ** 2))
    pure_df = int(len(fit.response) - len(counts))
    deterministic = pure_df > 0 and pure <= NEGLIGIBLE * fit.total_ss
    pure = 0.0 if deterministic else pure
    df = fit.df - pure_df
    lof = max(fit.residual_ss - pure, 0.0) if df > 0 else 0.0
    test = f_test(lof / df, df, pure / pure_df, pure_df) if df > 0 and pure_df > 0 else None
    f, p = test if test else (None, None)
    return LackOfFit(lof, df, pure, pure_df, f, p, deterministic)


def anova_table(fit: LeastSquares, terms: Sequence[str], split: LackOfFit) -> tuple[AnovaRow, ...]:
    """Tabulate type III sums of squares of the coded columns against the residual."""
    error = None if fit.exact else fit.mean_square

    def tested(source: str, ss: float, df: int) -> AnovaRow:
        f, p = (f_test(ss / df, df, error, fit.df) or (None, None)) if df else (None, None)
        return AnovaRow(source, ss, df, ss / df if df else None, f, p, stars(p))

    def bare(source: str, ss: float, df: int) -> AnovaRow:
        return AnovaRow(source, ss, df, ss / df if df else None, None, None, "")

    lof = bare("Lack of fit", split.sum_of_squares, split.df)
    total = AnovaRow("Cor total", fit.total_ss, len(fit.response) - 1, None, None, None, "")
    partial = fit.partial_ss[1:]
    return (
        tested("Model", fit.total_ss - fit.residual_ss, len(terms) - 1),
        *(tested(term, float(ss), 1) for term, ss in zip(terms[1:], partial, strict=True)),
        bare("Residual", fit.residual_ss, fit.df),
        AnovaRow(lof.source, lof.sum_of_squares, lof.df, lof.mean_square, split.f, split.p, stars(split.p)),
        bare("Pure error", split.pure_sum_of_squares, split.pure_df),
        total,
    )
