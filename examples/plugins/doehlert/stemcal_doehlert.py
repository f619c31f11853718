"""A design from another package: Doehlert's uniform shell, for ``rsm: {design: doehlert}``.

k² + k + 1 different points, fewer than any other design here: the centre, and the differences between the corners of a
regular simplex, all at a distance of 1. Source: D. H. Doehlert, J. R. Stat. Soc. C 19 (1970) 231–239.
"""

from itertools import permutations

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.designs import SurfaceDesign, SurfaceOptions


class Doehlert(SurfaceDesign):
    """The centre and a shell of points at equal distances from it and from each other."""

    name, factors = "doehlert", (2, 8)

    def points(self, k: int, options: SurfaceOptions) -> Array:
        corners = np.zeros((k + 1, k))  # of a simplex with edges of length 1, one at the centre
        for j in range(k):
            corners[j + 1 :, j] = 1.0 / (2.0 * (j + 1)) * (2.0 * (j + 1) / (j + 2)) ** 0.5
            corners[j + 1, j] = ((j + 2) / (2.0 * (j + 1))) ** 0.5
        shell = [a - b for a, b in permutations(corners, 2)]
        return np.vstack([*shell, np.zeros((options.centre_points, k))])

    def radius(self, k: int, options: SurfaceOptions) -> float:
        return 1.0
