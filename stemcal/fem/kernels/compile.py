"""Compilation of the kernels, the cache of compiled kernels, and constants for both precisions.

The content of the cache is executed, so the cache must be a folder that no other user can write. There is one per user
(`STEMCAL_CACHE_DIR` sets another place), per installation and per state of the kernels' sources: numba itself checks
only the source file of the cached function, and would use outdated code after a change of a function inlined into it.
If the user's folder is on a read-only disk, or other users own it or can write to it, a temporary folder is used.
"""

import hashlib
import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numpy as np
import platformdirs
from numba import njit, types
from numba.extending import overload


def _cache_folder() -> Path:
    """Return the folder for compiled kernels: the user's, or a temporary one if that is not private or not writable."""
    configured = os.environ.get("STEMCAL_CACHE_DIR")
    root = Path(configured) if configured else Path(platformdirs.user_cache_dir("stemcal", appauthor=False))
    user = os.geteuid() if hasattr(os, "geteuid") else "user"
    spare = Path(tempfile.gettempdir()) / f"stemcal-{user}-{_name()}"  # a fixed name, so that later commands find it
    usable = next(filter(_is_private, (root / _name(), spare)), None)
    return usable or Path(tempfile.mkdtemp(prefix="stemcal-kernels-"))


def _is_private(folder: Path) -> bool:
    """Check that only this user can write to a folder; a missing folder is created.

    On Windows, the cache folder is part of the private profile of the user.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        status = folder.lstat()
    except OSError:
        return False
    return os.name == "nt" or (status.st_uid == os.geteuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _name() -> str:
    """Return a folder name with a hash of the kernels' sources and path, because numba's cache depends on both."""
    place = Path(__file__).parent
    digest = hashlib.sha256(str(place).encode("utf-8", "surrogateescape"))
    for source in sorted(place.glob("*.py")):
        digest.update(source.read_bytes())
    return f"kernels-{digest.hexdigest()[:12]}-numba-{numba.__version__}"


Function = Callable[..., Any]

CACHE = _cache_folder()
_config: Any = numba.config
_config.CACHE_DIR = str(CACHE)


def _whole_registers() -> str | None:
    """Return the processor's features for LLVM with 512-bit registers enabled; None for numba's default.

    LLVM avoids these registers by default, because they can lower the clock frequency; with them the loops over lanes
    are a third faster.
    """
    features = llvmlite.binding.get_host_cpu_features()
    if not (features.get("avx512f") and _config.ENABLE_AVX):
        return None
    return str(features.flatten()) + ",-prefer-256-bit"


if _config.CPU_FEATURES is None:
    _config.CPU_FEATURES = _whole_registers()

_jit: Any = njit  # numba's annotations of njit lack some of its options
# Fused multiply-adds and unsigned zeros are allowed; NaN, infinity and the order of sums are preserved.
_MATHS = {"contract", "nsz"}
# Without entry points from Python and from C, which unpack and check all arguments, compilation takes half the time.
_INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def entry(function: Function) -> Any:
    """Compile a kernel that Python calls; the compiled code is cached on disk."""
    return _jit(cache=True, nogil=True, no_cfunc_wrapper=True, error_model="numpy", fastmath=_MATHS)(function)


def kernel(function: Function) -> Any:
    """Compile a function that loops over arrays, called only by other kernels.

    Only an `entry` is cached. Its code contains that of all functions that it calls; caching these too would store the
    same code several times.
    """
    return _jit(nogil=True, error_model="numpy", fastmath=_MATHS, **_INNER)(function)


def summing(function: Function) -> Any:
    """Compile a kernel whose sums LLVM may reorder and vectorise; the order is the same in each run on a processor."""
    return _jit(forceinline=True, error_model="numpy", fastmath=_MATHS | {"reassoc"}, **_INNER)(function)


def inlined(function: Function) -> Any:
    """Compile a function of scalars and tuples that is inlined into its caller.

    A call inside the loop over the lanes of a block would prevent LLVM from vectorising the loop.
    """
    return _jit(forceinline=True, error_model="numpy", fastmath=_MATHS, **_INNER)(function)


# Constants for mixed precision. A literal has double precision and would promote single-precision operands; these are
# promoted to the precision of the other operand. An operation on two of them would be in single precision.
ZERO, ONE, TWO, THREE = (np.float32(number) for number in (0.0, 1.0, 2.0, 3.0))
EIGHT, SIXTY_FOUR = (np.float32(number) for number in (8.0, 64.0))
QUARTER, HALF, THREE_HALVES = (np.float32(number) for number in (0.25, 0.5, 1.5))
TINY = np.float32(2.0**-100)

# Number of successive elements in a run, whose corner nodes are successive too. Nodal arrays (N, 3) are in Fortran
# order, so a component of a run is one vector. A run may extend past the last node, into spare memory that
# `stemcal.fem.lanes.nodal` allocates.
RUN = 8


def like(_value: Any, number: Any) -> Any:
    """Return a number in the precision of a value; outside kernels, return it unchanged."""
    return number


@overload(like, jit_options={"forceinline": True, "error_model": "numpy"})
def _like(_value: Any, number: Any) -> Any:
    def single(_value: Any, number: Any) -> Any:
        return np.float32(number)

    def unchanged(_value: Any, number: Any) -> Any:
        return number

    return single if _value == types.float32 else unchanged
