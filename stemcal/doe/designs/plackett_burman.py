"""Saturated two-level designs for main effects: N runs for up to N − 1 factors, N a multiple of 4.

Source: R. L. Plackett and J. P. Burman, The Design of Optimum Multifactorial Experiments, Biometrika 33
(1946), 305–325; the matrices behind them are in `hadamard`.
"""

import numpy as np

from stemcal.doe.designs.galois import is_prime
from stemcal.doe.designs.hadamard import hadamard
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

# Up to 100 runs these orders come from doubling alone: their main effects are aliased fully with two-factor
# interactions, and the next order costs four runs more. 4 and 8 alias fully too, but 12 is half as much again.
_DOUBLED = (16, 56, 64, 88, 96)
_USUAL, _FEW = 12, 5


def cyclic_design(k: int, runs: int | None = None) -> Array:
    """Build a design for k factors, in the smallest sound number of runs unless `runs` is given.

    Where N − 1 is a prime, a generator is shifted around and a row of all −1 added; it is + at 0 and at the
    squares modulo N − 1, which gives the printed ones: ``++-+++---+-`` for 12 runs,
    ``++--++++-+-+----++-`` for 20 and ``+++++-+-++--++--+-+----`` for 24. Other orders are read off a
    Hadamard matrix with its signs set so that the last row is all −1.
    """
    n = _smallest(k) if runs is None else runs
    design = _saturated(n) if n % 4 == 0 and n > k else None
    if design is None:
        raise UsageError(
            f"screen.runs: no Plackett–Burman design has {n} runs for {k} factors; "
            f"take a multiple of 4 above {k}, such as {_smallest(k)}"
        )
    return design[:, :k]


def _smallest(k: int) -> int:
    """Return the usual size: of five factors on 12 runs, in which no main effect is all of an interaction."""
    n = 4 * (k // 4 + 1) if k < _FEW else max(_USUAL, 4 * (k // 4 + 1))
    while n in _DOUBLED or _saturated(n) is None:
        n += 4
    return n


def _saturated(n: int) -> Array | None:
    """Return n − 1 balanced, orthogonal columns whose last row is −1."""
    if is_prime(n - 1):
        return _shifted(n - 1)
    h = hadamard(n)
    return None if h is None else np.asarray(-h[:, 1:] * h[-1, 1:])


def _shifted(q: int) -> Array:
    squares = {i * i % q for i in range(q)}
    generator = np.array([1.0 if i in squares else -1.0 for i in range(q)])
    return np.vstack([*(np.roll(generator, shift) for shift in range(q)), -np.ones(q)])


def pydoe_design(k: int, runs: int | None = None) -> Array:
    """Build the design of pyDOE3, for comparison with studies that used it; unsound sizes are refused."""
    n = 4 * (k // 4 + 1)
    if runs not in (None, n):
        raise UsageError(f"screen.runs: pyDOE3 has {n} runs for {k} factors, not {runs}; use plackett-burman")
    if not any(n % core == 0 and _is_power_of_two(n // core) for core in (1, 12, 20)):
        raise UsageError(
            f"screen.design plackett-burman-pydoe: {k} factors need {n} runs, and pyDOE3 knows only "
            "4·2^m, 12·2^m and 20·2^m; use plackett-burman"
        )
    from pyDOE3 import pbdesign

    return np.asarray(pbdesign(k), dtype=float)


def _is_power_of_two(n: int) -> bool:
    return n > 0 and n & (n - 1) == 0
