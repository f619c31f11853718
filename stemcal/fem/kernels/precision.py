"""Mixed precision: numbers in formulas that serve values of single and of double precision alike.

A literal is of double precision and would draw single-precision values that it meets up to its own. These are of single
precision, exactly what they say, and take on the precision of what they meet; two of them must not meet alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

ZERO, ONE, TWO, THREE = (np.float32(number) for number in (0.0, 1.0, 2.0, 3.0))
EIGHT, SIXTY_FOUR = (np.float32(number) for number in (8.0, 64.0))
EIGHTH, QUARTER, HALF, THREE_HALVES = (np.float32(number) for number in (0.125, 0.25, 0.5, 1.5))
TINY = np.float32(2.0**-100)

# Elements in a row whose corners are nodes in a row. Nodal arrays (N, 3) lie component by component (Fortran's order),
# so a component of a run is one vector. A run may reach past the last node: `stemcal.fem.lanes.nodal` leaves room.
RUN = 8


def like(_value: Any, number: Any) -> Any:
    """Return a number in the precision of a value."""
    return number


@overload(like, jit_options={"forceinline": True, "error_model": "numpy"})
def _like(_value: Any, number: Any) -> Any:
    def single(_value: Any, number: Any) -> Any:
        return np.float32(number)

    def unchanged(_value: Any, number: Any) -> Any:
        return number

    return single if _value == types.float32 else unchanged
