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


def reduce_series(
    series: Series, reduction: str, at: float | None = None, over: Sequence[float] | None = None
) -> float:
    """Return the one number that `reduction` makes of a series.

    >>> reduce_series(Series([0.0, 3.0, 1.0], [0.0, 1.0, 2.0]), "work")
    3.5

    Raises
    ------
    NoResult
        If the series is empty, holds NaN, or does not reach where it is asked for.
    """
    y = _finite(series)
    if reduction in _ALONE:
        return float(_ALONE[reduction](y))
    return _along(_abscissa(series, y.size), y, reduction, at, over)


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


_ALONE: dict[str, Callable[[Array], float]] = {
    "max": np.max,
    "min": np.min,
    "first": lambda y: y[0],
    "last": lambda y: y[-1],
}
REDUCTIONS = (*_ALONE, "at", "mean_over", "work")


def _abscissa(series: Series, size: int) -> Array:
    x = np.asarray([] if series.x is None else series.x, dtype=float)
    if x.size != size:
        raise NoResult("bad_result", f"{size} numbers are plotted along {x.size}")
    if not (np.isfinite(x).all() and (np.diff(x) >= 0).all()):
        raise NoResult("bad_result", "what the numbers are plotted along does not rise")
    return x


def _along(x: Array, y: Array, reduction: str, at: float | None, over: Sequence[float] | None) -> float:
    if reduction == "work":
        return float(np.trapezoid(y, x))
    low, high = (over[0], over[1]) if over is not None else (at, at)
    if low is None or high is None or not x[0] <= low <= high <= x[-1]:
        raise NoResult("no_result", f"the result goes from {x[0]:g} to {x[-1]:g}, not where {reduction} needs it")
    if low == high:
        return float(np.interp(low, x, y))
    # mean = ∫ y dx / (high − low), the ends interpolated
    inside = (x > low) & (x < high)
    xs = np.concatenate([[low], x[inside], [high]])
    return float(np.trapezoid(np.interp(xs, x, y), xs)) / (high - low)


def required_number(text: str) -> float:
    """Return the number that a text is; raise `NoResult` if it is none."""
    if (number := number_of(text)) is None:
        raise NoResult("bad_result", f"{text[:40]!r} is not a number")
    return number
