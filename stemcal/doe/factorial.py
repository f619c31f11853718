"""Two-level designs: full factorials, regular fractions and Plackett–Burman designs.

In a regular fraction the first factors, denoted by letters, form a full factorial; the column of each further factor is
the product of some of these, its generator. A product of columns that is constant over all runs is a word of the
defining relation. The length of the shortest word is the resolution; a design of minimum aberration has the fewest
words of this length.

Sources: G. E. P. Box and J. S. Hunter, The 2^(k−p) Fractional Factorial Designs, Technometrics 3 (1961),
311–351; J. Chen, D. X. Sun and C. F. J. Wu, A Catalogue of Two-Level and Three-Level Fractional Factorial
Designs with Small Runs, Int. Stat. Rev. 61 (1993), 131–145; R. L. Plackett and J. P. Burman, The Design of Optimum
Multifactorial Experiments, Biometrika 33 (1946), 305–325.
"""

from dataclasses import dataclass
from functools import cache, reduce
from itertools import combinations
from operator import xor

import numpy as np

from stemcal.arrays import Array
from stemcal.errors import UsageError

_LETTERS = "ABCDEFGHJKLMNOPQ"  # the letter I denotes the identity and is skipped
_MOST_FACTORS = 12

# Generators of the added factors for minimum aberration, by number of runs and number of factors.
_ODD = ("ABC", "ABD", "ACD", "BCD", "ABE", "ACE", "BCE", "ADE", "BDE", "CDE", "ABCDE")
_16 = ("ABC", "BCD", "ACD", "ABD", "ABCD", "AB", "AC", "AD", "BC", "BD", "CD")
GENERATORS: dict[int, dict[int, tuple[str, ...]]] = {
    4: {3: ("AB",)},
    8: {4: ("ABC",), 5: ("AB", "AC"), 6: ("AB", "AC", "BC"), 7: ("AB", "AC", "BC", "ABC")},
    16: {5: ("ABCD",), 6: _16[:2], 7: _16[:3], 8: _16[:4]} | {k: _16[: k - 4] for k in range(9, 16)},
    32: {
        6: ("ABCDE",), 7: ("ABCD", "ABDE"), 8: ("ABC", "ABD", "BCDE"), 9: ("BCDE", "ACDE", "ABDE", "ABCE"),
        10: ("ABCD", "ABCE", "ABDE", "ACDE", "BCDE"), 11: ("ABC", "BCD", "CDE", "ACD", "ADE", "BDE"),
        12: ("ABC", "ABD", "ACD", "BCD", "ABE", "ACE", "ADE"), 13: _ODD[:8], 14: _ODD[:9], 15: _ODD[:10], 16: _ODD,
    },
    64: {
        7: ("ABCDEF",), 8: ("ABCD", "ABEF"), 9: ("ABCD", "ACEF", "CDEF"), 10: ("BCDF", "ACDF", "ABDE", "ABCE"),
        11: ("CDE", "ABCD", "ABF", "BDEF", "ADEF"),
    },
    128: {8: ("ABCDEFG",), 9: ("ACDFG", "BCEFG"), 10: ("ABCD", "ABEF", "ACEG")},
}  # fmt: skip


@dataclass(frozen=True)
class Fraction:
    """A 2^(k−p) fractional factorial: `k` factors in `runs` runs; the `generators` define the p added factors."""

    k: int
    runs: int
    generators: tuple[str, ...]

    @property
    def basic(self) -> int:
        """Number of the basic factors, whose columns form a full factorial."""
        return self.k - len(self.generators)

    def design(self) -> Array:
        """Return the levels ±1 of all runs, (runs, k), the first factor changing fastest."""
        base = full_factorial(self.basic)
        added = [np.prod(base[:, [_LETTERS.index(c) for c in word]], axis=1) for word in self.generators]
        return np.column_stack([base, *added])

    @property
    def resolution(self) -> int | None:
        """The resolution, the length of the shortest word; None for a full factorial."""
        generating = [{*word, _LETTERS[self.basic + i]} for i, word in enumerate(self.generators)]
        words = (reduce(xor, some) for r in range(1, len(generating) + 1) for some in combinations(generating, r))
        return min(map(len, words), default=None)


def full_factorial(k: int) -> Array:
    """Return all combinations of the levels −1 and +1, (2^k, k), the first factor changing fastest."""
    if not 1 <= k <= _MOST_FACTORS:
        raise UsageError(f"full factorial: {k} factors are not supported; use 1 to {_MOST_FACTORS} factors")
    from pyDOE3 import ff2n

    return np.asarray(ff2n(k), dtype=float)[:, ::-1]


def fraction(k: int, runs: int | None = None, resolution: int = 4) -> Fraction:
    """Return the fraction of least aberration for k factors, with `runs` runs or the fewest for this `resolution`."""
    sizes = [runs] if runs is not None else sorted({2**k, *GENERATORS}) if k <= 12 else sorted(GENERATORS)
    for size in sizes:
        chosen = _fraction(k, size)
        if chosen and (runs is not None or chosen.resolution is None or chosen.resolution >= resolution):
            return chosen
    known = [n for n in sorted({*GENERATORS, 2 ** min(k, 12)}) if _fraction(k, n)]
    listed = ", ".join(map(str, known)) or "none"
    wanted = f"{runs} runs" if runs is not None else f"resolution {resolution}"
    raise UsageError(f"fractional factorial: no design with {wanted} for {k} factors; available sizes: {listed}")


@cache
def _fraction(k: int, runs: int) -> Fraction | None:
    if runs == 2**k:
        return Fraction(k, runs, ())
    words = GENERATORS.get(runs, {}).get(k)
    return None if words is None else Fraction(k, runs, words)


# For 5 to 7 factors 12 runs are used instead of 8, in which main effects are fully aliased with interactions.
_USUAL, _FEW = 12, 5


def plackett_burman(k: int, runs: int | None = None) -> Array:
    """Return a Plackett–Burman design, (N, k): main effects of k ≤ N − 1 factors in N runs, with N − 1 a prime.

    N is `runs`, by default the usual number for k factors. The columns are balanced and mutually orthogonal. The rows
    are the cyclic shifts of a generator, and a row of −1. The generator is +1 at 0 and at the squares modulo N − 1, as
    published: ``++-+++---+-`` for 12 runs, ``++--++++-+-+----++-`` for 20, ``+++++-+-++--++--+-+----`` for 24.
    """
    if k < 1:
        raise UsageError(f"screen.design: the number of factors is {k}; list at least one factor")
    n = _smallest(k) if runs is None else runs
    if n <= k or n % 4 or not _is_prime(n - 1):
        raise UsageError(
            f"screen.runs: no Plackett–Burman design has {n} runs for {k} factors; use 12, 20, 24, 32, 44 or 48 runs, "
            f"for example {_smallest(k)}"
        )
    q = n - 1
    squares = {i * i % q for i in range(q)}
    generator = np.array([1.0 if i in squares else -1.0 for i in range(q)])
    return np.vstack([*(np.roll(generator, shift) for shift in range(q)), -np.ones(q)])[:, :k]


def _smallest(k: int) -> int:
    n = 4 * (k // 4 + 1) if k < _FEW else max(_USUAL, 4 * (k // 4 + 1))
    while not _is_prime(n - 1):
        n += 4
    return n


def _is_prime(q: int) -> bool:
    return q > 1 and all(q % divisor for divisor in range(2, int(q**0.5) + 1))
