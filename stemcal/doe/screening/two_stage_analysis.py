"""Definitive screening in two stages: main effects first, then squares and interactions of those that matter.

Every run but the centre has its mirror image. Half the difference of a pair holds main effects alone, half its sum
second-order effects alone, so the two are judged apart:

1. main effects against the columns that carry no factor ("fake" factors) and repeated centre runs; without either,
   against the effects within Lenth's margin. What does not matter joins the error.
2. squares and interactions of factors that matter (heredity): the smallest set of terms that leaves no more than the
   error of the first stage explains (p > 0.2), among equally many the one that leaves least.

Source: B. Jones and C. J. Nachtsheim, Effective Design-Based Model Selection for Definitive Screening Designs,
Technometrics 59 (2017), 319–329.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, combinations_with_replacement
from math import comb

import numpy as np

from stemcal.doe.regression.least_squares import NEGLIGIBLE, Array, f_test, fit_least_squares
from stemcal.doe.screening.lenth import lenth

# A main effect matters below this p where its error has one or two degrees of freedom; beyond, below the level asked.
_THRESHOLDS = {1: 0.2, 2: 0.1}
_EXPLAINED = 0.2
_MOST_SUBSETS = 20_000
Pairings = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class ErrorSource:
    """What an error is made of: columns without a factor, repeated centre runs; neither: effects within Lenth's margin.

    Effects of the first stage that do not matter join it in any case.
    """

    fake_columns: int = 0
    centre_runs: int = 0

    @property
    def lenth(self) -> bool:
        """Whether it comes from the effects alone."""
        return not (self.fake_columns or self.centre_runs)


@dataclass(frozen=True)
class FirstStage:
    """Which factors matter, and the error of one run that both stages test against."""

    active: tuple[str, ...]
    mean_square: float
    df: int
    source: ErrorSource


@dataclass(frozen=True)
class Term:
    """A term of the model that the two stages come to, response per coded unit (squared), with its test."""

    term: str
    coefficient: float
    standard_error: float | None
    p: float | None


@dataclass(frozen=True)
class TwoStages:
    """The outcome of a definitive screening: the terms besides the mean, squares and interactions among them.

    `equals` counts other sets of as many squares and interactions that the error of the first stage explains too.
    """

    first: FirstStage
    second_order: tuple[str, ...]
    equals: int
    terms: tuple[Term, ...]


@dataclass(frozen=True, eq=False)
class Mirrored:
    """A definitive screening in pairs: one run of each, half differences and half sums, and the centre runs."""

    plus: Array
    odd: Array
    even: Array
    centre: Array

    @classmethod
    def of(cls, design: Array, y: Array) -> Mirrored | None:
        """Pair the runs; None unless all but the centre runs have a mirror image and a level at 0."""
        rows = {tuple(row): i for i, row in enumerate((np.round(design, 6) + 0.0).tolist())}
        centre = ~np.any(design, axis=1)
        if not centre.any() or len(rows) != len(design) - centre.sum() + 1 or not np.all(np.isin(design, (-1, 0, 1))):
            return None
        mirrored = {i: rows.get(tuple(0.0 - value for value in row)) for row, i in rows.items() if any(row)}
        if None in mirrored.values() or not np.any(design[~centre] == 0.0):
            return None
        plus, minus = map(list, zip(*((i, j) for i, j in mirrored.items() if j is not None and i < j), strict=True))
        return cls(design[plus], 0.5 * (y[plus] - y[minus]), 0.5 * (y[plus] + y[minus]), y[centre])

    @cached_property
    def main_effects(self) -> Array:
        """Coefficients of the factors."""
        return np.asarray(np.linalg.lstsq(self.plus, self.odd, rcond=None)[0])

    @property
    def gained(self) -> Array:
        """Sum of squares of each factor; half a difference has half the variance of a run."""
        return np.asarray(2.0 * self.main_effects**2 / np.diag(np.linalg.inv(self.plus.T @ self.plus)))

    @property
    def fakes(self) -> tuple[float, int]:
        """Sum of squares and number of the columns without a factor."""
        left = self.odd - self.plus @ self.main_effects
        return 2.0 * float(left @ left), self.plus.shape[0] - self.plus.shape[1]

    @property
    def repeats(self) -> tuple[float, int]:
        """Sum of squares and degrees of freedom of repeated centre runs; none where they agree but for rounding."""
        pure = float(np.sum((self.centre - self.centre.mean()) ** 2))
        return (pure, len(self.centre) - 1) if pure > NEGLIGIBLE * self.size else (0.0, 0)

    @property
    def error(self) -> tuple[float, int]:
        """Sum of squares and degrees of freedom that no effect of first or second order is in."""
        (a, m), (b, n) = self.fakes, self.repeats
        return a + b, m + n

    @property
    def size(self) -> float:
        """What sums of squares are small against."""
        return 2.0 * float(self.odd @ self.odd) + float(np.sum((self.even - self.even.mean()) ** 2))

    @property
    def source(self) -> ErrorSource:
        """What the error is made of."""
        repeated = self.repeats[1]
        return ErrorSource(self.fakes[1], repeated + 1 if repeated else 0)


def two_stages(design: Array, y: Array, names: Sequence[str], alpha: float = 0.05) -> TwoStages | None:
    """Analyse a definitive screening; None where the runs are not those of one, or leave no error.

    Parameters
    ----------
    design : array (n, k)
        Levels −1, 0, +1; runs that failed are left out.
    """
    pairs = Mirrored.of(design, y)
    first = None if pairs is None else _first_stage(pairs, names, alpha)
    if pairs is None or first is None:
        return None
    active = [names.index(name) for name in first.active]
    chosen, equals = _second_stage(pairs, active, first)
    second = tuple(f"{names[i]}^2" if i == j else f"{names[i]}:{names[j]}" for i, j in chosen)
    columns = np.column_stack([np.ones(len(y)), design[:, active], *(design[:, i] * design[:, j] for i, j in chosen)])
    terms = _terms(columns, y, [*first.active, *second])
    return TwoStages(first, second, equals, terms)


def _first_stage(pairs: Mirrored, names: Sequence[str], alpha: float) -> FirstStage | None:
    effects, gained = 2.0 * pairs.main_effects, pairs.gained
    (error, df), source = pairs.error, pairs.source
    if df:
        tests = [f_test(float(ss), 1, error / df, df) for ss in gained]
        active = [test is not None and test[1] < _THRESHOLDS.get(df, alpha) for test in tests]
    elif (margin := lenth(effects, alpha).me) is not None:
        active, source = (np.abs(effects) > margin).tolist(), ErrorSource()
    else:
        return None
    idle = np.flatnonzero(~np.array(active))
    df, error = df + len(idle), error + float(gained[idle].sum())
    if not df or error <= NEGLIGIBLE * pairs.size:
        return None
    kept = tuple(name for name, matters in zip(names, active, strict=True) if matters)
    return FirstStage(kept, error / df, df, source)


def _second_stage(pairs: Mirrored, active: Sequence[int], first: FirstStage) -> tuple[Pairings, int]:
    """Return the squares (i, i) and interactions (i, j) that are needed, and how many other sets would do."""
    weights = np.sqrt(np.array([2.0] * len(pairs.even) + [float(len(pairs.centre))]))
    y = weights * np.append(pairs.even, pairs.centre.mean())
    candidates = list(combinations_with_replacement(active, 2))
    columns = {(i, j): weights * np.append(pairs.plus[:, i] * pairs.plus[:, j], 0.0) for i, j in candidates}
    chosen: Pairings = ()
    equals = 0
    for size in range(min(len(candidates), len(pairs.even) - 1) + 1):
        df = len(pairs.even) - size
        left = {way: _left(y, weights, [columns[c] for c in way]) for way in _subsets(candidates, size, chosen)}
        left = {way: value for way, value in left.items() if np.isfinite(value)}
        if not left:  # no set of so many terms can be told apart
            break
        chosen = min(left, key=lambda way: (left[way], way))
        tests = (f_test(value / df, df, first.mean_square, first.df) for value in left.values())
        enough = sum(test is None or test[1] > _EXPLAINED for test in tests)
        equals = max(enough - 1, 0)
        if enough:
            break
    return chosen, equals


def _subsets(candidates: Sequence[tuple[int, int]], size: int, before: Pairings) -> Iterator[Pairings]:
    """Yield all sets of so many terms; where they are too many, those that add one term to the set before."""
    if comb(len(candidates), size) <= _MOST_SUBSETS:
        yield from combinations(candidates, size)
    else:
        yield from ((*before, term) for term in candidates if term not in before)


def _left(y: Array, mean: Array, columns: Sequence[Array]) -> float:
    """Return the sum of squares that the mean and these columns leave; infinity where they are not independent."""
    matrix = np.column_stack([mean, *columns])
    beta, _, rank, _ = np.linalg.lstsq(matrix, y, rcond=None)
    return float(np.sum((y - matrix @ beta) ** 2)) if rank == matrix.shape[1] else np.inf


def _terms(columns: Array, y: Array, names: Sequence[str]) -> tuple[Term, ...]:
    fit = fit_least_squares(columns, y)
    found = []
    for j, name in enumerate(names, 1):
        error = None if fit.mean_square is None else float(np.sqrt(fit.mean_square * fit.unscaled_covariance[j, j]))
        test = f_test(float(fit.partial_ss[j]), 1, None if fit.exact else fit.mean_square, fit.df)
        found.append(Term(name, float(fit.coefficients[j]), error, test[1] if test else None))
    return tuple(found)
