"""The joint fit: factor settings x at which surfaces predict all measured means, and the uncertainty of x.

Each measured mean is an observation ȳ = ŷ(x) + errors of its specimens and of its surface. A normal prior of a factor
with value v is one more observation z = (v − μ)/σ of variance 1. The covariance V of the errors is unknown; the module
`observations` draws a sample of it. With r = ȳ − ŷ(x) the likelihood is the average of normal densities over the draws,

    L(x) = mean of |V|^(−1/2) exp(−rᵀV⁻¹r/2)

For one mean of n specimens this is Student's t distribution, for a known standard deviation the normal one. The weight
of a draw is its evidence, the integral of its density over x for linearised surfaces; if the data contradict all draws,
the weights are equal. With the weighted mean W = E[V⁻¹] follow

    solution   the x with the least D(x) = rᵀWr; for a single force, the points with D = 0
    interval   profile likelihood of factor j: all values v with min D(x : xⱼ = v) − min D ≤ c
    c          chosen such that for linearised surfaces the interval contains 95 % of the mixture, over the draws, of
               the normal distributions of xⱼ: 1.96² for a known scatter, t² for an estimated one
    misfit     p-value, the mean of P(χ²(df) > min D) over the draws

An increase of D at x is divided by the ratio of error variances at x and at the solution, because a quadratic is less
certain away from its runs. Sources: D. J. Venzon and S. H. Moolgavkar, Applied Statistics 37 (1988) 87; A. Gelman and
others, Bayesian Data Analysis, 3rd ed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.observations import Errors, Observation, errors_of
from stemcal.doe.calibration.search_region import Objective, Region, optimise
from stemcal.doe.regression.section import SeveralSurfaces
from stemcal.errors import UsageError

LEVEL = 0.05  # significance level
_CLOUD, _SETTLED = 11, 3  # 2^11 points fill the region; `_SETTLED`: number of fits until the weights converge
_NOTHING = 1e-9  # a direction with less than this fraction of the largest information is undetermined


@dataclass(frozen=True)
class Prior:
    """Normal prior of the value v = centre + half_step·xⱼ of factor `j`: mean μ and standard deviation σ = `sd`."""

    j: int
    mean: float
    sd: float
    centre: float
    half_step: float

    def z(self, points: Array) -> Array:
        """Return z = (v − μ)/σ, (m,), at coded points (m, k)."""
        return np.asarray((self.centre + self.half_step * points[:, self.j] - self.mean) / self.sd)


@dataclass(frozen=True, eq=False)
class Fit:
    """The result of `fit`; the symbols x, r, D, V, W and L are defined at the top of this module."""

    observations: tuple[Observation, ...]
    priors: tuple[Prior, ...]
    region: Region
    errors: Errors  # draws of the errors of specimens and surfaces, from which V follows at any x
    draws: Array  # draws of V at the solution (draws, m, m), the rows of priors last
    weights: Array  # weights of the draws, sum 1
    precision: Array  # W, the weighted mean of V⁻¹
    best: Array  # coded solution x (k,)

    @cached_property
    def measured(self) -> Array:
        return np.array([o.measured for o in self.observations])

    @cached_property
    def surfaces(self) -> SeveralSurfaces:
        return SeveralSurfaces([o.surface for o in self.observations])

    @property
    def df(self) -> int:
        """Degrees of freedom: number of observations and priors minus number of factors."""
        return len(self.observations) + len(self.priors) - self.region.k

    def predict(self, points: Array) -> Array:
        """Return ŷ of all observations at coded points, (points, observations)."""
        return self.surfaces.predict(points)

    def errors_percent(self, x: Array) -> Array:
        """Return 100·(measured − ŷ)/measured at one point."""
        return np.asarray(100.0 * (self.measured - self.predict(x)[0]) / self.measured)

    def gaps(self, points: Array) -> Array:
        """Return r = ȳ − ŷ at coded points, followed by −z of the priors, (points, observations and priors)."""
        of_data = self.measured - self.predict(points)
        return np.column_stack([of_data, *(-prior.z(points) for prior in self.priors)]) if self.priors else of_data

    def slopes(self, x: Array) -> Array:
        """Return −∂r/∂x at one point, (observations and priors, factors)."""
        of_data = self.surfaces.slopes(x)
        if not self.priors:
            return of_data
        rows = np.zeros((len(self.priors), self.region.k))
        for row, prior in zip(rows, self.priors, strict=True):
            row[prior.j] = prior.half_step / prior.sd  # ∂z/∂xⱼ
        return np.vstack([of_data, rows])

    def many(self, points: Array) -> Array:
        """Return the misfit D = rᵀWr at coded points (points, k)."""
        gaps = self.gaps(points)
        return np.asarray(((gaps @ self.precision) * gaps).sum(axis=1))

    def value(self, x: Array) -> float:
        """Return the misfit D at one point."""
        return float(self.many(x[None])[0])

    def gradient(self, x: Array) -> Array:
        """Return the gradient ∂D/∂x of the misfit at one point, (k,)."""
        return np.asarray(-2.0 * self.gaps(x[None])[0] @ self.precision @ self.slopes(x))

    @cached_property
    def least(self) -> float:
        """The least misfit, D at the solution."""
        return self.value(self.best)

    @cached_property
    def objective(self) -> Objective:
        """The misfit D as an objective, divided by its median over the region to be of order one."""
        scale = max(float(np.median(self.many(self.region.cloud(9)))), 1e-300)
        return Objective(
            lambda x: self.value(x) / scale,
            lambda x: self.gradient(x) / scale,
            lambda points: self.many(points) / scale,
        )

    def rise(self, x: Array) -> float:
        """Return D(x) − min D; the part of the observations is divided by `looseness`, the ratio of error variances."""
        here, best = self.gaps(x[None])[0], self.gaps(self.best[None])[0]
        m = len(self.observations)

        def excess(part: slice) -> float:
            w = self.precision[part, part]
            return float(here[part] @ w @ here[part] - best[part] @ w @ best[part])

        return max(excess(slice(m)) / self.looseness(x) + excess(slice(m, None)), 0.0)

    def looseness(self, x: Array) -> float:
        """Return the ratio (≥ 0.1) of the error variances at x and at the solution, averaged over observations."""
        return max(float(np.mean(1.0 + self._share * (self._spread(x) / self._spread(self.best) - 1.0))), 0.1)

    @cached_property
    def _share(self) -> Array:
        """The fraction of the error variance of each observation that is due to the surface."""
        m = len(self.observations)
        whole = np.diagonal(self.draws, axis1=1, axis2=2)[:, :m]
        return np.asarray(self.weights @ (1.0 - np.diagonal(self.errors.laboratory, axis1=1, axis2=2) / whole))

    def _spread(self, x: Array) -> Array:
        """Return the relative error variance of the surface of each observation at x, of which only ratios are used."""
        spread = np.ones(len(self.observations))
        for mine, contrasts, common, separate, chance in self.errors.surfaces:
            k, n = contrasts.leverages(x)
            spread[mine] = np.median(common + separate) * np.diag(k) + np.median(chance, axis=0) * n
        return spread

    def log_likelihood(self, points: Array) -> Array:
        """Return ln L at coded points (points, k), including the priors, up to a constant."""
        gaps, m = self.gaps(points)[:, : len(self.observations)], len(self.observations)
        draws = self.draws[:, :m, :m]
        squares = np.einsum("pi,sij,pj->ps", gaps, np.linalg.inv(draws), gaps, optimize=True)
        at_best = squares.min(axis=0)
        loose = np.array([self.looseness(x) for x in points])[:, None]
        logs = -0.5 * ((squares - at_best) / loose + at_best + np.linalg.slogdet(draws)[1])
        top = logs.max(axis=1)
        logs = top + np.log(np.exp(logs - top[:, None]).mean(axis=1))
        return np.asarray(logs + sum(-0.5 * prior.z(points) ** 2 for prior in self.priors))

    @cached_property
    def tangents(self) -> Tangents:
        """The fit with surfaces linearised at the solution."""
        return Tangents(self.slopes(self.best), self.gaps(self.best[None])[0], self.draws, self.precision, self.weights)

    @cached_property
    def p_value(self) -> float | None:
        """The p-value of the least misfit; None without degrees of freedom, or if the scatter is estimated from it."""
        from scipy.special import chdtrc

        if self.errors.scatter != "misfit":
            return None if self.df < 1 else float(np.mean(chdtrc(self.df, self.tangents.misfits)))
        if not self.priors:
            return None
        # the scatter is estimated from the data alone, so the p-value tests the increase of D due to the priors
        data = fit(self.observations, self.region)
        rise = self.tangents.misfits - data.tangents.misfits
        return float(data.weights @ chdtrc(len(self.priors), np.maximum(rise, 0.0)))

    @property
    def evidence(self) -> Array:
        """Weights of the draws of V: their evidence, or equal weights if the data contradict all draws."""
        from scipy.special import chdtrc

        # a plain mean: the evidence of a wrong model favours draws with a large scatter, which hide its misfit
        p = float(np.mean(chdtrc(max(self.df, 1), self.tangents.misfits)))
        if self.errors.scatter == "misfit" or p >= LEVEL:
            return self.tangents.evidence
        return np.full(len(self.draws), 1.0 / len(self.draws))

    @cached_property
    def inverses(self) -> Array:
        """V⁻¹ of each draw."""
        return np.asarray(np.linalg.inv(self.draws))

    def ignoring(self, *ignored: int) -> Fit:
        """Return the fit in which these observations have no weight: faster than `without`, same solution and D.

        For the ignored observations b, the others a and Λ = V⁻¹, (V_aa)⁻¹ = Λ_aa − Λ_ab Λ_bb⁻¹ Λ_ba (Schur complement).
        """
        b = list(ignored)
        across, own = self.inverses[:, :, b], self.inverses[:, b][:, :, b]
        part = across @ np.linalg.cholesky(np.linalg.inv(own))
        part_of_ignored = np.tensordot(part * self.weights[:, None, None], part, axes=([0, 2], [0, 2]))
        precision = self.precision - part_of_ignored
        precision[b], precision[:, b] = 0.0, 0.0
        others = replace(self, precision=precision)
        return replace(others, best=optimise(others.objective, self.region.cloud(_CLOUD), self.region)[0])

    def without(self, *left_out: int) -> Fit:
        """Return the fit to all observations except these, with the same draws."""
        kept = [i for i in range(len(self.observations)) if i not in left_out]
        rows = [*kept, *range(len(self.observations), len(self.draws[0]))]
        place = {i: new for new, i in enumerate(kept)}
        surfaces = []
        for mine, contrasts, common, separate, chance in self.errors.surfaces:
            here = [a for a, i in enumerate(mine.tolist()) if i in place]
            if here:
                there = np.array([place[int(mine[a])] for a in here])
                surfaces.append((there, contrasts.only(here), common, separate, chance[:, here]))
        laboratory = self.errors.laboratory[:, np.array(kept)[:, None], kept]
        errors = replace(self.errors, laboratory=laboratory, surfaces=tuple(surfaces))
        draws = self.draws[:, np.array(rows)[:, None], rows]
        observations = tuple(self.observations[i] for i in kept)
        precision = np.tensordot(self.weights, np.linalg.inv(draws), axes=1)
        others = Fit(observations, self.priors, self.region, errors, draws, self.weights, precision, self.best)
        return replace(others, best=optimise(others.objective, self.region.cloud(_CLOUD), self.region)[0])


@dataclass(frozen=True, eq=False)
class Tangents:
    """A fit with linearised surfaces: slopes J = −∂r/∂x, gaps r, draws of V and their weights, mean precision W."""

    slopes: Array
    gaps: Array
    draws: Array
    precision: Array
    weights: Array

    @cached_property
    def basis(self) -> Array:
        """Unit vectors of the directions about which the data contain information, (factors, directions)."""
        values, vectors = np.linalg.eigh(self.information)
        return np.asarray(vectors[:, values > _NOTHING * max(values.max(initial=0.0), 1e-300)])

    @property
    def information(self) -> Array:
        """The information matrix JᵀWJ, (factors, factors)."""
        return np.asarray(self.slopes.T @ self.precision @ self.slopes)

    @cached_property
    def _each(self) -> tuple[Array, Array, Array, Array]:
        """For each draw: covariance of the estimate in the basis, step from `best` to it, least D, ln(evidence)."""
        j, inverse = self.slopes @ self.basis, np.linalg.inv(self.draws)
        info = j.T @ inverse @ j
        covariance = np.linalg.inv(info)
        b = np.einsum("ad,sab,b->sd", j, inverse, self.gaps)
        step = np.einsum("sde,se->sd", covariance, b)
        d = np.einsum("a,sab,b->s", self.gaps, inverse, self.gaps) - (step * b).sum(axis=1)
        logs = np.linalg.slogdet(self.draws)[1] + np.linalg.slogdet(info)[1]
        return np.asarray(covariance), np.asarray(step), np.asarray(d), np.asarray(-0.5 * (logs + d))

    @property
    def evidence(self) -> Array:
        """Weights of the draws by their evidence, sum 1."""
        log = self._each[3]
        weights = np.exp(log - log.max())
        return np.asarray(weights / weights.sum())

    @cached_property
    def misfits(self) -> Array:
        """D of each draw at the solution; if that is at the edge of the region, D exceeds the least D in `_each`."""
        b = self.basis.T @ self.slopes.T @ self.precision @ self.gaps
        beyond = float(b @ np.linalg.solve(self.basis.T @ self.information @ self.basis, b))
        return np.asarray(np.maximum(self._each[2] + beyond, 0.0))

    def allowed(self, direction: Array, level: float = 0.95) -> float:
        """Return c: inside the interval of probability `level` along a direction, D is at most c above its minimum."""
        from scipy.optimize import brentq
        from scipy.special import ndtr, ndtri

        a = self.basis.T @ direction
        if not a.any():
            return float(ndtri(0.5 + 0.5 * level) ** 2)
        covariance, step, *_ = self._each
        middle, sd = step @ a, np.sqrt(np.einsum("d,sde,e->s", a, covariance, a))
        centre = float(self.weights @ middle)

        def outside(half: float) -> float:
            ends = ndtr((centre + half - middle) / sd) - ndtr((centre - half - middle) / sd)
            return float(self.weights @ ends) - level

        typical = float(a @ np.linalg.solve(self.basis.T @ self.information @ self.basis, a)) ** 0.5
        most = 2.0 * typical
        while outside(most) < 0.0:
            most *= 2.0
        return float((brentq(outside, 0.0, most) / typical) ** 2)


def fit(observations: Sequence[Observation], region: Region, priors: Sequence[Prior] = ()) -> Fit:
    """Fit observations and priors within a region; raise `UsageError` unless all surfaces have the same factors."""
    if len({o.surface.names for o in observations}) != 1:
        raise UsageError("joint fit: surfaces are missing or have different factors; pass surfaces with equal factors")
    errors = errors_of(observations, len(observations) - region.k)
    m, q = len(observations), len(priors)
    seeds, current = region.cloud(_CLOUD), None
    for _ in range(_SETTLED):
        x = region.middle if current is None else current.best
        draws = np.zeros((len(errors.laboratory), m + q, m + q))
        draws[:, :m, :m], draws[:, m:, m:] = errors.at(x), np.eye(q)
        weights = np.full(len(draws), 1.0 / len(draws)) if current is None else current.evidence
        precision = np.tensordot(weights, np.linalg.inv(draws), axes=1)
        current = Fit(tuple(observations), tuple(priors), region, errors, draws, weights, precision, x)
        current = replace(current, best=optimise(current.objective, seeds, region)[0])
        seeds = current.best[None]
    assert current is not None
    return current
