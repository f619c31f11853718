"""The columns of a Plackett–Burman design that carry no factor, as contrasts beside the effects.

Of N runs with k factors N − 1 − k columns are left. Where the runs are those of the known design, in whatever order,
each of them is a contrast of its own, as large as interactions make it; Lenth's margin is that of these and the
effects, which makes it surer the fewer factors there are. Of other designs, or where runs failed, only their sum of
squares is known, not the contrasts.
"""

import numpy as np

from stemcal.doe.designs.plackett_burman import cyclic_design
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

_FEWEST = 3  # factors that Lenth's method is asked of


def unused_columns(design: Array) -> Array | None:
    """Return the columns left of a Plackett–Burman design, (n, n − 1 − k); None if the runs are not those of one."""
    n, k = design.shape
    design = np.round(design, 6)
    if n % 4 or not 1 <= k < n - 1 or not np.all(np.abs(design) == 1.0):
        return None
    try:
        whole = cyclic_design(n - 1, n)
    except UsageError:
        return None
    rows = {tuple(row[:k]): i for i, row in enumerate(whole.tolist())}
    places = [rows.get(tuple(row)) for row in design.tolist()]
    if len(rows) < n or None in places or len(set(places)) < n:
        return None
    return np.asarray(whole[[place for place in places if place is not None], k:])


def unused_contrasts(design: Array, response: Array) -> Array:
    """Return mean(+) − mean(−) of each unused column, (n − 1 − k,); of other designs, or below three factors, none."""
    columns = unused_columns(design) if design.shape[1] >= _FEWEST else None
    return np.empty(0) if columns is None else np.asarray(2.0 * columns.T @ response / len(response))
