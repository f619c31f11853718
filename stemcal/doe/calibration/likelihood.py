"""One fit: the parameters at which surfaces predict what was measured, and how far these may be off.

Every measured mean is an observation, ȳ = ŷ(x) + errors: of its specimens and of its surface. A prior is one
more observation, of variance 1: z = (v − μ)/σ of the value v. The covariance V of the errors is not known;
`observations` draws it. With r = ȳ − ŷ(x) the likelihood is the average of normal densities over the draws,

    L(x) = mean of |V|^(−1/2) exp(−rᵀV⁻¹r/2)

which for one mean of n specimens is Student's t, and for a known standard deviation the normal density. Draws count by
their evidence, the integral of this over x on the tangents at the solution, unless the data contradict all of them.
Their mean precision W = E[V⁻¹] gives

    solution     the least D(x) = rᵀWr, of one force the points where it is 0
    interval     of factor j: all v with min D(x: xⱼ = v) − min D ≤ c, a profile likelihood
    c            such that for straight surfaces the interval has 95 % of the mixture of normal distributions of xⱼ
                 that the draws give: 1.96² of a known scatter, t² of an estimated one
    misfit       p = the mean over the draws of P(χ²(df) > min D)

A rise of D counts by the error of the surfaces where it is: a quadratic is less certain away from its runs. Sources:
D. J. Venzon and S. H. Moolgavkar, Applied Statistics 37 (1988) 87; A. Gelman and others, Bayesian Data Analysis, 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stemcal.doe.calibration.observations import Errors, Observation, errors_of
from stemcal.doe.calibration.region import Objective, Region, optimise
from stemcal.doe.coding import Array
from stemcal.doe.regression.section import SeveralSurfaces
from stemcal.errors import UsageError

LEVEL = 0.05
_CLOUD, _SETTLED = 11, 3
_NOTHING = 1e-9  # of the largest certainty of a direction: below it nothing is known along it


@dataclass(frozen=True)
class Prior:
    """The normal prior of factor `j`, whose value is centre + half_step·xⱼ; `mean` and `sd` are in its unit."""

    j: int
    mean: float
    sd: float
    centre: float
    half_step: float

    def z(self, points: Array) -> Array:
        """Return z at (m, k) coded points."""
        return np.asarray((self.centre + self.half_step * points[:, self.j] - self.mean) / self.sd)


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit made by `fit`: `best`, coded; `draws` of V there, priors last, their `weights` and mean inverse."""

    observations: tuple[Observation, ...]
    priors: tuple[Prior, ...]
    region: Region
    errors: Errors
    draws: Array
    weights: Array
    precision: Array
    best: Array

    # ---- residuals and their slopes

    @cached_property
    def measured(self) -> Array:
        """The measured means."""
        return np.array([o.measured for o in self.observations])

    @cached_property
    def surfaces(self) -> SeveralSurfaces:
        """The surface of each observation."""
        return SeveralSurfaces([o.surface for o in self.observations])

    @property
    def df(self) -> int:
        """Observations and priors beyond those that fix the factors."""
        return len(self.observations) + len(self.priors) - self.region.k

    def predict(self, points: Array) -> Array:
        """Return ŷ, (points, observations)."""
        return self.surfaces.predict(points)

    def errors_percent(self, x: Array) -> Array:
        """Return 100·(measured − ŷ)/measured at one point."""
        return np.asarray(100.0 * (self.measured - self.predict(x)[0]) / self.measured)

    def gaps(self, points: Array) -> Array:
        """Return r at (points, k), with −z of the priors behind it."""
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

    # ---- the misfit

    def many(self, points: Array) -> Array:
        """Return D at (points, k)."""
        gaps = self.gaps(points)
        return np.asarray(((gaps @ self.precision) * gaps).sum(axis=1))

    def value(self, x: Array) -> float:
        """Return D at one point."""
        return float(self.many(x[None])[0])

    def gradient(self, x: Array) -> Array:
        """Return ∂D/∂x."""
        return np.asarray(-2.0 * self.gaps(x[None])[0] @ self.precision @ self.slopes(x))

    @cached_property
    def least(self) -> float:
        """D at the solution."""
        return self.value(self.best)

    @cached_property
    def objective(self) -> Objective:
        """D, brought to order one, as something to make small."""
        scale = max(float(np.median(self.many(self.region.cloud(9)))), 1e-300)
        return Objective(
            lambda x: self.value(x) / scale,
            lambda x: self.gradient(x) / scale,
            lambda points: self.many(points) / scale,
        )

    def rise(self, x: Array) -> float:
        """Return the excess of D over its least value, that of the observations by the error of the surfaces at x."""
        here, best = self.gaps(x[None])[0], self.gaps(self.best[None])[0]
        m = len(self.observations)

        def excess(part: slice) -> float:
            w = self.precision[part, part]
            return float(here[part] @ w @ here[part] - best[part] @ w @ best[part])

        return max(excess(slice(m)) / self.looseness(x) + excess(slice(m, None)), 0.0)

    def looseness(self, x: Array) -> float:
        """Return the variance of the observations at x over that at the solution, their mean: at least 0.1."""
        return max(float(np.mean(1.0 + self._share * (self._spread(x) / self._spread(self.best) - 1.0))), 0.1)

    @cached_property
    def _share(self) -> Array:
        """The part of the surface in the variance of each observation."""
        m = len(self.observations)
        whole = np.diagonal(self.draws, axis1=1, axis2=2)[:, :m]
        own = np.diagonal(self.errors.laboratory, axis1=1, axis2=2)
        return np.asarray(self.weights @ (1.0 - own / whole))

    def _spread(self, x: Array) -> Array:
        spread = np.ones(len(self.observations))
        for mine, contrasts, common, separate, chance in self.errors.surfaces:
            k, n = contrasts.leverages(x)
            spread[mine] = np.median(common + separate) * np.diag(k) + np.median(chance, axis=0) * n
        return spread

    def log_likelihood(self, points: Array) -> Array:
        """Return the log of the likelihood at (points, k), up to a constant, with the density of the priors."""
        gaps, m = self.gaps(points)[:, : len(self.observations)], len(self.observations)
        draws = self.draws[:, :m, :m]
        squares = np.einsum("pi,sij,pj->ps", gaps, np.linalg.inv(draws), gaps, optimize=True)
        at_best = squares.min(axis=0)
        loose = np.array([self.looseness(x) for x in points])[:, None]
        logs = -0.5 * ((squares - at_best) / loose + at_best + np.linalg.slogdet(draws)[1])
        top = logs.max(axis=1)
        logs = top + np.log(np.exp(logs - top[:, None]).mean(axis=1))
        return np.asarray(logs + sum(-0.5 * prior.z(points) ** 2 for prior in self.priors))

    # ---- what is known

    @cached_property
    def tangents(self) -> Tangents:
        """The fit on the tangents at the solution."""
        return Tangents(self.slopes(self.best), self.gaps(self.best[None])[0], self.draws, self.precision, self.weights)

    @cached_property
    def p_value(self) -> float | None:
        """Probability of a misfit at least as large; None if the misfit determines the scatter or df is zero."""
        from scipy.special import chdtrc

        if self.errors.scatter != "misfit":
            return None if self.df < 1 else float(np.mean(chdtrc(self.df, self.tangents.misfits)))
        if not self.priors:
            return None
        data = fit(self.observations, self.region)  # only the data determine the scatter: p of the rise by the priors
        rise = self.tangents.misfits - data.tangents.misfits
        return float(data.weights @ chdtrc(len(self.priors), np.maximum(rise, 0.0)))

    @property
    def evidence(self) -> Array:
        """Weights of the draws by the gaps; equal where these contradict them: a wrong model is no sign of scatter."""
        from scipy.special import chdtrc

        p = float(np.mean(chdtrc(max(self.df, 1), self.tangents.misfits)))
        if self.errors.scatter == "misfit" or p >= LEVEL:
            return self.tangents.evidence
        return np.full(len(self.draws), 1.0 / len(self.draws))

    @cached_property
    def inverses(self) -> Array:
        """V⁻¹ of each draw."""
        return np.asarray(np.linalg.inv(self.draws))

    def ignoring(self, *ignored: int) -> Fit:
        """Return the fit in which observations have no weight; solution and D are those of `without`, at less cost.

        With the others a and the ignored b, (V_aa)⁻¹ = Λ_aa − Λ_ab Λ_bb⁻¹ Λ_ba, Λ = V⁻¹ (Schur complement).
        """
        b = list(ignored)
        across, own = self.inverses[:, :, b], self.inverses[:, b][:, :, b]
        part = across @ np.linalg.cholesky(np.linalg.inv(own))
        taken = np.tensordot(part * self.weights[:, None, None], part, axes=([0, 2], [0, 2]))
        precision = self.precision - taken
        precision[b], precision[:, b] = 0.0, 0.0
        others = replace(self, precision=precision)
        return replace(others, best=optimise(others.objective, self.region.cloud(_CLOUD), self.region)[0])

    def without(self, *left_out: int) -> Fit:
        """Return the fit to the other observations, by the same draws."""
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
    """A fit with straight surfaces: slopes J, gaps r, draws of V with weights, mean precision W."""

    slopes: Array
    gaps: Array
    draws: Array
    precision: Array
    weights: Array

    @cached_property
    def basis(self) -> Array:
        """Unit vectors along which something is known, (factors, directions)."""
        values, vectors = np.linalg.eigh(self.information)
        return np.asarray(vectors[:, values > _NOTHING * max(values.max(initial=0.0), 1e-300)])

    @property
    def information(self) -> Array:
        """JᵀWJ."""
        return np.asarray(self.slopes.T @ self.precision @ self.slopes)

    @cached_property
    def _each(self) -> tuple[Array, Array, Array, Array]:
        """Of each draw: covariance and step of the estimate along the basis, D there, log of the evidence."""
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
        """Weights of the draws by what the gaps say of them, sum 1."""
        log = self._each[3]
        weights = np.exp(log - log.max())
        return np.asarray(weights / weights.sum())

    @cached_property
    def misfits(self) -> Array:
        """D of each draw at the solution; on the edge of a region it is not the least of the straight surfaces."""
        b = self.basis.T @ self.slopes.T @ self.precision @ self.gaps
        beyond = float(b @ np.linalg.solve(self.basis.T @ self.information @ self.basis, b))
        return np.asarray(np.maximum(self._each[2] + beyond, 0.0))

    def allowed(self, direction: Array, level: float = 0.95) -> float:
        """Return c: the rise of D at the ends of what the mixture of the draws allows along a direction."""
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
    """Fit observations and priors within a region; raise `UsageError` if the surfaces are not over the same factors."""
    if len({o.surface.names for o in observations}) != 1:
        raise UsageError(
            "joint fit: the surfaces are missing or have different factors; pass surfaces with the same factors"
        )
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
