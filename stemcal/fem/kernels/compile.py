"""How the kernels are compiled; `cache` is where numba keeps them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import llvmlite.binding
import numba
from numba import njit

from stemcal.fem.kernels.cache import cache_folder

Function = Callable[..., Any]

CACHE = cache_folder()
_config: Any = numba.config
_config.CACHE_DIR = str(CACHE)


def _whole_registers() -> str | None:
    """Return the processor's features for LLVM with leave to use its 512-bit registers, None to leave all to numba.

    LLVM halves the vectors by itself for fear of a lower clock; the loops over the lanes are a third faster without.
    """
    features = llvmlite.binding.get_host_cpu_features()
    if not (features.get("avx512f") and _config.ENABLE_AVX):
        return None
    return str(features.flatten()) + ",-prefer-256-bit"


if _config.CPU_FEATURES is None:
    _config.CPU_FEATURES = _whole_registers()

_jit: Any = njit  # its types lack some of its options
# Contracted multiply-adds and unsigned zeros; NaN and infinity keep their meaning, sums keep their order.
_MATHS = {"contract", "nsz"}


# Without a way in from Python, and one from C, a function takes half the time to compile: each is separate code that
# unpacks and checks all arguments.
_INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def entry(function: Function) -> Any:
    """Compile a `kernel` that Python calls; the result is cached on disk."""
    return _jit(cache=True, nogil=True, no_cfunc_wrapper=True, error_model="numpy", fastmath=_MATHS)(function)


def kernel(function: Function) -> Any:
    """Compile a function that loops over arrays and releases the interpreter lock for other threads.

    Other kernels call it. Only an `entry` is cached: it contains the code of all that it calls, and a cache of each
    function would have LLVM write the same code at every level.
    """
    return _jit(nogil=True, error_model="numpy", fastmath=_MATHS, **_INNER)(function)


def summing(function: Function) -> Any:
    """Compile a function of sums over arrays whose order LLVM may choose: always the same on one processor."""
    return _jit(forceinline=True, error_model="numpy", fastmath=_MATHS | {"reassoc"}, **_INNER)(function)


def inlined(function: Function) -> Any:
    """Compile a function of scalars and tuples so that it dissolves into the loop that calls it.

    A call left inside the loop over the lanes of a block would keep LLVM from vectorising it.
    """
    return _jit(forceinline=True, error_model="numpy", fastmath=_MATHS, **_INNER)(function)
