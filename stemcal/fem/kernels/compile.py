"""How the kernels are compiled, where they are kept, and numbers for both precisions.

They are kept in a folder that no one else can write, because its content is executed: a private one per user
(`STEMCAL_CACHE_DIR` moves it), per installation and per state of the kernels' sources. Numba by itself looks only at
the file of the function that it caches, and would go on using a loop whose inlined parts have changed. A folder of
another user, or one that others may write, is not used; nor can one on a read-only home be. One among the temporary
files then serves.
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
    """Return the folder for compiled kernels: that of the user, or, where it is not private, one that is temporary.

    `STEMCAL_CACHE_DIR` moves it.
    """
    configured = os.environ.get("STEMCAL_CACHE_DIR")
    root = Path(configured) if configured else Path(platformdirs.user_cache_dir("stemcal", appauthor=False))
    user = os.geteuid() if hasattr(os, "geteuid") else "user"
    spare = Path(tempfile.gettempdir()) / f"stemcal-{user}-{_name()}"  # the same for this user's later commands
    usable = next(filter(_is_private, (root / _name(), spare)), None)
    return usable or Path(tempfile.mkdtemp(prefix="stemcal-kernels-"))


def _is_private(folder: Path) -> bool:
    """Return whether only this user can write to a folder; a missing folder is created.

    On Windows, the cache folder is part of the private profile of the user.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        found = folder.lstat()
    except OSError:
        return False
    return os.name == "nt" or (found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _name() -> str:
    """Return a name by all kernels' sources and by their place, by which numba finds what it has compiled."""
    place = Path(__file__).parent
    digest = hashlib.sha256(str(place).encode("utf-8", "surrogateescape"))
    for source in sorted(place.glob("*.py")):
        digest.update(source.read_bytes())
    return f"kernels-{digest.hexdigest()[:12]}-numba-{numba.__version__}"


# ---- how the kernels are compiled


Function = Callable[..., Any]

CACHE = _cache_folder()
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


# ---- mixed precision: a literal is of double precision and would draw single-precision values that it meets up to its
# own; these take on the precision of what they meet, and two of them must not meet alone


ZERO, ONE, TWO, THREE = (np.float32(number) for number in (0.0, 1.0, 2.0, 3.0))
EIGHT, SIXTY_FOUR = (np.float32(number) for number in (8.0, 64.0))
QUARTER, HALF, THREE_HALVES = (np.float32(number) for number in (0.25, 0.5, 1.5))
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
