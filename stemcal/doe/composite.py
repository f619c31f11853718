"""Central composite designs: a two-level core, axial points at distance α, and centre points.

Sources: G. E. P. Box and K. B. Wilson, J. Roy. Stat. Soc. B 13 (1951), 1–45; rotatability, G. E. P. Box and J. S.
Hunter, Ann. Math. Stat. 28 (1957), 195–241.
"""

import numpy as np

from stemcal.doe.coding import Array
from stemcal.doe.factorial import fraction
from stemcal.errors import UsageError


def axial_distance(k: int, alpha: str | float = "rotatable") -> float:
    """Return α, the coded distance of the axial points: by a rule, or as given.

    With ``rotatable`` the variance depends on the distance alone, α⁴ = corner runs; with ``face`` α = 1.
    """
    if alpha == "rotatable":
        return float(len(_corners(k)) ** 0.25)
    if alpha == "face":
        return 1.0
    if isinstance(alpha, str):
        raise UsageError(
            f"rsm.alpha: {alpha!r} is neither a known rule nor a positive number; write `rotatable`, `face` or a number"
        )
    if not (np.isfinite(alpha) and alpha > 0.0):
        raise UsageError(f"rsm.alpha: {alpha:g} is not positive; write 1 for axial points on the faces of the cube")
    return float(alpha)


def central_composite(k: int, centre_points: int = 6, alpha: str | float = "rotatable") -> Array:
    """Return a central composite design (F + 2k + centre_points, k) in coded levels: corners, axial and centre points.

    From five factors on, the corners are the smallest fraction of resolution V, which still estimates every
    interaction.
    """
    if k < 1:
        raise UsageError(f"rsm.factors: the number of factors is {k}; list at least one factor")
    if centre_points < 0:
        raise UsageError(f"rsm.centre_points: {centre_points} is negative; write 6, the usual number for three factors")
    axes = np.array([sign * row for row in np.eye(k) for sign in (-1.0, 1.0)]) + 0.0
    return np.vstack([_corners(k), axial_distance(k, alpha) * axes, np.zeros((centre_points, k))])


def _corners(k: int) -> Array:
    """Return the corner runs: all 2^k, the last factor fastest, or a fraction of resolution V."""
    if k >= 5:
        return fraction(k, resolution=5).design()
    from pyDOE3 import ff2n

    return np.asarray(ff2n(k), dtype=float)
