"""The optimum on response surfaces: of one response its minimum; of two the Pareto front and its knee.

All responses are minimised; a response to maximise has the sign −1. With uᵢ the minimum of response i on the front and
nᵢ its value at the other end, fᵢ = (yᵢ − uᵢ)/(nᵢ − uᵢ). Each point of the front is the minimum of f₂ under a bound on
f₁ (V. Chankong and Y. Y. Haimes, Multiobjective Decision Making, 1983). The knee is the point of the front farthest
from the chord between its ends (I. Das, Structural Optimization 18 (1999) 107), which is the minimum of f₁ + f₂.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.search_region import Objective, Region, optimise, search_from
from stemcal.doe.coding import term_columns, term_gradient
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import TargetUnreachable
from stemcal.vocabulary import Variable

_CLOUD = 12
_FRONT = 13  # points of a front
_STARTS = 2  # points of the cloud at which the search for a point of the front starts
_SECOND = 1e-3  # weight of the other response at an end of the front; makes the end unique
_CONFLICT = 1e-3  # the responses do not conflict if the ends of a front are nearer than this share of the span
_SHRINK = 0.6 ** np.arange(16)  # factors that contract the cloud of points towards the optimum


class NoneAllowed(TargetUnreachable):
    """Raised if the limits of a goal exclude the whole region."""

    def __init__(self, text: str) -> None:
        Exception.__init__(self, text)


@dataclass(frozen=True, eq=False)
class Problem:
    """Surfaces over the same coded factors, signs of the responses to optimise, limits in units of the responses."""

    surfaces: Mapping[str, Surface]
    signs: Mapping[str, float]
    limits: Mapping[str, float]
    region: Region
    named: Mapping[str, Variable] = field(default_factory=dict)

    @cached_property
    def cloud(self) -> Array:
        """Points of the region within the limits; raise `NoneAllowed` if there are none."""
        points = self.region.cloud(_CLOUD)
        seeds = [optimise(self.sum_of({name: 1.0}), points, self.region)[0] for name in self.limits]
        every = np.vstack([points, *seeds])
        within = [limit - self.surfaces[name].predict(every) >= 0.0 for name, limit in self.limits.items()]
        allowed = every[np.all(within, axis=0)] if within else every
        if not len(allowed):
            each = []
            for (name, limit), x in zip(self.limits.items(), seeds, strict=True):
                named = self.named.get(name, Variable(name, name, name, "1"))
                least = named.text(float(self.surfaces[name].predict(x)[0]), ".4g")
                each.append(f"{named.name} at most {named.text(limit)} (smallest {least})")
            text = f"goal.at_most: no point of the response surfaces satisfies the limits: {', '.join(each)}."
            raise NoneAllowed(f"{text} Raise a limit in `goal.at_most`, or widen the factor ranges.")
        return allowed

    @cached_property
    def spans(self) -> dict[str, float]:
        """Span of each response over the region."""
        points = self.region.cloud(_CLOUD)
        return {name: float(np.ptp(fit.predict(points))) or 1.0 for name, fit in self.surfaces.items()}

    def sum_of(self, weights: Mapping[str, float]) -> Objective:
        """Return the objective Σ wᵢ yᵢ, scaled to order one."""
        scale = sum(abs(weight) * self.spans[name] for name, weight in weights.items())
        beta = np.sum([weight / scale * self.surfaces[name].beta for name, weight in weights.items()], axis=0)
        return Objective(
            lambda x: float(term_columns(x)[0] @ beta),
            lambda x: np.asarray(beta @ term_gradient(x)),
            lambda points: np.asarray(term_columns(points) @ beta),
        )

    def least(self, weights: Mapping[str, float]) -> Array:
        """Return the point with the minimum of Σ wᵢ yᵢ within the limits."""
        bounds = [(1.0, name, limit) for name, limit in self.limits.items()]
        return optimise(self.sum_of(weights), self.cloud, self.region, self._rule(bounds) if bounds else None)[0]

    def next_on_front(self, last: Array, first: str, second: str, bound: float) -> Array:
        """Return the point with the least `second` response while the `first` is at most `bound`; start from `last`."""
        objective, sign = self.sum_of({second: self.signs[second]}), self.signs[first]
        rule = self._rule([*((1.0, name, limit) for name, limit in self.limits.items()), (sign, first, bound)])
        within = np.vstack([last, self.cloud[sign * self.surfaces[first].predict(self.cloud) <= bound]])
        starts = [last, *within[np.argsort(objective.many(within))[:_STARTS]]]
        ends = [search_from(x, objective, self.region, rule) for x in starts]
        return min((x for x in (last, *ends) if x is not None), key=objective.value)

    def _rule(self, bounds: Sequence[tuple[float, str, float]]) -> dict[str, Any]:
        """Return the constraints sᵢ yᵢ ≤ bᵢ (sign, name, bound) for SLSQP, scaled to order one."""
        betas = np.array([s * self.surfaces[n].beta / self.spans[n] for s, n, _ in bounds])
        most = np.array([b / self.spans[n] for _, n, b in bounds])
        rule = {"fun": lambda x: most - betas @ term_columns(x)[0], "jac": lambda x: -betas @ term_gradient(x)}
        return {"type": "ineq", **rule}


@dataclass(frozen=True, eq=False)
class Optimum:
    """The optimum and the front of two responses, coded; the optimum is the minimum of Σ wᵢ yᵢ with the `weights`."""

    point: Array
    weights: Mapping[str, float]
    front: tuple[Array, ...] = ()


def find_optimum(problem: Problem) -> Optimum:
    """Return the minimum of one response, or the front of two responses with its knee."""
    if len(problem.signs) == 1:
        return Optimum(problem.least(problem.signs), problem.signs)
    (first, s1), (second, s2) = problem.signs.items()
    each = {name: sign / problem.spans[name] for name, sign in problem.signs.items()}
    ends = [problem.least({**each, name: _SECOND * each[name]}) for name in (second, first)]
    y1, y2 = ([sign * float(problem.surfaces[n].predict(x)[0]) for x in ends] for n, sign in problem.signs.items())
    if y1[1] - y1[0] < _CONFLICT * problem.spans[first] or y2[0] - y2[1] < _CONFLICT * problem.spans[second]:
        return Optimum(problem.least(each), each)  # one cutter is the best for both responses
    weights = {first: s1 / (y1[1] - y1[0]), second: s2 / (y2[0] - y2[1])}
    bounds = np.linspace(y1[0], y1[1], _FRONT)[1:-1].tolist()
    front = [ends[0]]
    for bound in bounds:
        front.append(problem.next_on_front(front[-1], first, second, bound))
    return Optimum(problem.least(weights), weights, (*front, ends[1]))


def intervals_of(problem: Problem, optimum: Optimum) -> dict[str, tuple[float, float]] | None:
    """Return the coded 95 % interval of each factor at the optimum; None if the surface has no residual error.

    For S = Σ wᵢ yᵢ with the terms φ and the optimum x̂, let d = φ(x) − φ(x̂). A point x may be the optimum if
    S(x) − S(x̂) = dᵀβ ≤ √(k F(k, ν)) s √(dᵀ(XᵀX)⁻¹d), with k factors, ν residual degrees of freedom and the quantile F
    for 95 %. The interval spans these points. Sources: G. E. P. Box and J. S. Hunter, Biometrika 41 (1954) 190; in
    a region: J. J. Peterson and others, Biometrics 58 (2002) 422.
    """
    from scipy.special import fdtri

    first = next(iter(problem.surfaces.values()))
    values = sum(weight * problem.surfaces[name].response for name, weight in optimum.weights.items())
    whole = fit_surface(first.design, values, first.names, first.terms)
    if whole.mean_square is None:
        return None
    points = np.vstack([optimum.point + part * (problem.cloud - optimum.point) for part in _SHRINK])
    d = term_columns(points) - term_columns(optimum.point)
    error = np.sqrt(whole.mean_square * np.einsum("ij,jk,ik->i", d, whole.unscaled_covariance, d))
    k = problem.region.k
    possible = points[d @ whole.beta <= np.sqrt(k * fdtri(k, whole.df, 0.95)) * error]
    ends = np.vstack([possible, optimum.point])
    return dict(zip(first.names, zip(ends.min(axis=0).tolist(), ends.max(axis=0).tolist(), strict=True), strict=True))
