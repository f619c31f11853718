"""Designs that fill the box −1 … +1 evenly: for deterministic solvers, where a repeated run tells nothing.

Sources: M. D. McKay, R. J. Beckman and W. J. Conover, Technometrics 21 (1979), 239–245; I. M. Sobol',
USSR Comput. Math. Math. Phys. 7 (1967), 86–112, scrambled after A. B. Owen (1998). Both as in SciPy.
"""

import numpy as np

from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError


def latin_hypercube(k: int, runs: int, seed: int = 0) -> Array:
    """Return runs points, one in each of the `runs` slices of every factor, of low centred discrepancy."""
    from scipy.stats.qmc import LatinHypercube

    _require(k, runs)
    sampler = LatinHypercube(k, optimization="random-cd", seed=np.random.default_rng(seed))
    return np.asarray(2.0 * sampler.random(runs) - 1.0)


def sobol(k: int, runs: int, seed: int = 0) -> Array:
    """Return the first points of a scrambled Sobol' sequence: more runs add to those of fewer."""
    from scipy.stats.qmc import Sobol

    _require(k, runs)
    sampler = Sobol(k, scramble=True, seed=np.random.default_rng(seed))
    return np.asarray(2.0 * sampler.random_base2(max(1, (runs - 1).bit_length()))[:runs] - 1.0)


def _require(k: int, runs: int) -> None:
    if k < 1 or not 1 <= runs <= 100_000:
        raise UsageError(f"space-filling design: {runs} runs of {k} factors; at least one of each")
