"""How badly a point of the region fits what was measured: D(x) = Σ (measured − ŷ(x))² / variance.

Each measured response has its own surface over the same factors. What its variance is made of:

    measured   (cv·mean)²/n of the measured mean, and that of the mean response about its surface
    pooled     as measured; a value without sd gets the coefficient of variation of the others of its kind
    misfit     no sd anywhere, more responses than factors: variance ∝ measured², its size told by the misfit
    surface    no sd anywhere, too few responses to tell: the surface's part alone, the measured value is exact
    joint      one observation by itself, with the scatter that the misfit of all has told

A few specimens do not give a known sd. All of a kind share one coefficient of variation cv, pooled over the diameters,
cv² = Σ(n − 1)(sd/mean)²/Σ(n − 1), and its degrees of freedom go with it: D/k follows F in place of χ²/k. With variances
that are sums the degrees of freedom are Satterthwaite's (Biometrics Bulletin 2 (1946) 110–114), 1/Σ(share²/df) over the
parts and their mean shares; of several kinds the least counts, since an interval may rest on one of them alone. An sd
without its n counts as known.

The coefficient of variation may differ between the diameters, and no test on a few specimens shows it. So the pooled
one weighs the observations, but how far a factor may go rests on each diameter's own sd: the estimate of a factor is a
weighted sum of the observations, whose variance adds up their own (after Welch, Biometrika 34 (1947) 28), with
Satterthwaite's degrees of freedom for that factor (`Misfit.freedom`).

So it is with the surfaces: those of a kind share one relative error, pooled by their degrees of freedom, which weighs
them; a surface of few degrees of freedom that is sharp by luck would else have all the weight. Their lack of fit is
tested together too: five tests by themselves would find one where there is none in three studies of four.

Several responses of the same specimens have one covariance matrix, told by these: it stands for its p variances, with
the degrees of freedom of all together, and the residuals tell by how much its weights are off (`Misfit.freedom`).

Some errors move many observations together, each by its own amount u: the testing machine's stiffness, and where its
curves begin, the scores of curves at all diameters. So D = rᵀV⁻¹r with V = diag(v) + UᵀU, a row of U for each, by
Woodbury's formula. What is shared is not averaged away over the diameters; each factor's degrees of freedom know of it.
What the observations tell of such an error is `Misfit.told_of`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.calibration.levelset import Objective, optimise
from stemcal.doe.calibration.prior import Prior
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array, f_test
from stemcal.doe.regression.mean_error import POOLED
from stemcal.doe.regression.surface import Surface
from stemcal.doe.regression.terms import term_columns, term_gradient
from stemcal.errors import UsageError
from stemcal.naming import FIRST

Scatter = Literal["measured", "pooled", "misfit", "surface", "joint"]
# No force is known better than this part of itself: keeps the misfit of an exact surface finite.
_FINEST = 1e-4
_CLOUD = 11


@dataclass(frozen=True, eq=False)
class Observation:
    """A measured mean with the surface that predicts it; `kind` is what was measured.

    Observations of the same `specimens`, by their name, have one covariance matrix, in which they are uncorrelated.
    `systematic` has, by its name, by how much one standard deviation of what moves all specimens alike moves the mean:
    of other conditions too, where the name is the same.
    """

    surface: Surface
    measured: float
    sd: float | None = None
    n: int | None = None
    kind: str = FIRST
    specimens: str = ""
    systematic: Mapping[str, float] = field(default_factory=dict)

    @property
    def error_df(self) -> int:
        """Degrees of freedom behind the error of the prediction."""
        return self.surface.mean_error.df if self.surface.mean_error else 0

    def error_at(self, point: Array | None) -> float:
        """Return the variance of the prediction at a point, or its mean over the runs."""
        where = self.surface.design if point is None else point
        return 0.0 if self.surface.mean_error is None else float(np.mean(self.surface.mean_variance(where)))


@dataclass(frozen=True, eq=False)
class VarianceSource:
    """One source of error: its variance at each observation, and the degrees of freedom behind it.

    One with a `loading`, u, moves all observations together, each by its own standard deviation with its sign. Where
    `variance` is pooled, `apart` is what each observation by itself says of it, with its own degrees of freedom
    `apart_df`. A `matrix` is the estimated covariance of several responses of the same specimens.
    """

    name: str
    variance: Array
    df: float
    loading: Array | None = None
    apart: Array | None = None
    apart_df: Array | None = None
    matrix: bool = False

    @classmethod
    def moving(cls, name: str, loading: Array, df: float) -> VarianceSource:
        """Return what moves observations together."""
        return cls(name, loading**2, df, loading)

    def only(self, kept: Sequence[int]) -> VarianceSource:
        """Keep some of the observations; a matrix of fewer responses is known better."""
        parts = (self.loading, self.apart, self.apart_df)
        loading, apart, df = (None if part is None else part[list(kept)] for part in parts)
        found = replace(self, variance=self.variance[list(kept)], loading=loading, apart=apart, apart_df=df)
        if not self.matrix:
            return found
        more = self.df + float(np.count_nonzero(self.variance) - np.count_nonzero(found.variance))
        return replace(found, variance=found.variance * self.df / more, df=more)

    def parts(self, g: Array) -> tuple[Array, Array]:
        """Return what the source adds to the variance of sums of observations with weights g, (observations, sums).

        And the sum of its squared estimates over their degrees of freedom, as Satterthwaite's formula takes it.
        """
        if self.loading is not None:
            found = (self.loading @ g) ** 2
            return found, found**2 / self.df
        if self.apart is None or self.apart_df is None:
            found = self.variance @ g**2
            return found, found**2 / self.df
        each = self.apart[:, None] * g**2
        return each.sum(axis=0), (each**2 / self.apart_df[:, None]).sum(axis=0)


@dataclass(frozen=True, eq=False)
class Misfit:
    """D(x) of several observations; made by `misfit_of`.

    `scale_known` is False where the variances are known up to a common factor only; `scale_df` are the degrees of
    freedom behind variances that were estimated, infinite where they count as exact. `variance` is that of each
    observation by itself; `sources` tell what it is made of, and what moves observations together.
    """

    observations: tuple[Observation, ...]
    variance: Array
    scatter: Scatter
    scale_df: float = np.inf
    sources: tuple[VarianceSource, ...] = ()
    priors: tuple[Prior, ...] = ()

    @property
    def scale_known(self) -> bool:
        """Whether D itself follows χ², or F with `scale_df`; else only ratios of D mean something."""
        return self.scatter != "misfit"

    @property
    def tests(self) -> bool:
        """Whether the least misfit tests the model: variances known without it, and degrees of freedom left."""
        return self.scatter not in ("misfit", "joint") and self.df > 0

    @property
    def tests_priors(self) -> bool:
        """Whether the least misfit tests the priors alone: the data have told their own scatter."""
        return self.scatter == "joint" and bool(self.priors) and np.isfinite(self.scale_df)

    @cached_property
    def measured(self) -> Array:
        """The measured means."""
        return np.array([observation.measured for observation in self.observations])

    @cached_property
    def beta(self) -> Array:
        """Coefficients, a row per observation."""
        return np.array([observation.surface.beta for observation in self.observations])

    @property
    def k(self) -> int:
        """Number of factors."""
        return len(self.observations[0].surface.names)

    @property
    def df(self) -> int:
        """Observations and priors beyond those needed to fix the factors."""
        return len(self.observations) + len(self.priors) - self.k

    def predict(self, points: Array) -> Array:
        """Return ŷ, (m points, observations)."""
        return np.asarray(term_columns(points) @ self.beta.T)

    def slopes(self, x: Array) -> Array:
        """Return J = ∂ŷ/∂x at one point, (observations, factors)."""
        return np.asarray(self.beta @ term_gradient(x))

    def errors_percent(self, x: Array) -> Array:
        """Return 100·(measured − ŷ)/measured at one point."""
        return np.asarray(100.0 * (self.measured - self.predict(x)[0]) / self.measured)

    def many(self, points: Array) -> Array:
        """Return D at (m, k) points, with what priors add to it."""
        return self.of_data(points) + sum((prior.z(points) ** 2 for prior in self.priors), start=np.zeros(len(points)))

    def of_data(self, points: Array) -> Array:
        """Return D of the observations alone at (m, k) points."""
        gap = self.measured - self.predict(points)
        return np.asarray((gap * self.weighed(gap)).sum(axis=1))

    def log_likelihood(self, points: Array) -> Array:
        """Return the log of the likelihood at (m, k) points, up to a constant, with the density of the priors.

        −D/2 where the variances are known; Student's −((ν + m)/2)·ln(1 + D/ν) where they were estimated with ν degrees
        of freedom; −(m/2)·ln D where they are known up to a common factor alone.
        """
        d, m = self.of_data(points), len(self.observations)
        if not self.scale_known:
            found = -0.5 * m * np.log(np.maximum(d, 1e-300))
        elif np.isfinite(self.scale_df):
            found = -0.5 * (self.scale_df + m) * np.log1p(d / self.scale_df)
        else:
            found = -0.5 * d
        return np.asarray(found + sum(prior.log_density(points) for prior in self.priors))

    @cached_property
    def shared(self) -> Array:
        """U: by how much a standard deviation of what is shared moves each observation, (errors, observations)."""
        found = np.zeros((0, len(self.variance)))
        return np.vstack([found, *(source.loading for source in self.sources if source.loading is not None)])

    @cached_property
    def whole_variance(self) -> Array:
        """The variance of each observation, what it shares with others among it: the diagonal of V."""
        return np.asarray(self.variance + (self.shared**2).sum(axis=0))

    def weighed(self, gap: Array) -> Array:
        """Return V⁻¹r of (m, observations) differences, V = diag(v) + UᵀU: with W = U/v it is r/v − Wᵀ(1 + UWᵀ)⁻¹Wr."""
        scaled = gap / self.variance
        if len(self.shared):
            w = self.shared / self.variance
            scaled = scaled - gap @ w.T @ np.linalg.solve(np.eye(len(w)) + self.shared @ w.T, w)
        return np.asarray(scaled)

    def told_of(self, name: str, x: Array) -> tuple[float, float] | None:
        """Return mean and standard deviation of a shared error z after the fit at x; None where there is none.

        Before it they are 0 and 1. z moves the observations by u, and of it the residuals r tell uᵀV⁻¹r ± √(1 − uᵀQu),
        Q as in `joint_fit.chance_of`. Where z is from 0 ± 1 that mean scatters with 1 − sd², not with 1.
        """
        u = next((source.loading for source in self.sources if source.name == name), None)
        if u is None:
            return None
        told = float(self.weighed(u) @ (self.measured - self.predict(x)[0]))
        return told, max(1.0 - float(u @ self._unfitted(x) @ u), 0.0) ** 0.5

    def value(self, x: Array) -> float:
        """Return D at one point."""
        return float(self.many(x[None, :])[0])

    def gradient(self, x: Array) -> Array:
        """Return ∂D/∂x = −2 Σ (measured − ŷ)/variance·∂ŷ/∂x."""
        weighted = self.weighed(self.measured - self.predict(x)[0])
        found = np.asarray(-2.0 * weighted @ self.slopes(x))
        for prior in self.priors:
            found[prior.j] += 2.0 * float(prior.z(x[None])[0] * prior.slope(x[None])[0])
        return found

    def told(self, x: Array) -> Array:
        """Return ∂z/∂x of the priors at x, (priors, factors): each a measurement of variance 1."""
        rows = np.zeros((len(self.priors), self.k))
        for row, prior in zip(rows, self.priors, strict=True):
            row[prior.j] = prior.slope(x[None])[0]
        return rows

    def information(self, x: Array) -> Array:
        """Return JᵀV⁻¹J + ZᵀZ at x, J = ∂ŷ/∂x, Z = ∂z/∂x of the priors."""
        slopes, told = self.slopes(x), self.told(x)
        return np.asarray(slopes.T @ self.weighed(slopes.T).T + told.T @ told)

    def in_errors(self, x: Array) -> Array:
        """Return how measured means and priors change with the factors at x, in their standard errors."""
        return np.vstack([self.slopes(x) / np.sqrt(self.whole_variance)[:, None], self.told(x)])

    def with_priors(self, priors: Sequence[Prior], region: Region) -> Misfit:
        """Return it with priors; a size of the variances that the misfit tells, it tells without them."""
        if not priors:
            return self
        known = self if self.scale_known else self.scaled(self.value(best_fit(self, region)))
        return replace(known, priors=tuple(priors))

    def objective(self, scale: float = 1.0) -> Objective:
        """Return D/scale as something to make small."""
        return Objective(
            lambda x: self.value(x) / scale,
            lambda x: self.gradient(x) / scale,
            lambda points: self.many(points) / scale,
        )

    def without(self, *left_out: int) -> Misfit:
        """Leave observations out; the others keep their weights."""
        return self.only([i for i in range(len(self.observations)) if i not in left_out])

    def only(self, kept: Sequence[int]) -> Misfit:
        """Keep some of the observations, with their weights."""
        scatter: Scatter = "surface" if not self.scale_known and len(kept) <= self.k else self.scatter
        sources = tuple(source.only(kept) for source in self.sources)
        told = zip(sources, self.sources, strict=True)
        better = sum((new.variance - old.variance[list(kept)] for new, old in told if old.matrix), start=0.0)
        return replace(
            self,
            observations=tuple(self.observations[i] for i in kept),
            variance=self.variance[list(kept)] + better,
            scatter=scatter,
            sources=sources,
        )

    def alone(self, index: int, least: float) -> Misfit:
        """Keep one observation, with the scatter known now that the least misfit of all is `least`."""
        return (self if self.scale_known else self.scaled(least)).only([index])

    def scaled(self, least: float) -> Misfit:
        """Return it with the size of its variances told by its least misfit."""
        variance = np.maximum(self.variance * least / self.df, (_FINEST * self.measured) ** 2)
        return replace(
            self,
            variance=variance,
            scatter="joint",
            scale_df=self.df,
            sources=(VarianceSource("misfit", variance, self.df),),
        )

    def freedom(self, x: Array) -> tuple[Array, Array]:
        """Return for each factor the variance of its estimate over what D says of it, and its degrees of freedom.

        The estimate of factor j is a weighted sum of the observations, g = V⁻¹J(JᵀV⁻¹J)⁻¹eⱼ with J = ∂ŷ/∂x; D takes its
        variance for gᵀVg. What it is adds up over the sources, where V is pooled over each observation's own; the
        degrees of freedom are Satterthwaite's. Where no observation moves with the factor they are those of the whole.
        Priors count as observations of known variance.
        """
        slopes = self.slopes(x)
        weighed = self.weighed(slopes.T).T
        covariance = np.linalg.pinv(self.information(x))
        g, by_priors = weighed @ covariance, ((self.told(x) @ covariance) ** 2).sum(axis=0)
        found = [source.parts(g) for source in self.sources]
        self._of_matrices(found, x, (slopes * g).sum(axis=1))
        variance = sum((part for part, _ in found), start=by_priors)
        doubt = sum((part for _, part in found), start=np.zeros(self.k))
        taken = sum((replace(source, apart=None).parts(g)[0] for source in self.sources), start=by_priors)
        known = (doubt > 0.0) & (taken > 0.0)
        unknown = np.where(by_priors > 0.0, np.inf, self.scale_df)
        df = np.where(known, variance**2 / np.where(known, doubt, 1.0), unknown)
        return np.where(known, variance / np.where(known, taken, 1.0), 1.0), df

    def _of_matrices(self, found: list[tuple[Array, Array]], x: Array, leverage: Array) -> None:
        """Replace the part of each estimated covariance matrix by what the residuals at x make of it.

        p responses of n specimens weigh k factors; the p − k contrasts that are left say by how much the weights are
        off: var θ̂ = (ν + D)/f·gᵀVg of f = ν + k − 1 degrees of freedom, ν = n − p, V = (n − 1)/(ν n)·S. Among other
        observations and errors what is left of each, once these have taken their part, counts to p − k and D: vᵢQᵢᵢ and
        vᵢ(V⁻¹r)ᵢ². There those that scatter little by luck get too much weight: (1 + 2(1 − h/k)/f) times as much with
        the leverage h, to first order, for k = p = 1 as Meier has it. Sources: C. R. Rao, Proc. Fifth Berkeley Symp. 1
        (1967) 355; P. Meier, Biometrics 9 (1953) 59.
        """
        squares = self.variance * self.weighed(self.measured - self.predict(x)[0]) ** 2
        left, rank = self.variance * np.diag(self._unfitted(x)), np.linalg.matrix_rank(self.information(x))
        for i, source in enumerate(self.sources):
            if source.matrix:
                mine, share = source.variance > 0.0, source.variance / self.variance
                contrasts = float(share @ left)
                df = max(source.df + np.count_nonzero(mine) - 1.0 - contrasts, 1.0)
                d = float(share @ squares)
                others = max(1.0 - float(leverage[mine].sum()) / rank, 0.0)
                variance = found[i][0] * (source.df + d) / df * (1.0 + 2.0 * others / df)
                found[i] = variance, variance**2 / df

    def _unfitted(self, x: Array) -> Array:
        """Return Q = V⁻¹ − V⁻¹J(JᵀV⁻¹J)⁻¹JᵀV⁻¹ at x: what the fit leaves of the residuals."""
        weighed = self.weighed(self.slopes(x).T).T
        inverse = self.weighed(np.eye(len(self.measured)))
        return np.asarray(inverse - weighed @ np.linalg.pinv(self.information(x)) @ weighed.T)

    def looseness(self, x: Array) -> float:
        """Return the variance of the observations at x over what D takes it for, their mean.

        A quadratic knows some places better than others, h(x); D has its error at the point that fits best.
        """
        ratio = np.ones_like(self.variance)
        for source in self.sources:
            if source.name == "surface" and source.apart is not None:
                here = np.array([o.error_at(x[None, :]) for o in self.observations])
                there = np.divide(here, source.apart, out=np.ones_like(here), where=source.apart > 0.0)
                ratio += source.variance / self.whole_variance * (there - 1.0)
        return float(ratio.mean())

    def moments(self, x: Array) -> tuple[float, float, float]:
        """Return E = tr(QΩ) of the least misfit, its degrees of freedom tr(QΩ)²/tr(QΩQΩ), and those behind E.

        Q and Ω are those of `joint_fit.chance_of`.
        """
        slopes, told = self.slopes(x), self.told(x)
        weighed, covariance = self.weighed(slopes.T).T, np.linalg.pinv(self.information(x))
        q = self._unfitted(x)
        by_itself = sum((s.variance for s in self.sources if s.loading is None), start=np.zeros_like(self.variance))
        omega, doubt = np.diag(np.maximum(self.variance - by_itself, 0.0)), 0.0  # at least what no force is better than
        for source in self.sources:
            if (u := source.loading) is not None:
                omega += np.outer(u, u)
                doubt += float(u @ q @ u) ** 2 / source.df
            elif source.apart is None or source.apart_df is None:
                omega += np.diag(source.variance)
                doubt += float(np.diag(q) @ source.variance) ** 2 / source.df
            else:
                omega += np.diag(source.apart)
                doubt += float(np.sum((np.diag(q) * source.apart) ** 2 / source.apart_df))
        spread, across = q @ omega, weighed @ covariance @ told.T
        alone = np.eye(len(told)) - told @ covariance @ told.T  # Q among the priors, whose Ω is 1
        expected = float(np.trace(spread) + np.trace(alone))
        squared = np.trace(spread @ spread) + np.trace(alone @ alone) + 2.0 * np.sum(across * (omega @ across))
        return expected, expected**2 / float(squared), expected**2 / max(doubt, 1e-300)


def misfit_of(observations: Sequence[Observation], region: Region | None = None) -> Misfit:
    """Weigh the observations by what is known of their scatter (see the head of this module).

    Within a `region` the surfaces have the error that they have at the point that fits best, where there is one.
    """
    observations = _tested_together(observations)
    found = _weighed_at(observations, None)
    if region is None or found.df < 0 or not found.scale_known:
        return found
    return _weighed_at(observations, best_fit(found, region))


def _tested_together(observations: Sequence[Observation]) -> list[Observation]:
    """Return them with surfaces whose lack of fit does not count where that of all of a kind has a p of 0.25 or more.

    F = Σ SS_L/m² / Σ df_L over Σ SS_E/m² / Σ df_E, m the measured means.
    """
    found = list(observations)
    for kind in dict.fromkeys(o.kind for o in found):
        mine = [i for i, o in enumerate(found) if o.kind == kind]
        sums = np.zeros((2, 2))  # lack of fit and pure error: relative sum of squares, degrees of freedom
        for i in mine:
            rows = {row.source: row for row in found[i].surface.anova}
            lack, pure = rows["Lack of fit"], rows["Pure error"]
            if lack.f is not None:
                sums += [[row.sum_of_squares / found[i].measured ** 2, row.df] for row in (lack, pure)]
        (lack_ss, lack_df), (pure_ss, pure_df) = sums.tolist()
        test = f_test(lack_ss / lack_df, int(lack_df), pure_ss / pure_df, int(pure_df)) if lack_df else None
        if test and test[1] >= POOLED:
            for i in mine:
                found[i] = replace(found[i], surface=found[i].surface.without_lack_of_fit())
    return found


def _weighed_at(observations: Sequence[Observation], point: Array | None) -> Misfit:
    if len({observation.surface.names for observation in observations}) != 1:
        raise UsageError("joint fit: needs one or more surfaces, all over the same factors in the same order")
    measured = np.array([observation.measured for observation in observations])
    spread = np.array([np.nan if o.sd is None else o.sd for o in observations])
    known, k = np.isfinite(spread), len(observations[0].surface.names)
    if not known.any() and len(observations) > k:
        return Misfit(tuple(observations), measured**2, "misfit")
    scatter: Scatter = "measured" if known.all() else "pooled" if known.any() else "surface"
    kinds, n = np.array([o.kind for o in observations]), np.array([o.n or 1 for o in observations])
    own = (spread / measured) ** 2
    variation, freedom = _pooled(own, n - 1, kinds)
    laboratory = variation * measured**2 / n
    errors = np.array([o.error_at(point) for o in observations])
    error_df = np.array([o.error_df for o in observations])
    surface, surface_df = _pooled_errors(errors / measured**2, error_df, kinds)
    surface *= measured**2
    floor = (_FINEST * measured) ** 2
    df = min(
        _satterthwaite([laboratory[kinds == kind], surface[kinds == kind]], [freedom[kind], surface_df[kind]])
        for kind in freedom
    )
    apart = np.where(known & (n > 1), own, variation) * measured**2 / n
    matrices = _matrices(observations)
    together = sum((source.variance for source in matrices), start=np.zeros_like(laboratory))
    laboratory, apart = (np.where(together > 0.0, 0.0, part) for part in (laboratory, apart))
    df = min(df, *(source.df for source in matrices), np.inf)
    moved = dict.fromkeys(name for o in observations for name in o.systematic)
    loadings = {name: np.array([o.systematic.get(name, 0.0) for o in observations]) for name in moved}
    sources = [
        VarianceSource(
            "laboratory",
            np.where(kinds == kind, laboratory, 0.0),
            df,
            apart=np.where(kinds == kind, apart, 0.0),
            apart_df=np.where(known & np.isfinite(df), np.maximum(n - 1, 1), df),
        )
        for kind, df in freedom.items()
        if not np.all(together[kinds == kind] > 0.0)
    ]
    sources += [*matrices, *(VarianceSource.moving(name, u, np.inf) for name, u in loadings.items())]
    sources += [
        VarianceSource(
            "surface",
            np.where(kinds == kind, surface, 0.0),
            df,
            apart=np.where(kinds == kind, errors, 0.0),
            apart_df=np.maximum(error_df, 1),
        )
        for kind, df in surface_df.items()
        if df  # a saturated surface knows no error
    ]
    variance = np.maximum(laboratory + together + surface, floor)
    return Misfit(tuple(observations), variance, scatter, df, tuple(sources))


def _matrices(observations: Sequence[Observation]) -> list[VarianceSource]:
    """Return the covariance matrices of specimens of which several responses were measured.

    V = (n − 1)/(n (n − p))·S and ν = n − p: Student's t of ν degrees of freedom in p dimensions has (1 + D/ν)^(−n/2),
    the likelihood of a mean whose covariance is not known. Raises `UsageError` where n is not above p.
    """
    found = []
    for group in dict.fromkeys(o.specimens for o in observations if o.specimens):
        mine = np.array([o.specimens == group for o in observations])
        n = min(o.n or 1 for o in observations if o.specimens == group)
        df = n - (p := int(mine.sum()))
        if df < 1:
            raise UsageError(f"joint fit: {n} specimens do not tell how {p} responses vary together; {p + 1} do")
        squares = np.array([(o.sd or 0.0) ** 2 for o in observations])
        found.append(VarianceSource("laboratory", mine * squares * (n - 1) / (df * n), df, matrix=True))
    return found


def _pooled(variation: Array, freedom: NDArray[np.int_], kinds: NDArray[np.str_]) -> tuple[Array, dict[str, float]]:
    """Return the squared coefficients of variation, one for each kind, and the degrees of freedom behind them.

    A kind without any sd takes that of all others. Where the number of specimens of an sd is not told each value keeps
    its own, which counts as known. Without any sd they are zero.
    """
    pooled, behind = variation.copy(), {}
    known = np.isfinite(variation)
    for kind in np.unique(kinds).tolist():
        mine = kinds == kind
        own = mine & known if np.any(mine & known) else known
        counted = bool(own.any() and np.all(freedom[own] > 0))
        typical = float(np.average(variation[own], weights=freedom[own] if counted else None)) if own.any() else 0.0
        pooled[mine if counted else mine & ~known] = typical
        behind[kind] = float(freedom[own].sum()) if counted else np.inf
    return pooled, behind


def _pooled_errors(errors: Array, df: NDArray[np.int_], kinds: NDArray[np.str_]) -> tuple[Array, dict[str, float]]:
    """Return relative variances of surfaces, one for each kind, and the degrees of freedom behind them.

    A surface of few degrees of freedom does not know its error: weighed by its own each fit would follow the surfaces
    that are sharp by luck.
    """
    pooled, behind = errors.copy(), {}
    for kind in np.unique(kinds).tolist():
        mine = kinds == kind
        behind[kind] = float(df[mine].sum())
        if behind[kind]:
            pooled[mine] = np.average(errors[mine], weights=df[mine])
    return pooled, behind


def _satterthwaite(parts: Sequence[Array], freedom: Sequence[float]) -> float:
    """Return the degrees of freedom of variances that are sums of parts, by the mean share of each part."""
    total = np.sum(parts, axis=0)
    shares = [float(np.mean(np.divide(part, total, out=np.zeros_like(total), where=total > 0.0))) for part in parts]
    doubt = sum(share**2 / df for share, df in zip(shares, freedom, strict=True) if share > 0.0)
    return 1.0 / doubt if doubt > 0.0 else np.inf


def best_fit(misfit: Misfit, region: Region) -> Array:
    """Return the point of the region with the least misfit."""
    cloud = region.cloud(_CLOUD)
    return optimise(misfit.objective(scale_of(misfit, cloud)), cloud, region)[0]


def scale_of(misfit: Misfit, points: Array) -> float:
    """Return a typical misfit, to bring what is minimised to order one."""
    return max(float(np.median(misfit.many(points))), 1e-300)
