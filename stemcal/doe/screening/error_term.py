"""What effects are tested against when a screening has next to no replication."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.anova import lack_of_fit
from stemcal.doe.regression.least_squares import NEGLIGIBLE, Array, LeastSquares
from stemcal.doe.screening.lenth import Lenth
from stemcal.doe.screening.two_stage_analysis import Mirrored
from stemcal.errors import UsageError


@dataclass(frozen=True)
class ErrorTerm:
    """A sum of squares that effects are tested against; `mean_square` is None where there is none to test against.

    `centre_df` of its degrees of freedom come from repeated centre runs.
    """

    source: str
    sum_of_squares: float
    df: int
    pooled: tuple[int, ...] = ()
    exact: bool = False
    centre_df: int = 0

    @property
    def scatter(self) -> bool:
        """Whether it shows how repeated runs differ; columns without a factor hold what aliased interactions leave."""
        return (self.source == "replicates" or self.centre_df > 0) and self.mean_square is not None

    @property
    def mean_square(self) -> float | None:
        """Sum of squares per degree of freedom."""
        return self.sum_of_squares / self.df if self.df and not self.exact else None


def choose_error(source: str, design: Array, fit: LeastSquares, changes: Array, size: Lenth) -> ErrorTerm:
    """Return the error term called `source`, one of `ERROR_TERMS`."""
    if source not in ERROR_TERMS:
        raise UsageError(f"screen.error: no error term {source!r}; choose one of {', '.join(ERROR_TERMS)}")
    return ERROR_TERMS[source](design, fit, changes, size)


def _residual(design: Array, fit: LeastSquares, _changes: Array, _size: Lenth) -> ErrorTerm:
    """Take the columns that carry no factor; in a definitive screening squares and interactions are none of them."""
    pairs = Mirrored.of(design, fit.response)
    if pairs is None:
        return ErrorTerm("residual", fit.residual_ss, fit.df, exact=fit.exact)
    total, df = pairs.error
    return ErrorTerm("residual", total, df, exact=total <= NEGLIGIBLE * pairs.size)


def _pooled(_design: Array, fit: LeastSquares, changes: Array, size: Lenth) -> ErrorTerm:
    """Take these and the effects within Lenth's margin of error."""
    small = [] if size.me is None else np.flatnonzero(np.abs(changes) <= size.me).tolist()
    total = fit.residual_ss + float(fit.partial_ss[1:][small].sum())
    return ErrorTerm("pooled", total, fit.df + len(small), tuple(small), total <= 1e-12 * fit.total_ss)


def _replicates(design: Array, fit: LeastSquares, _changes: Array, _size: Lenth) -> ErrorTerm:
    """Take the scatter of repeated runs."""
    split = lack_of_fit(design, fit)
    return ErrorTerm("replicates", split.pure_sum_of_squares, split.pure_df, exact=split.deterministic)


def _lenth(_design: Array, _fit: LeastSquares, _changes: Array, _size: Lenth) -> ErrorTerm:
    """Take none: the effects themselves show the noise (see `lenth`)."""
    return ErrorTerm("lenth", 0.0, 0)


ERROR_TERMS: dict[str, Callable[[Array, LeastSquares, Array, Lenth], ErrorTerm]] = {
    "residual": _residual,
    "pooled": _pooled,
    "replicates": _replicates,
    "lenth": _lenth,
}
