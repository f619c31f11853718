"""Definitive screening: three levels in about twice as many runs as factors.

Main effects are clear of each other, of every two-factor interaction and of every square, and no interaction
is aliased fully with another. Sources: B. Jones and C. J. Nachtsheim, J. Quality Technology 43 (2011), 1–15;
by conference matrices, L. Xiao, D. K. J. Lin and F. Bai, J. Quality Technology 44 (2012), 2–8.
"""

from __future__ import annotations

import numpy as np

from stemcal.doe.designs.hadamard import conference
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError


def definitive_screening(k: int, centre_points: int = 1) -> Array:
    """Stack C, −C and the centre, C a conference matrix of the smallest order m ≥ k; columns beyond k drop out.

    Returns
    -------
    array (2·m + centre_points, k)
        Levels −1, 0, +1.
    """
    if not 1 <= k <= 100:
        raise UsageError(f"definitive screening: {k} factors; 1 to 100 are possible")
    order = max(4, k + k % 2)
    while (matrix := conference(order)) is None:
        order += 2
    return np.vstack([matrix, -matrix, np.zeros((centre_points, order))])[:, :k] + 0.0
