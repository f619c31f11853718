"""Latin hypercubes: for deterministic solvers, where repeated runs give the same response.

Source: M. D. McKay, R. J. Beckman and W. J. Conover, Technometrics 21 (1979), 239–245; as in SciPy.
"""

import numpy as np

from stemcal.doe.regression.least_squares import Array


def latin_hypercube(k: int, runs: int, seed: int = 0) -> Array:
    """Return runs points in −1 … +1, one in each of the `runs` slices of every factor, of low centred discrepancy."""
    from scipy.stats.qmc import LatinHypercube

    sampler = LatinHypercube(k, optimization="random-cd", seed=np.random.default_rng(seed))
    return np.asarray(2.0 * sampler.random(runs) - 1.0)
