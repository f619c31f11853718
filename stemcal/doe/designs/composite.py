"""Central composite designs: a two-level core, axial points at distance α, and centre points.

Sources: G. E. P. Box and K. B. Wilson, J. Roy. Stat. Soc. B 13 (1951), 1–45; rotatability, G. E. P. Box and J. S.
Hunter, Ann. Math. Stat. 28 (1957), 195–241.
"""

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from stemcal.doe.designs.factorial import fraction
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

Core = Literal["full", "fractional"]
_CENTRE_POINTS = 6


def _orthogonal(k: int, corners: int, centre_points: int) -> float:
    """α that leaves the squares uncorrelated: α² = (√(F·N) − F)/2 with N = F + 2k + n₀ runs."""
    runs = corners + 2 * k + centre_points
    return math.sqrt((math.sqrt(corners * runs) - corners) / 2.0)


# α from the number of factors, of corner runs and of centre points.
ALPHAS: dict[str, Callable[[int, int, int], float]] = {
    "rotatable": lambda _k, corners, _centre: corners**0.25,  # variance depends on the distance alone
    "face": lambda _k, _corners, _centre: 1.0,  # three levels
    "spherical": lambda k, _corners, _centre: k**0.5,  # corners and axial points on one sphere
    "orthogonal": _orthogonal,
    "practical": lambda k, _corners, _centre: k**0.25,  # for many factors, where the others lie far out
}


def axial_distance(
    k: int, alpha: str | float = "rotatable", centre_points: int = _CENTRE_POINTS, core: Core = "full"
) -> float:
    """Return α, the coded distance of the axial points: by one of the rules of `ALPHAS`, or as given."""
    if isinstance(alpha, str):
        if alpha not in ALPHAS:
            raise UsageError(f"rsm.alpha: {alpha!r} is not a rule; choose {', '.join(ALPHAS)} or a positive number")
        return float(ALPHAS[alpha](k, len(corners(k, core)), centre_points))
    if not (np.isfinite(alpha) and alpha > 0.0):
        raise UsageError(f"rsm.alpha: {alpha:g} must be positive; 1 puts the axial points on the faces")
    return float(alpha)


def central_composite(
    k: int, centre_points: int = _CENTRE_POINTS, alpha: str | float = "rotatable", core: Core = "full"
) -> Array:
    """Build a central composite design: corners, axial points, centre points, in this order.

    Parameters
    ----------
    core : {'full', 'fractional'}
        Whether the corners are a full factorial or, from five factors on, its smallest fraction of
        resolution V, which still estimates every interaction.

    Returns
    -------
    array (F + 2k + centre_points, k)
        Coded levels.
    """
    if k < 1:
        raise UsageError(f"rsm.factors: {k} factors; list at least one factor")
    if centre_points < 0:
        raise UsageError(f"rsm.centre_points: {centre_points} is negative; 6 is usual for three factors")
    distance = axial_distance(k, alpha, centre_points, core)
    return np.vstack([corners(k, core), distance * axes(k), np.zeros((centre_points, k))])


def corners(k: int, core: Core = "full") -> Array:
    """Return the corner runs: all 2^k, the last factor fastest, or a fraction of resolution V."""
    if core == "fractional" and k >= 5:
        return fraction(k, resolution=5).design()
    from pyDOE3 import ff2n

    return np.asarray(ff2n(k), dtype=float)


def axes(k: int) -> Array:
    """Return −1 and +1 on each axis, factor by factor."""
    return np.array([sign * row for row in np.eye(k) for sign in (-1.0, 1.0)]) + 0.0
