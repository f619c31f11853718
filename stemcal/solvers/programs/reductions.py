"""From a series of numbers to one: the reductions by name."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stemcal.solvers.fortran import number_of

Array = NDArray[np.float64]


class NoResult(Exception):
    """A result that is missing or wrong: one word for tables, a sentence for people."""

    def __init__(self, reason: str, message: str) -> None:
        self.reason = reason
        super().__init__(message)

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        return type(self), (self.reason, str(self))


class Series(NamedTuple):
    """Numbers, and what they are plotted along if that is known."""

    y: Sequence[float]
    x: Sequence[float] | None = None


def reduce_series(series: Series, reduction: str) -> float:
    """Return the one number that `reduction` makes of a series.

    >>> reduce_series(Series([0.0, 3.0, 1.0]), "max")
    3.0

    Raises
    ------
    NoResult
        If the series is empty or contains NaN.
    """
    return float(REDUCTIONS[reduction](_finite(series)))


def plotted(series: Series) -> tuple[Array, Array]:
    """Return what a series is plotted along, and its numbers; raise `NoResult` as `reduce_series` does."""
    y = _finite(series)
    return _abscissa(series, y.size), y


def _finite(series: Series) -> Array:
    y = np.asarray(series.y, dtype=float)
    if y.size == 0:
        raise NoResult("no_result", "the result holds no numbers")
    if not np.isfinite(y).all():
        raise NoResult("nan", f"number {int(np.argmin(np.isfinite(y))) + 1} of {y.size} is {y[~np.isfinite(y)][0]:g}")
    return y


REDUCTIONS: dict[str, Callable[[Array], float]] = {
    "max": np.max,
    "min": np.min,
    "first": lambda y: y[0],
    "last": lambda y: y[-1],
}


def _abscissa(series: Series, size: int) -> Array:
    x = np.asarray([] if series.x is None else series.x, dtype=float)
    if x.size != size:
        raise NoResult("bad_result", f"the curve has {size} numbers and {x.size} values of the travel")
    if not (np.isfinite(x).all() and (np.diff(x) >= 0).all()):
        raise NoResult("bad_result", "the travel of the curve does not rise")
    return x


def required_number(text: str) -> float:
    """Return the number that a text is; raise `NoResult` if it is none."""
    if (number := number_of(text)) is None:
        raise NoResult("bad_result", f"{text[:40]!r} is not a number")
    return number
