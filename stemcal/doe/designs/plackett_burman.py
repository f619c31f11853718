"""Plackett–Burman designs: main effects of up to N − 1 factors in N runs, N − 1 a prime.

Source: R. L. Plackett and J. P. Burman, The Design of Optimum Multifactorial Experiments, Biometrika 33
(1946), 305–325.
"""

import numpy as np

from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

# In 4 and 8 runs main effects are aliased fully with two-factor interactions, and 12 runs are half as many again as 8.
_USUAL, _FEW = 12, 5


def plackett_burman(k: int, runs: int | None = None) -> Array:
    """Build a design for k factors, in the smallest usual number of runs unless `runs` is given.

    A generator is shifted around and a row of all −1 added; it is + at 0 and at the squares modulo N − 1, which
    gives the printed ones: ``++-+++---+-`` for 12 runs, ``++--++++-+-+----++-`` for 20 and
    ``+++++-+-++--++--+-+----`` for 24.

    Returns
    -------
    array (N, k)
        Levels ±1; columns are balanced and mutually orthogonal.
    """
    if k < 1:
        raise UsageError(f"screen.design: {k} factors; list at least one")
    n = _smallest(k) if runs is None else runs
    if n <= k or n % 4 or not _is_prime(n - 1):
        raise UsageError(
            f"screen.runs: no Plackett–Burman design has {n} runs for {k} factors; use 12, 20, 24, 32, 44 or 48 runs, "
            f"such as {_smallest(k)}"
        )
    q = n - 1
    squares = {i * i % q for i in range(q)}
    generator = np.array([1.0 if i in squares else -1.0 for i in range(q)])
    return np.vstack([*(np.roll(generator, shift) for shift in range(q)), -np.ones(q)])[:, :k]


def _smallest(k: int) -> int:
    """Return the usual size: from five factors on 12 runs, in which no main effect is all of an interaction."""
    n = 4 * (k // 4 + 1) if k < _FEW else max(_USUAL, 4 * (k // 4 + 1))
    while not _is_prime(n - 1):
        n += 4
    return n


def _is_prime(q: int) -> bool:
    return q > 1 and all(q % divisor for divisor in range(2, int(q**0.5) + 1))
