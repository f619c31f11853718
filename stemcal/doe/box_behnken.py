"""Box–Behnken designs: three levels, no run at a corner.

Source: G. E. P. Box and D. W. Behnken, Some New Three Level Designs for the Study of Quantitative Variables,
Technometrics 2 (1960), 455–475.
"""

from itertools import combinations

import numpy as np

from stemcal.doe.coding import Array
from stemcal.errors import UsageError

# The factors that vary together while the others rest at the centre, counted from 1.
_BLOCKS: dict[int, tuple[tuple[int, ...], ...]] = {
    **{k: tuple(combinations(range(1, k + 1), 2)) for k in (3, 4, 5)},
    6: ((1, 2, 4), (2, 3, 5), (3, 4, 6), (1, 4, 5), (2, 5, 6), (1, 3, 6)),
    7: ((4, 5, 6), (1, 6, 7), (2, 5, 7), (1, 2, 4), (3, 4, 7), (1, 3, 5), (2, 3, 6)),
}


def box_behnken(k: int, centre_points: int = 3) -> Array:
    """Build the design for 3 to 7 factors: 12, 24, 40, 48 or 56 runs, and the centre points."""
    if k not in _BLOCKS:
        raise UsageError(f"Box–Behnken designs are available for 3 to 7 factors, not for {k}; use `central-composite`")
    from pyDOE3 import ff2n

    runs = []
    for block in _BLOCKS[k]:
        runs.append(np.zeros((2 ** len(block), k)))
        runs[-1][:, [factor - 1 for factor in block]] = ff2n(len(block))
    return np.vstack([*runs, np.zeros((centre_points, k))])
