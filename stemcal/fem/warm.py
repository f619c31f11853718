"""Compile the kernels ahead of use, and recover when what was compiled before cannot be read."""

import functools
import logging
import pickle
import platform
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import llvmlite.binding
from filelock import FileLock

from stemcal.fem.contact import Tool
from stemcal.fem.kernels.compile import CACHE
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate
from stemcal.interrupts import put_off
from stemcal.processes import Child

logger = logging.getLogger(__name__)

# A cache of other sources that no one has used for so long is swept away.
_KEPT_DAYS = 30.0
_LOCK = ".compiling"


@functools.cache
def warm() -> None:
    """Load every kernel of a simulation, compiled before if no cache has it; once in a process.

    A damaged cache entry makes numba raise all kinds of exceptions, so any failure empties the cache and tries once
    more; the second failure is real.
    """
    compile_once()
    try:
        _load()
    except Exception:
        _empty_cache()
        compile_once()
        _load()
    sweep(CACHE)


def compile_once() -> None:
    """Compile every kernel of a simulation into the cache, if it is not there.

    Of several processes with one cache, the first compiles and the others wait for it. It does so in a process of its
    own, so that an interrupt is heard at once and reaches nothing half made. Where no process can be started it is
    done here, and interrupts wait.
    """
    with _one_at_a_time(_mark()):
        if is_compiled() or _compiled_elsewhere():
            return
        _empty_cache()  # there may be damaged entries of a compilation that was broken off
        if not _compiled_elsewhere():
            _load()


def _load() -> None:
    with put_off():  # in the middle of LLVM's code an exception may have memory freed twice
        _smallest_simulation()


def _empty_cache() -> None:
    """Remove what is compiled, not the lock that this or another process may hold."""
    CACHE.mkdir(mode=0o700, parents=True, exist_ok=True)
    for path in CACHE.iterdir():
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        elif path.name != _LOCK:
            with suppress(OSError):
                path.unlink()


@contextmanager
def _one_at_a_time(mark: Path) -> Iterator[None]:
    """Hold the others off while kernels are compiled; not once they are there, lest starting be slow."""
    if mark.exists():
        yield
        return
    lock = FileLock(CACHE / _LOCK)
    with suppress(OSError, NotImplementedError):  # a file system without locks: each compiles for itself
        lock.acquire()
    try:
        yield
        with suppress(OSError):
            mark.touch()
    finally:
        lock.release()


def is_compiled() -> bool:
    """Return whether the cache has every kernel for this machine, as far as this is possible without loading them."""
    return _mark().exists()


def _mark() -> Path:
    """Return the file of what compiled code is bound to next to its sources: the processor and Python."""
    return CACHE / f"complete-{llvmlite.binding.get_host_cpu_name()}-{platform.python_version()}"


def sweep(cache: Path) -> None:
    """Remove what older sources left next to this cache; every use of a cache renews the time of its folder."""
    oldest = time.time() - _KEPT_DAYS * 86400.0
    for folder in cache.parent.glob("kernels-*-numba-*"):
        with suppress(OSError):  # somebody else may be sweeping
            if folder != cache and folder.stat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)


def _compiled_elsewhere() -> bool:
    """Compile in its own process; return whether that succeeded."""
    try:
        child = Child()
        try:
            _, error = child.call(pickle.dumps((compile_all, (), {})))
            if error is not None:
                raise error
            child.dismiss()
        finally:
            child.kill()
    except Exception as error:
        logger.debug("compiling in another process failed", exc_info=error)
        return False
    return True


def compile_all() -> None:
    """Compile, in its own process, what a simulation calls."""
    _smallest_simulation()


def _smallest_simulation() -> None:
    """Take a few steps of one element with an edge pressed into it; its wanted time step calls mass scaling."""
    wedge = Tool(corners=((0.5, 0.1), (1.0, 2.0), (0.0, 2.0)), radius=0.1, height=1.0, speed=-1.0, edge=0.5)
    smallest = Model(
        mesh=brick((1.0, 1.0, 1.0), (1, 1, 1)),
        material=Material(1.0e-9, 1000.0, 0.3, yield_stress=10.0),
        tools=(wedge,),
        integration=Integration(outputs=1, precision="mixed", time_step=1.0e-9),
    )
    simulate(smallest, 1.0e-6)
