"""Which runs to make, in coded units: two-level screening designs and central composites."""

from __future__ import annotations

import numpy as np

from stemcal.doe.regression import Array
from stemcal.errors import UsageError

SCREENING_DESIGNS = ("plackett-burman", "plackett-burman-pydoe")


def plackett_burman(k: int, kind: str = "plackett-burman") -> Array:
    """Build a two-level screening design for k factors.

    Parameters
    ----------
    k : int
        Number of factors.
    kind : str
        ``plackett-burman`` (cyclic, ends in a row of all −1) or ``plackett-burman-pydoe`` (pyDOE3).

    Returns
    -------
    array (n, k)
        Levels ±1; columns are balanced and mutually orthogonal.
    """
    builders = {"plackett-burman": _cyclic, "plackett-burman-pydoe": _pydoe}
    if kind not in builders:
        raise UsageError(f"screen.design: no design {kind!r}; choose one of {', '.join(builders)}")
    if k < 1:
        raise UsageError(f"screen.design: {k} factors; give at least one")
    return builders[kind](k)


def _cyclic(k: int) -> Array:
    """Shift a generator around, then add a row of all −1 (Plackett and Burman 1946; Paley 1933).

    The generator of N = q + 1 runs, q a prime with q mod 4 = 3, is + at 0 and at the squares modulo q. That
    gives the printed ones: ``++-+++---+-`` for 12 runs, ``++--++++-+-+----++-`` for 20 and
    ``+++++-+-++--++--+-+----`` for 24.
    """
    q = max(k, 3)
    while q % 4 != 3 or not _is_prime(q):
        q += 1
    squares = {i * i % q for i in range(q)}
    generator = np.array([1.0 if i in squares else -1.0 for i in range(q)])
    shifted = np.array([np.roll(generator, shift) for shift in range(q)])
    return np.vstack([shifted, -np.ones(q)])[:, :k]


def _is_prime(q: int) -> bool:
    return q > 1 and all(q % divisor for divisor in range(2, int(q**0.5) + 1))


def _pydoe(k: int) -> Array:
    n = 4 * (k // 4 + 1)
    if not any(n % core == 0 and _is_power_of_two(n // core) for core in (1, 12, 20)):
        raise UsageError(
            f"screen.design plackett-burman-pydoe: {k} factors need {n} runs, and pyDOE3 knows only "
            "4·2^m, 12·2^m and 20·2^m; use plackett-burman"
        )
    from pyDOE3 import pbdesign

    return np.asarray(pbdesign(k), dtype=float)


def _is_power_of_two(n: int) -> bool:
    return n > 0 and n & (n - 1) == 0


def axial_distance(k: int, alpha: str | float = "rotatable") -> float:
    """Return α, the coded distance of the axial points.

    It is 2^(k/4) when rotatable, 1 on the face, or the number given.
    """
    if isinstance(alpha, str):
        rules: dict[str, float] = {"rotatable": 2.0 ** (k / 4.0), "face": 1.0}
        if alpha not in rules:
            raise UsageError(f"rsm.alpha: {alpha!r} is no rule; choose rotatable, face or a positive number")
        return rules[alpha]
    if not (np.isfinite(alpha) and alpha > 0.0):
        raise UsageError(f"rsm.alpha: {alpha:g} must be positive; 1 puts the axial points on the faces")
    return float(alpha)


def central_composite(k: int, centre_points: int = 6, alpha: str | float = "rotatable") -> Array:
    """Build a central composite design: 2^k factorial, 2k axial, then the centre points.

    Returns
    -------
    array (2^k + 2k + centre_points, k)
        Coded levels: 0, ±1 and ±α.
    """
    if k < 1:
        raise UsageError(f"rsm.factors: {k} factors; give at least one")
    if centre_points < 0:
        raise UsageError(f"rsm.centre_points: {centre_points} is negative; 6 is usual for three factors")
    distance = axial_distance(k, alpha)
    factorial_and_star = _unit_composite(k)
    factorial_and_star[2**k :] *= distance
    return np.vstack([factorial_and_star, np.zeros((centre_points, k))])


def _unit_composite(k: int) -> Array:
    """Factorial and star points with α = 1."""
    if k == 1:  # pyDOE3 starts at two factors
        return np.array([[-1.0], [1.0], [-1.0], [1.0]])
    from pyDOE3 import ccdesign

    return np.array(ccdesign(k, center=(0, 0), alpha="r", face="ccf"), dtype=float)
