"""Fewer terms: stepwise reduction of a quadratic that keeps hierarchy.

A product or square stays only with the linear terms it is made of, so that the model means the same in every
coding. Sources: J. L. Peixoto, The American Statistician 44 (1990), 26–30, for hierarchy; C. M. Hurvich and
C.-L. Tsai, Biometrika 76 (1989), 297–307, for AICc = n·ln(RSS/n) + 2q + 2q(q + 1)/(n − q − 1), q = p + 1.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.regression.blocks import block_columns
from stemcal.doe.regression.copies import copies_of
from stemcal.doe.regression.estimable import still_estimable
from stemcal.doe.regression.least_squares import Array, LeastSquares, f_test, fit_least_squares, not_estimable
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.doe.regression.within import Within
from stemcal.errors import UsageError

Terms = frozenset[str]


@dataclass(frozen=True)
class ReductionStep:
    """One term taken out or in, with the p of its F test or the AICc it leads to."""

    action: str
    term: str
    measure: float


@dataclass(frozen=True, eq=False)
class Reduction:
    """The reduced surface and the way there."""

    method: str
    surface: Surface
    steps: tuple[ReductionStep, ...]
    dropped: tuple[str, ...]


def reduce_surface(
    coded: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    method: str = "backward",
    alpha: float = 0.1,
    weights: ArrayLike | None = None,
    blocks: Sequence[object] | None = None,
    within: Within | None = None,
    drop: bool = False,
) -> Reduction:
    """Choose the terms of a surface.

    Parameters
    ----------
    method : {'backward', 'forward', 'aicc'}
        Take out the weakest term while its p exceeds alpha; take in the strongest (with the linear terms it
        needs) while its p is below alpha; or step either way, from the full and from the empty model, while
        AICc falls.
    weights, blocks, within, drop
        As `fit_surface` takes them; with `drop` the full model is what the runs can still estimate.
    """
    if method not in METHODS:
        raise UsageError(f"rsm.reduce: no method {method!r}; choose one of {', '.join(METHODS)}")
    y = np.asarray(response, dtype=float)
    points = np.asarray(coded, dtype=float)
    present = np.isfinite(y) & ~copies_of(points, y, blocks)
    problem = _Problem(
        term_columns(points[present]),
        y[present],
        tuple(term_names(names)),
        np.ones(int(present.sum())) if weights is None else np.asarray(weights, dtype=float)[present],
        block_columns(blocks, present)[0],
        drop and not np.isfinite(y).all(),
    )
    chosen, steps = METHODS[method](problem, alpha)
    surface = fit_surface(coded, response, names, sorted(chosen), weights, blocks, within)
    return Reduction(method, surface, tuple(steps), tuple(t for t in problem.terms[1:] if t not in chosen))


def parents(term: str) -> Terms:
    """Return the linear terms a product or square is made of.

    >>> sorted(parents("a:b")), sorted(parents("a^2")), sorted(parents("a"))
    (['a', 'b'], ['a'], [])
    """
    if ":" in term:
        return frozenset(term.split(":"))
    return frozenset([term.removesuffix("^2")]) if term.endswith("^2") else frozenset()


@dataclass(frozen=True, eq=False)
class _Problem:
    columns: Array
    response: Array
    terms: tuple[str, ...]
    weights: Array
    apart: Array
    drop: bool

    def full(self) -> Terms:
        """Return every term; where failed runs count, those that the runs left can estimate."""
        kept = still_estimable(self.columns, self.terms) if self.drop else range(len(self.terms))
        return frozenset(self.terms[i] for i in kept if i > 0)

    def fit(self, chosen: Terms) -> LeastSquares | None:
        """Fit the chosen terms and the mean; None if the runs cannot estimate them."""
        places = [i for i, term in enumerate(self.terms) if i == 0 or term in chosen]
        matrix = np.column_stack([self.columns[:, places], self.apart])
        if not_estimable(matrix, [str(i) for i in range(matrix.shape[1])]):
            return None
        return fit_least_squares(matrix, self.response, self.weights, self.apart.shape[1])

    def removable(self, chosen: Terms) -> list[str]:
        """Return the terms that no other chosen term is made of."""
        needed = frozenset().union(*map(parents, chosen))
        return [term for term in self.terms[1:] if term in chosen and term not in needed]

    def with_parents(self, chosen: Terms, term: str) -> Terms:
        return chosen | parents(term) | {term}

    def aicc(self, chosen: Terms) -> float:
        fit = self.fit(chosen)
        return math.inf if fit is None else _aicc(fit)


def _aicc(fit: LeastSquares) -> float:
    n, q = len(fit.response), fit.matrix.shape[1] + 1
    if n - q - 1 <= 0:
        return math.inf
    rss = max(fit.residual_ss, 1e-300)
    return float(n * math.log(rss / n) + 2.0 * q + 2.0 * q * (q + 1.0) / (n - q - 1.0))


Search = tuple[Terms, list[ReductionStep]]


def _backward(problem: _Problem, alpha: float) -> Search:
    chosen, steps = _start(problem), []
    while candidates := problem.removable(chosen):
        fit = problem.fit(chosen)
        weakest, p = max(((t, _p_of_loss(problem, fit, chosen, t)) for t in candidates), key=lambda pair: pair[1])
        if p <= alpha:
            break
        chosen -= {weakest}
        steps.append(ReductionStep("out", weakest, p))
    return chosen, steps


def _start(problem: _Problem) -> Terms:
    chosen = problem.full()
    if problem.fit(chosen) is None:
        raise UsageError(
            "rsm.reduce: backward starts from the full quadratic, which the runs cannot estimate; write forward, or "
            "where runs have failed rsm.inestimable: drop"
        )
    return chosen


def _p_of_loss(problem: _Problem, fit: LeastSquares | None, chosen: Terms, term: str) -> float:
    """Return the p of the F test of one term of a fit; 0 where no test is possible."""
    if fit is None or fit.exact:
        return 0.0
    place = [t for t in problem.terms if t in chosen or t == "1"].index(term)
    test = f_test(float(fit.partial_ss[place]), 1, fit.mean_square, fit.df)
    return test[1] if test else 0.0


def _forward(problem: _Problem, alpha: float) -> Search:
    chosen: Terms = frozenset()
    steps: list[ReductionStep] = []
    while True:
        tried = [(t, _p_of_gain(problem, chosen, t)) for t in problem.terms[1:] if t not in chosen]
        strongest, p = min(tried, key=lambda pair: pair[1], default=("", 1.0))
        if p >= alpha:
            return chosen, steps
        chosen = problem.with_parents(chosen, strongest)
        steps.append(ReductionStep("in", strongest, p))


def _p_of_gain(problem: _Problem, chosen: Terms, term: str) -> float:
    """Return the p of the F test of a term, together with the linear terms it brings."""
    small, large = problem.fit(chosen), problem.fit(problem.with_parents(chosen, term))
    if small is None or large is None or small.exact:
        return 1.0
    if large.exact:
        return 0.0
    gained = small.df - large.df
    test = f_test((small.residual_ss - large.residual_ss) / gained, gained, large.mean_square, large.df)
    return test[1] if test else 1.0


def _by_aicc(problem: _Problem, _alpha: float) -> Search:
    full = problem.full()
    starts = [frozenset[str](), full] if math.isfinite(problem.aicc(full)) else [frozenset[str]()]
    return min((_descend(problem, start) for start in starts), key=lambda found: problem.aicc(found[0]))


def _descend(problem: _Problem, chosen: Terms) -> Search:
    steps: list[ReductionStep] = []
    while True:
        moves = [("out", t, chosen - {t}) for t in problem.removable(chosen)]
        moves += [("in", t, problem.with_parents(chosen, t)) for t in problem.terms[1:] if t not in chosen]
        scored = [(problem.aicc(terms), action, t, terms) for action, t, terms in moves]
        best = min(scored, key=lambda move: move[0], default=None)
        if best is None or not best[0] < problem.aicc(chosen) - 1e-9:
            return chosen, steps
        chosen = best[3]
        steps.append(ReductionStep(best[1], best[2], best[0]))


METHODS: dict[str, Callable[[_Problem, float], Search]] = {
    "backward": _backward,
    "forward": _forward,
    "aicc": _by_aicc,
}
