"""Kernels that only kernels call, with a way in from Python: tests call them one by one."""

from functools import cache
from typing import Any

from numba import njit


@cache
def called(kernel: Any) -> Any:
    """Return a compiled function that passes its arguments on to a kernel."""
    return njit(lambda *arguments: kernel(*arguments), error_model="numpy")
