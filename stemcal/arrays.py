"""Types of arrays in signatures; the docstrings state the shapes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int32]
Mask = NDArray[np.bool_]
Floats = Any  # in kernels: a number, or a vector with a number for each SIMD lane, in single or double precision
