"""How the kernels are compiled, and where numba keeps what it has compiled.

The cache is a private folder per user (`STEMCAL_CACHE_DIR` moves it) and per state of the kernels' sources: numba by
itself looks only at the file of the function that it caches, and would go on using a loop whose inlined parts have
changed. Where the folder cannot be written, as on a read-only home, a temporary one serves; where an entry is
damaged, `stemcal.fem.warm` empties it.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import platformdirs
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

Function = Callable[..., Any]


def _sources() -> str:
    """Return a short hash of the sources of all kernels."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]


def cache_folder() -> Path:
    """Return a folder of our own that can be written: the configured one, the user's cache, or a temporary one."""
    configured = os.environ.get("STEMCAL_CACHE_DIR")
    root = Path(configured) if configured else Path(platformdirs.user_cache_dir("stemcal", appauthor=False))
    folder = root / f"kernels-{_sources()}-numba-{numba.__version__}"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(tempfile.mkdtemp(prefix="stemcal-kernels-"))


CACHE = cache_folder()
_config: Any = numba.config
_config.CACHE_DIR = str(CACHE)

# Contracted multiply-adds and unsigned zeros; NaN and infinity keep their meaning, sums keep their order.
_MATHS = {"contract", "nsz"}


def kernel(function: Function) -> Any:
    """Compile a function that loops over arrays and lets other threads run meanwhile; the result is cached on disk."""
    return njit(cache=True, nogil=True, error_model="numpy", fastmath=_MATHS)(function)


def inlined(function: Function) -> Any:
    """Compile a function of scalars and tuples so that it dissolves into the loop that calls it.

    A call left inside the loop over the lanes of a block would keep LLVM from vectorising it.
    """
    return njit(forceinline=True, error_model="numpy", fastmath=_MATHS)(function)


def _prefetch(_typing: Any, values: Any, place: Any) -> Any:
    """Ask for the cache line of ``values[place]``, flat and contiguous, so that it is there when it is needed."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        byte = ir.IntType(8).as_pointer()
        address = builder.bitcast(builder.gep(array.data, [arguments[1]]), byte)
        flag = ir.IntType(32)
        to_write, keep_close, data = flag(1), flag(3), flag(1)
        form = ir.FunctionType(ir.VoidType(), [byte, flag, flag, flag])
        function = builder.module.declare_intrinsic("llvm.prefetch", (byte,), form)
        builder.call(function, [address, to_write, keep_close, data])
        return context.get_dummy_value()

    return types.void(values, place), build


prefetch: Any = intrinsic(_prefetch)
