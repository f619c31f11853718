"""What the measured forces leave possible: samples of the parameters, with the priors of the factors that have one
and uniform ones over the region.

The log likelihood of a point is −D/2 where the variances are known. Where they were estimated with ν degrees of freedom
their common factor is integrated out under Jeffreys' prior: −((ν + m)/2)·ln(1 + D/ν), Student's t; where they are known
up to that factor alone, −(m/2)·ln D. Outside the region it is −∞. Where several variances were estimated each for
itself (the laboratory's, the surfaces', what the place of the mesh adds), each is integrated out by itself: it is
drawn as s²·ν/χ²(ν), and the likelihood, |V|^(−1/2)·exp(−D/2), is the mean over the draws. One factor common to all
would take the weights of the observations for known. The diameters need not scatter alike, and a few specimens do not
show it: the variance of each lies about the pooled one by a scaled inverse χ² of `ALIKE` degrees of freedom, so what is
drawn is the moderated variance of G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004), article 3.
Sampled by the affine-invariant ensemble of Goodman and Weare, Comm. Appl. Math. Comp. Sci. 5 (2010) 65–80, in
emcee: Foreman-Mackey et al., PASP 125 (2013) 306–312. Walkers start where importance resampling of points that
fill the region puts them, so that every branch of the solution set has some. The same data give the same samples.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from stemcal.doe.calibration.misfit import Misfit, VarianceSource
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

WALKERS, STEPS, BURN_IN = 40, 2000, 500
_CLOUD, _SEED = 13, 20_011
_NO_PART = 1e-9  # a source below this part of the variance is rounding
_DRAWS = 8  # 2^8 draws of the variances
ALIKE = 4.0
"""How alike the diameters scatter: ν₀ of σᵢ² ~ ν₀σ²/χ²(ν₀), by which two thirds of their sd are within a factor 1.5."""


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
    apart = _apart(misfit)
    several = misfit.scale_known and (misfit.meshed or sum(np.isfinite(source.df) for source in apart.sources) > 1)
    drawn = _drawn_variances(apart) if several else None

    def density(points: Array) -> Array:
        if drawn is None:
            found = _log_likelihood(misfit, misfit.of_data(points))
        else:
            found = _mean_log_likelihood(apart, *drawn, points)
        for prior in misfit.priors:
            found = found + prior.log_density(points)
        return np.where(region.contains(points), found, -np.inf)

    return density


def _apart(misfit: Misfit) -> Misfit:
    """Return it without sources of no part, the laboratory's of each diameter by itself."""
    sources = [source for source in misfit.sources if np.any(source.variance > _NO_PART * misfit.variance)]
    return replace(misfit, sources=tuple(part for source in sources for part in _moderated(source)))


def _moderated(source: VarianceSource) -> list[VarianceSource]:
    """Return (ν₀·s² + νᵢ·sᵢ²)/(ν₀ + νᵢ) of each diameter, s² the pooled variance; the source itself if not pooled."""
    if source.name != "laboratory" or source.apart is None or source.apart_df is None:
        return [source]
    own_df = np.where(source.apart_df < source.df, source.apart_df, 0.0)
    if not own_df.any() or not np.isfinite(source.df):
        return [source]
    variance = (ALIKE * source.variance + own_df * source.apart) / (ALIKE + own_df)
    df = np.minimum(ALIKE + own_df, source.df)
    each = zip(np.diag(variance), df.tolist(), strict=True)
    return [replace(source, variance=of, df=df, apart=None) for of, df in each if of.any()]


def _mean_log_likelihood(misfit: Misfit, own: Array, shared: Array, points: Array) -> Array:
    """Return the log of the likelihood's mean over drawn variances, (draws, observations) each."""
    gap = misfit.measured - misfit.predict(points)
    found, size = (gap**2) @ (1.0 / own).T, np.log(own).sum(axis=1)
    for mine in misfit.kinds:
        if not np.any(w := mine * shared / own):
            continue
        inner = 1.0 + (shared * w).sum(axis=1)
        found -= (gap @ w.T) ** 2 / inner
        size = size + np.log(inner)
    found += size
    found *= -0.5
    most = found.max(axis=1, keepdims=True)
    found -= most
    return np.asarray(np.log(np.exp(found, out=found).sum(axis=1)) + most[:, 0])


def _drawn_variances(misfit: Misfit) -> tuple[Array, Array]:
    """Return variances, and standard deviations of what is shared, (draws, observations): the same every time."""
    from scipy.special import chdtri
    from scipy.stats.qmc import Sobol

    even = 1.0 - (Sobol(len(misfit.sources), scramble=False).random_base2(_DRAWS) + 0.5 / 2**_DRAWS)
    of_mesh = [misfit.own_part(source) if source.shared else None for source in misfit.sources]
    drawn = [
        (source.variance + (0.0 if own is None else misfit.sources[own].variance / source.conditions))
        * (source.df / chdtri(source.df, u)[:, None] if np.isfinite(source.df) else np.ones((len(u), 1)))
        for source, own, u in zip(misfit.sources, of_mesh, even.T, strict=True)
    ]
    own, shared = np.zeros_like(drawn[0]), np.zeros_like(drawn[0])
    for variance, source, beside in zip(drawn, misfit.sources, of_mesh, strict=True):
        if source.shared:  # c² = (MS − s²)/D: what is drawn is MS
            shared += np.maximum(variance - (0.0 if beside is None else drawn[beside] / source.conditions), 0.0)
        else:
            own += variance
    return np.maximum(own, np.finfo(float).tiny), np.sqrt(shared)


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
