"""What the measured forces leave possible: samples of the parameters, with the priors of the factors that have one
and uniform ones over the region.

The log likelihood of a point is −D/2 where the variances are known. Where they were estimated with ν degrees of freedom
their common factor is integrated out under Jeffreys' prior: −((ν + m)/2)·ln(1 + D/ν), Student's t; where they are known
up to that factor alone, −(m/2)·ln D. Outside the region it is −∞. Where several variances were estimated each for
itself (the laboratory's, the surfaces', what the place of the mesh adds), each is integrated out by itself: it is
drawn as s²·ν/χ²(ν), and the likelihood, |V|^(−1/2)·exp(−D/2), is the mean over the draws. One factor common to all
would take the weights of the observations for known. The diameters need not scatter alike, and a few specimens do not
show it: σᵢ² ~ ν₀σ²/χ²(ν₀), the hierarchical model of G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004), article 3.
How alike they are, ν₀, the sd measured tell too: σ² and ν₀ are drawn from what these leave possible, and of each
diameter (ν₀σ² + νᵢsᵢ²)/χ²(ν₀ + νᵢ). Before the data σ is even, and 1/√ν₀ from 0 to 1: standard deviations, as A. Gelman
advises, Bayesian Analysis 1 (2006) 515.
Sampled by the affine-invariant ensemble of Goodman and Weare, Comm. Appl. Math. Comp. Sci. 5 (2010) 65–80, in
emcee: Foreman-Mackey et al., PASP 125 (2013) 306–312. Walkers start where importance resampling of points that
fill the region puts them, so that every branch of the solution set has some. The same data give the same samples.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.calibration.misfit import Misfit, VarianceSource
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

WALKERS, STEPS, BURN_IN = 40, 2000, 500
_CLOUD, _SEED = 13, 20_011
_NO_PART = 1e-9  # a source below this part of the variance is rounding
_DRAWS = 8  # 2^8 draws of the variances
_ALIKE = np.linspace(0.98, 0.02, 25) ** -2.0  # ν₀ of σᵢ² ~ ν₀σ²/χ²(ν₀): how alike the diameters scatter
_SIZES = np.exp(np.linspace(-5.0, 3.0, 81))  # σ² over the pooled variance, which few specimens do not bound from above


@dataclass(frozen=True, eq=False)
class Posterior:
    """Samples in coded units, (samples, factors), and how well they were drawn.

    `length` is that of the chains in autocorrelation times, `effective` the number of independent samples that they
    are worth.
    """

    names: tuple[str, ...]
    samples: Array
    acceptance: float
    length: float
    effective: float

    @property
    def mean(self) -> Array:
        """Posterior mean of each factor."""
        return np.asarray(self.samples.mean(axis=0))

    @property
    def sd(self) -> Array:
        """Posterior standard deviation of each factor."""
        return np.asarray(self.samples.std(axis=0, ddof=1))

    @property
    def correlation(self) -> Array:
        """Correlations between the factors."""
        return np.atleast_2d(np.corrcoef(self.samples, rowvar=False))

    def interval(self, level: float = 0.95) -> Array:
        """Equal-tailed credible intervals, (factors, 2)."""
        tail = 50.0 * (1.0 - level)
        return np.asarray(np.percentile(self.samples, [tail, 100.0 - tail], axis=0).T)

    def thinned(self, count: int) -> Array:
        """Return that many samples, evenly taken, for a corner plot."""
        keep = np.linspace(0, len(self.samples) - 1, min(count, len(self.samples))).round().astype(int)
        return np.asarray(self.samples[keep])


def sample_posterior(misfit: Misfit, region: Region, steps: int = STEPS, burn_in: int = BURN_IN) -> Posterior:
    """Draw from the posterior.

    Raises
    ------
    UsageError
        If emcee is not installed.
    """
    try:
        from emcee import EnsembleSampler, State
    except ImportError:
        raise UsageError('invert.posterior needs emcee; install it with pip install "stemcal[bayes]"') from None
    random = np.random.default_rng(_SEED)
    walkers = max(WALKERS, 4 * region.k)
    sampler = EnsembleSampler(walkers, region.k, density_of(misfit, region), vectorize=True)
    start = State(_starts(misfit, region, walkers, random), random_state=np.random.RandomState(_SEED).get_state())
    burnt = sampler.run_mcmc(start, burn_in, skip_initial_state_check=True)
    sampler.reset()
    sampler.run_mcmc(burnt, steps)
    time = max(float(np.max(sampler.get_autocorr_time(tol=0, quiet=True))), 1.0)
    return Posterior(
        names=misfit.observations[0].surface.names,
        samples=np.asarray(sampler.get_chain(flat=True)),
        acceptance=float(np.mean(sampler.acceptance_fraction)),
        length=steps / time,
        effective=steps * walkers / time,
    )


def log_posterior(misfit: Misfit, region: Region, points: Array) -> Array:
    """Return the log density at (m, k) coded points, up to a constant."""
    return density_of(misfit, region)(points)


def density_of(misfit: Misfit, region: Region) -> Callable[[Array], Array]:
    """Return the log density as a function of (m, k) coded points; what the variances may be is drawn once."""
    sources = [source for source in misfit.sources if np.any(source.variance > _NO_PART * misfit.variance)]
    known = replace(misfit, sources=tuple(sources))
    several = misfit.meshed or sum(np.isfinite(s.df) for s in sources) > 1 or any(_told_apart(s).any() for s in sources)
    drawn = _drawn_variances(known) if misfit.scale_known and several else None

    def density(points: Array) -> Array:
        if drawn is None:
            found = _log_likelihood(misfit, misfit.of_data(points))
        else:
            found = _mean_log_likelihood(known, *drawn, points)
        for prior in misfit.priors:
            found = found + prior.log_density(points)
        return np.where(region.contains(points), found, -np.inf)

    return density


def _mean_log_likelihood(misfit: Misfit, own: Array, shared: Array, points: Array) -> Array:
    """Return the log of the likelihood's mean over draws of variances (draws, observations) and of what is shared.

    With LLᵀ = 1 + U diag(1/v) Uᵀ, Woodbury's formula takes |L⁻¹U diag(1/v) r|² off Σ r²/v.
    """
    gap = misfit.measured - misfit.predict(points)
    w = shared / own[:, None, :]
    root = np.linalg.cholesky(np.eye(shared.shape[1]) + w @ shared.swapaxes(1, 2))
    found = (gap**2) @ (1.0 / own).T
    for row in np.linalg.solve(root, w).swapaxes(0, 1):
        found -= (gap @ row.T) ** 2
    found += np.log(own).sum(axis=1) + 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    found *= -0.5
    most = found.max(axis=1, keepdims=True)
    found -= most
    return np.asarray(np.log(np.exp(found, out=found).sum(axis=1)) + most[:, 0])


def _drawn_variances(misfit: Misfit) -> tuple[Array, Array]:
    """Return variances (draws, observations) and U of what is shared (draws, errors, observations): always the same."""
    from scipy.stats.qmc import Sobol

    needed = np.cumsum([0, *(2 + int(_told_apart(source).sum()) for source in misfit.sources)])
    even = 1.0 - (Sobol(int(needed[-1]), scramble=False).random_base2(_DRAWS) + 0.5 / 2**_DRAWS)
    of_mesh = [None if source.loading is None else misfit.own_part(source) for source in misfit.sources]
    drawn = []
    for source, mesh, first, last in zip(misfit.sources, of_mesh, needed, needed[1:], strict=False):
        part = 0.0 if mesh is None else misfit.sources[mesh].variance / source.conditions
        drawn.append(_drawn_of(replace(source, variance=source.variance + part), even[:, first:last]))
    own, shared = np.zeros_like(drawn[0]), []
    for variance, source, beside in zip(drawn, misfit.sources, of_mesh, strict=True):
        if source.loading is None:
            own += variance
        else:  # c² = (MS − s²)/D: what is drawn is MS
            c2 = np.maximum(variance - (0.0 if beside is None else drawn[beside] / source.conditions), 0.0)
            shared.append(np.sign(source.loading) * np.sqrt(c2))
    return np.maximum(own, np.finfo(float).tiny), np.array(shared).reshape(-1, *own.shape).swapaxes(0, 1)


def _told_apart(source: VarianceSource) -> NDArray[np.bool_]:
    """Tell of which observations the source has a variance of their own beside the pooled one."""
    if source.name != "laboratory" or source.apart_df is None or not np.isfinite(source.df):
        return np.zeros(len(source.variance), dtype=bool)
    return np.asarray((source.variance > 0.0) & (source.apart_df < source.df))


def _drawn_of(source: VarianceSource, even: Array) -> Array:
    """Draw the variance of a source at even numbers, (draws, 2 or more): s²·ν/χ²(ν), or of each diameter its own."""
    from scipy.special import chdtri

    told = _told_apart(source)
    if not told.any():
        factor = source.df / chdtri(source.df, even[:, :1]) if np.isfinite(source.df) else np.ones((len(even), 1))
        return np.asarray(source.variance * factor)
    assert source.apart is not None and source.apart_df is not None
    ratio, df = source.apart[told] / source.variance[told], source.apart_df[told]
    size, alike = _populations(ratio, df, even[:, 0])
    found = np.tile(source.variance, (len(even), 1))
    found[:, ~told] *= size * alike / chdtri(alike, even[:, 1:2])
    found[:, told] *= (alike * size + df * ratio) / chdtri(alike + df, even[:, 2:])
    return found


def _populations(ratio: Array, df: Array, even: Array) -> tuple[Array, Array]:
    """Draw σ² and ν₀ of σᵢ² ~ ν₀σ²/χ²(ν₀), (draws, 1) each, from variances sᵢ² of νᵢ degrees of freedom each.

    sᵢ²/σ² follows F(νᵢ, ν₀), whose logarithm in σ² and ν₀ is −ln B(νᵢ/2, ν₀/2) − (νᵢ/2)·ln(ν₀σ²) − ((νᵢ + ν₀)/2)·ln(1 +
    νᵢsᵢ²/(ν₀σ²)).
    """
    from scipy.special import betaln

    alike, size = (grid.reshape(-1, 1) for grid in np.meshgrid(_ALIKE, _SIZES, indexing="ij"))
    whole = alike * size
    log = -betaln(0.5 * df, 0.5 * alike) - 0.5 * df * np.log(whole) - 0.5 * (df + alike) * np.log1p(df * ratio / whole)
    log = log.sum(axis=1) + 0.5 * np.log(size[:, 0])
    below = np.cumsum(np.exp(log - log.max()))
    chosen = np.searchsorted(below, even * below[-1])
    return size[chosen], alike[chosen]


def _log_likelihood(misfit: Misfit, found: Array) -> Array:
    m, df = len(misfit.measured), misfit.scale_df
    if not misfit.scale_known:
        return np.asarray(-0.5 * m * np.log(np.maximum(found, 1e-300)))
    if np.isfinite(df):
        return np.asarray(-0.5 * (df + m) * np.log1p(found / df))
    return np.asarray(-0.5 * found)


def _starts(misfit: Misfit, region: Region, walkers: int, random: np.random.Generator) -> Array:
    """Resample points that fill the region by their posterior; a little apart, so that no two coincide."""
    cloud = region.spread(_CLOUD)
    density = log_posterior(misfit, region, cloud)
    weight = np.exp(density - density.max())
    chosen = cloud[random.choice(len(cloud), size=walkers, p=weight / weight.sum())]
    low, high = region.bounds()
    apart = chosen + 1e-3 * (high - low) * random.standard_normal(chosen.shape)
    return np.array([region.nearest(x) for x in apart])
