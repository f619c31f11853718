"""Observations, each a measured mean with its surface, and draws of their errors for the joint fit.

The variances of the errors are estimated from few specimens and few runs. Therefore the fit averages its likelihood
over a sample of their possible values, a Latin hypercube: each unknown is drawn at the midpoints of equal parts of its
distribution, in a random order (M. D. McKay and others, Technometrics 21 (1979) 239).

Specimens
    (n − 1) s²/σ² has the distribution χ²(n − 1). The relative variances of several conditions are similar but not
    equal: σᵢ² ~ d₀ τ²/χ²(d₀), so that s²/τ² ~ F(n − 1, d₀), with τ and d₀ estimated from all conditions (G. K. Smyth,
    Stat. Appl. Genet. Mol. Biol. 3 (2004) 3). The standard deviation of ln σᵢ, about 1/√(2 d₀), has a uniform prior
    from 0 to `_MOST_APART`.

Surfaces
    The error of a surface at any point, relative to the mean of its runs, is c + u: c is common to all conditions, u
    separate, with variances σ_c² and σ_u². Let Q be a basis of the space orthogonal to the terms X, QᵀX = 0. The
    contrasts z = Qᵀy of the runs have cov z = σ_c² QᵢᵀQⱼ + [i = j](σ_u² 1 + σ_E² Qᵀ R⁻¹ Q), with σ_E² the variance of
    a single run and R the number of runs at each point. ln σ_c and ln σ_u have uniform priors between `FINEST` and
    `COARSEST`; without residual degrees of freedom these are also the posterior distributions.

Sections of one surface over factors and conditions
    The errors of the sections are correlated. With aᵢ the weights of the runs in the prediction of section i, their
    covariance is σ_u²([i = j] + aᵢᵀaⱼ) + σ_E² aᵢᵀR⁻¹aⱼ, and σ_c = 0. For a surface of ln y it is relative to ŷ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array
from stemcal.doe.coding import term_columns
from stemcal.doe.regression.least_squares import same_points
from stemcal.doe.regression.section import AnySurface, SeveralSurfaces
from stemcal.doe.regression.surface import Surface
from stemcal.errors import UsageError
from stemcal.vocabulary import FIRST

_DRAWS, _MANY = 512, 64  # number of draws; a quarter of it for more than `_MANY` means
FINEST, COARSEST = 1e-4, 0.1
"""Bounds of the relative error of a surface. `FINEST` also bounds that of a mean; large contrasts raise the other."""
_MOST_APART = 1.0
_STEPS, _SHAPES = 48, 8  # number of grid points of ln σ; `_SHAPES`: of d₀
_COMMON_SHAPE = 1e6  # d₀ if all conditions have the same variance; also the degrees of freedom of a known variance
_WIDTH = 6.0  # half-width of the grid of ln τ²
_NO_CONTRAST = 1e-9  # smaller eigenvalues of a sum of projection matrices are zero


class Uniforms:
    """Generates columns of a Latin hypercube: evenly spread numbers from 0 to 1 in random order, from a fixed seed."""

    def __init__(self, draws: int = _DRAWS) -> None:
        self._random, self.draws = np.random.default_rng(20_251), draws

    def __call__(self) -> Array:
        return np.asarray((self._random.permutation(self.draws) + 0.5) / self.draws)


def _chi_squared(u: Array, df: float) -> Array:
    from scipy.special import gammaincinv

    return np.asarray(2.0 * gammaincinv(0.5 * df, u))


def variances(squared: Array, df: Array, uniform: Uniforms) -> Array:
    """Draw variances σᵢ², (draws, m), given estimates s² (NaN: none) with `df` degrees of freedom (inf: exact s²)."""
    uncertain = np.isfinite(squared) & (squared > 0.0)
    known = (uncertain & np.isinf(df)) | (squared == 0.0)
    counted = np.where(uncertain, np.minimum(df, _COMMON_SHAPE), 0.0)
    s2 = np.where(uncertain, squared, 0.0)
    if len(squared) == 1:
        shape, scale = np.zeros(uniform.draws), np.ones(uniform.draws)
    else:
        shape, scale = _alike(s2[uncertain], counted[uncertain], uniform)
    drawn = np.tile(squared, (uniform.draws, 1))
    for i in np.flatnonzero(~known):
        drawn[:, i] = (shape * scale + counted[i] * s2[i]) / _chi_squared(uniform(), shape + counted[i])
    return drawn


def _alike(s2: Array, df: Array, uniform: Uniforms) -> tuple[Array, Array]:
    """Draw d₀ and τ² on a grid from p ∝ Π f(s²/τ²; df, d₀)/τ²: f is the F density, and ln τ uniform a priori."""
    from scipy.special import betaln

    apart = np.linspace(0.0, _MOST_APART, _SHAPES)
    d0 = np.append(_COMMON_SHAPE, 0.5 / apart[1:] ** 2)
    grid = np.log(np.average(s2, weights=df)) + np.linspace(-_WIDTH, _WIDTH, 8 * _STEPS)
    x, a, b = s2 / np.exp(grid)[:, None], 0.5 * df, 0.5 * d0[:, None, None]
    density = a * np.log(df) + b * np.log(2.0 * b) + a * np.log(x) - (a + b) * np.log(df * x + 2.0 * b) - betaln(a, b)
    d, t = _drawn(density.sum(axis=2), uniform)
    step = grid[1] - grid[0]
    return d0[d], np.exp(grid[t] + step * (uniform() - 0.5))


def _drawn(log_density: Array, uniform: Uniforms) -> tuple[Array, Array]:
    """Draw grid points with probabilities exp(`log_density`); return their row and column indices, (draws,) each."""
    p = np.exp(log_density - log_density.max()).ravel()
    places = np.searchsorted(np.cumsum(p) / p.sum(), uniform()).clip(max=p.size - 1)
    rows, columns = np.unravel_index(places, log_density.shape)
    return np.asarray(rows), np.asarray(columns)


@dataclass(frozen=True, eq=False)
class Contrasts:
    """Contrasts and pure errors of the runs of m surfaces of one response, from which the surface errors are drawn."""

    maps: Array  # (m surfaces, points, terms): a = maps·φ are the weights of the design points in the prediction at φ
    runs: Array  # (m, points): number of runs at each design point
    scale: Array  # mean response of each surface, to which everything is relative
    counts: Array  # number of contrasts Qᵀy in each group of contrasts with the same variance
    z2: Array  # sum of squares of the contrasts of each group
    common: Array  # variance of a contrast of each group for σ_c² = 1
    noise: Array  # variance of a contrast of each group for σ_E² = 1
    pure: Array  # pure-error variance of each surface
    pure_df: Array
    sections: SeveralSurfaces | None = None  # the sections, if all are sections of one surface

    @classmethod
    def of(cls, surfaces: Sequence[AnySurface]) -> Contrasts:
        """Compute the contrasts of surfaces of one response, or of sections of one surface, which share its runs."""
        together = SeveralSurfaces(surfaces)
        if not together.sections:
            return cls._of_each([s for s in surfaces if isinstance(s, Surface)])
        first, m = together.sections[0], len(surfaces)
        contrasts = cls._of_each([first.whole])
        if first.logarithm:
            size = contrasts.scale[0] ** 2
            contrasts = replace(contrasts, scale=np.ones(1), z2=size * contrasts.z2, pure=size * contrasts.pure)
        maps, runs, scale = (np.repeat(part, m, axis=0) for part in (contrasts.maps, contrasts.runs, contrasts.scale))
        return replace(contrasts, maps=maps, runs=runs, scale=scale, sections=together)

    @classmethod
    def _of_each(cls, surfaces: Sequence[Surface]) -> Contrasts:
        point = same_points(np.vstack([s.design for s in surfaces]))
        places = np.split(point, np.cumsum([len(s.design) for s in surfaces])[:-1])
        count, p, m = int(point.max()) + 1, len(surfaces[0].beta), len(surfaces)
        maps, runs, bases = np.zeros((m, count, p)), np.zeros((m, count)), np.zeros((m, count, p))
        scale, pure, pure_df = np.ones(m), np.full(m, np.nan), np.zeros(m)
        residuals, free, noise = np.zeros((m, count)), np.zeros(m), np.zeros(m)
        for i, (s, place) in enumerate(zip(surfaces, places, strict=True)):
            x, size = term_columns(s.design), np.bincount(place, minlength=count)
            np.add.at(maps[i], place, x @ s.unscaled_covariance)
            scale[i], runs[i], there = float(np.mean(np.abs(s.response))) or 1.0, size, np.flatnonzero(size)
            means = np.bincount(place, s.response, minlength=count)[there] / size[there]
            kept = np.flatnonzero(np.diag(s.unscaled_covariance) > 0.0)
            q = np.linalg.qr(x[np.unique(place, return_index=True)[1]][:, kept])[0]
            bases[i, there, : len(kept)], residuals[i, there] = q, (means - q @ (q.T @ means)) / scale[i]
            free[i], noise[i] = len(there) - len(kept), ((1.0 - (q**2).sum(axis=1)) / size[there]).sum()
            if len(place) > len(there):
                pure_df[i] = len(place) - len(there)
                apart = s.response - (np.bincount(place, s.response, minlength=count) / np.maximum(size, 1))[place]
                pure[i] = float(apart @ apart) / pure_df[i] / scale[i] ** 2
        counts, z2, common, noise = _groups_of(residuals, bases, runs, free, noise)
        return cls(maps, runs, scale, counts, z2, common, noise, pure, pure_df)

    def only(self, kept: Sequence[int]) -> Contrasts:
        """Return a copy with the weights and scales of the surfaces `kept` only, but the contrasts of all."""
        parts = {name: getattr(self, name)[kept] for name in ("maps", "runs", "scale")}
        sections = self.sections and SeveralSurfaces([self.sections.sections[i] for i in kept])
        return replace(self, **parts, sections=sections)

    def by_chance(self, uniform: Uniforms) -> Array:
        """Draw σ_E², the variance of a single run, (draws, m); zero without pure error."""
        if not np.any(self.pure > 0.0):
            return np.zeros((uniform.draws, len(self.scale)))
        drawn = variances(np.where(self.pure_df > 0.0, self.pure, np.nan), self.pure_df, uniform)
        return np.repeat(drawn, len(self.scale), axis=1) if self.sections else drawn

    def missed(self, chance: Array, uniform: Uniforms) -> tuple[Array, Array]:
        """Draw σ_c² and σ_u², (draws,) each, given draws of σ_E²; a single surface has σ_c = 0."""
        noise = float(np.median(chance.mean(axis=1))) * self.noise
        # upper limit: three times the largest of ν contrasts, which is about ν^¼ times their root mean square
        most = max(COARSEST, 3.0 * float(np.sqrt(np.max(self.z2 / np.sqrt(self.counts), initial=0.0))))
        grid = np.linspace(np.log(FINEST), np.log(most), _STEPS)
        separate = np.exp(2.0 * grid)
        common = np.zeros(1) if len(self.scale) == 1 or self.sections else separate
        v = common[:, None, None] * self.common + separate[:, None] + noise
        c, u = _drawn(-0.5 * (self.counts * np.log(v) + self.z2 / v).sum(axis=2), uniform)
        shift = 2.0 * (grid[1] - grid[0])
        return common[c] * np.exp(shift * (uniform() - 0.5)), separate[u] * np.exp(shift * (uniform() - 0.5))

    def leverages(self, point: Array) -> tuple[Array, Array]:
        """Return Kᵢⱼ = 1 + aᵢᵀaⱼ and Nᵢ = aᵢᵀR⁻¹aᵢ at a point: cov = σ_c² K + σ_u² diag K + σ_E² diag N."""
        a = self._weights(point)
        return 1.0 + a @ a.T, (a**2 / np.maximum(self.runs, 1.0)).sum(axis=1)

    def _weights(self, point: Array) -> Array:
        """Return the weights a of the design points in the prediction of each surface at a point, (m, points)."""
        if self.sections is None:
            return np.asarray(self.maps @ term_columns(point)[0])
        return np.asarray(np.einsum("mpt,mt->mp", self.maps, self.sections.terms(point)[0]))

    def covariance(self, point: Array, common: Array, separate: Array, chance: Array) -> Array:
        """Return the covariance of the errors of the surfaces at a point for each draw, (draws, m, m)."""
        k, n = self.leverages(point)
        diagonal, scale = np.arange(len(k)), self.scale
        if self.sections is not None:
            a = self._weights(point)
            part = separate[:, None, None] * (np.eye(len(a)) + a @ a.T)
            part += chance[:, :1, None] * ((a / np.maximum(self.runs, 1.0)) @ a.T)
            if self.sections.sections[0].logarithm:
                scale = self.sections.predict(point)[0]
        else:
            part = common[:, None, None] * k
            part[:, diagonal, diagonal] += separate[:, None] * np.diag(k) + chance * n
        part *= np.outer(scale, scale)
        return np.asarray(part)


def _groups_of(residuals: Array, bases: Array, runs: Array, free: Array, noise: Array) -> tuple[Array, ...]:
    """Return the fields counts, z2, common and noise of `Contrasts`, (groups,) each.

    Surface i has the `residuals` eᵢ = Mᵢyᵢ at the points, with Mᵢ = 1 − BᵢBᵢᵀ and B the `bases` (m, points, terms). The
    number of its contrasts is `free`; the sum of their variances for σ_E² = 1 is `noise`.

    If all m surfaces have the same design, M is the same for all. Along a unit vector u, the contrast uᵀΣeᵢ/√m of all
    surfaces then has the variance m for σ_c² = 1; the m − 1 contrasts orthogonal to it have none. With r the smallest
    number of runs at a point and D = 1/r − R⁻¹, the variance for σ_E² = 1 is 1/r − s² along the left singular vectors
    of M√D, whose singular values are s, and 1/r along all other u.
    """
    total, m = residuals.sum(axis=0), len(residuals)
    if np.array_equal(runs, np.broadcast_to(runs[0], runs.shape)) and np.allclose(bases, bases[0]):
        fewest = 1.0 / runs[0][runs[0] > 0.0].min()
        more = np.flatnonzero((runs[0] > 0.0) & (1.0 / np.maximum(runs[0], 1.0) < fewest))
        columns = -bases[0] @ bases[0][more].T
        columns[more, np.arange(len(more))] += 1.0
        u, s, _ = np.linalg.svd(columns * np.sqrt(fewest - 1.0 / runs[0][more]), full_matrices=False)
        u, s = u[:, s**2 > _NO_CONTRAST], s[s**2 > _NO_CONTRAST]
        along = np.vstack([(total @ u) ** 2 / m, ((residuals @ u) ** 2).sum(axis=0)])
        along = np.column_stack([along, np.array([total @ total / m, (residuals**2).sum()]) - along.sum(axis=1)])
        size = np.append(np.ones(len(s)), free[0] - len(s))
        counts, z2 = np.concatenate([size, (m - 1.0) * size]), np.concatenate([along[0], along[1] - along[0]])
        common, scatter = np.repeat([float(m), 0.0], len(size)), np.tile(np.append(fewest - s**2, fewest), 2)
    else:
        projectors = np.eye(len(total)) * (runs > 0.0)[:, None] - bases @ bases.transpose(0, 2, 1)
        values, vectors = np.linalg.eigh(projectors.sum(axis=0))
        values, vectors = values[values > _NO_CONTRAST], vectors[:, values > _NO_CONTRAST]
        z2, seen = (total @ vectors) ** 2 / values, (projectors @ vectors) ** 2 / np.maximum(runs, 1.0)[:, :, None]
        scatter, rest = seen.sum(axis=(0, 1)) / values, max(free.sum() - len(values), 1.0)
        counts, z2 = np.append(np.ones(len(values)), rest), np.append(z2, (residuals**2).sum() - z2.sum())
        common, scatter = np.append(values, 0.0), np.append(scatter, (noise.sum() - scatter.sum()) / rest)
    groups = np.array([counts, z2, common, scatter])
    return tuple(groups[:, counts > 0.5].clip(min=0.0))


Scatter = Literal["measured", "pooled", "misfit", "surface"]
_WIDEST = 1.0  # largest relative standard deviation of a mean that is estimated from the misfit


@dataclass(frozen=True, eq=False)
class Observation:
    """A measured mean with the surface that predicts it.

    Observations with the same name `specimens` were measured on the same specimens. Their means have one unknown
    covariance matrix, whose estimate is diagonal.
    """

    surface: AnySurface
    measured: float
    sd: float | None = None  # standard deviation of the specimens
    n: int | None = None  # number of specimens; if None, the standard deviation is taken as known
    kind: str = FIRST  # name of the response that was measured
    specimens: str = ""


@dataclass(frozen=True, eq=False)
class Errors:
    """Draws of the errors of m observations.

    `surfaces` has for each kind of response the indices of its observations, the contrasts, and draws of σ_c², σ_u² and
    σ_E². The `scatter` of the means is measured for each, pooled, estimated from the misfit, or unknown (``surface``).
    """

    laboratory: Array  # covariance of the measured means, (draws, m, m)
    surfaces: tuple[tuple[NDArray[np.intp], Contrasts, Array, Array, Array], ...]
    scatter: Scatter

    @property
    def surface_error_known(self) -> bool:
        """Whether the surfaces of each kind have residual degrees of freedom, from which their errors are estimated."""
        return all(len(contrasts.counts) > 0 for _, contrasts, *_ in self.surfaces)

    def at(self, x: Array) -> Array:
        """Return the covariance V of the errors at a point for each draw, (draws, m, m)."""
        covariance = self.laboratory.copy()
        for mine, contrasts, common, separate, chance in self.surfaces:
            covariance[:, mine[:, None], mine] += contrasts.covariance(x, common, separate, chance)
        return covariance


def errors_of(observations: Sequence[Observation], spare: int) -> Errors:
    """Draw the errors of observations; `spare` is the number of observations minus the number of factors.

    If no standard deviation was measured and `spare` > 0, the scatter is estimated from the misfit.
    """
    m = len(observations)
    uniform = Uniforms(_DRAWS if m <= _MANY else _DRAWS // 4)
    measured = np.array([o.measured for o in observations])
    n = np.array([o.n or 1 for o in observations])
    cv2 = np.array([np.nan if o.sd is None else (o.sd / o.measured) ** 2 for o in observations])
    df = np.where(n > 1, n - 1.0, np.inf)
    known = np.isfinite(cv2)
    scatter: Scatter = "measured" if known.all() else "pooled" if known.any() else "misfit" if spare > 0 else "surface"
    kinds = np.array([o.kind for o in observations])
    if scatter == "misfit":
        even = np.exp(np.log(FINEST) + (np.log(_WIDEST) - np.log(FINEST)) * uniform())
        relative = np.repeat(even[:, None] ** 2, m, axis=1)
    elif scatter == "surface":
        relative = np.full((uniform.draws, m), FINEST**2)
    else:
        whole = all(known[kinds == kind].any() for kind in set(kinds.tolist()))
        relative = np.empty((uniform.draws, m))
        for group in dict.fromkeys(kinds.tolist()) if whole else [""]:
            mine = kinds == group if whole else np.full(m, True)
            relative[:, mine] = variances(cv2[mine], df[mine], uniform) / n[mine]
    laboratory = np.zeros((uniform.draws, m, m))
    laboratory[:, np.arange(m), np.arange(m)] = relative * measured**2
    groups = list(dict.fromkeys(o.specimens for o in observations if o.specimens))
    for group in groups:
        mine = np.flatnonzero([o.specimens == group for o in observations])
        factors = len(observations[0].surface.names) / len(groups)
        laboratory[:, mine[:, None], mine] = _of_specimens([observations[i] for i in mine.tolist()], factors, uniform)
    surfaces = []
    for kind in dict.fromkeys(kinds.tolist()):
        mine = np.flatnonzero(kinds == kind)
        contrasts = Contrasts.of([observations[i].surface for i in mine.tolist()])
        chance = contrasts.by_chance(uniform)
        surfaces.append((mine, contrasts, *contrasts.missed(chance, uniform), chance))
    return Errors(laboratory, tuple(surfaces), scatter)


def _of_specimens(observations: Sequence[Observation], factors: float, uniform: Uniforms) -> Array:
    """Draw the covariance matrix of the means of p responses measured on the same n specimens, (draws, p, p).

    Σ⁻¹ has a Wishart distribution with scale matrix S⁻¹ and n − 2 − p + 2k degrees of freedom, if the means determine
    k ≤ p `factors`. The intervals of the factors then equal those of C. R. Rao (Proc. Fifth Berkeley Symp. 1 (1967)
    355), with Student's t for n − 1 − p + k degrees of freedom. A draw is S^(−1/2) A Aᵀ S^(−1/2) with a triangular
    matrix A of normal and χ variables (M. S. Bartlett, Proc. R. Soc. Edinb. 53 (1933) 260).
    """
    from scipy.special import ndtri

    p, n = len(observations), min(o.n or 1 for o in observations)
    if n <= p:
        raise UsageError(
            f"joint fit: {n} specimens are too few to estimate the covariance of {p} responses; "
            f"measure at least {p + 1} specimens"
        )
    df = max(n - 2.0 - p + 2.0 * min(factors, p), float(p))
    a = np.zeros((uniform.draws, p, p))
    for i in range(p):
        a[:, i, i] = np.sqrt(_chi_squared(uniform(), df - i))
        for j in range(i):
            a[:, i, j] = ndtri(uniform())
    root = np.array([max(o.sd or 0.0, FINEST * o.measured) for o in observations]) * ((n - 1.0) / n) ** 0.5
    return np.asarray(np.linalg.inv(a @ a.transpose(0, 2, 1)) * np.outer(root, root))
