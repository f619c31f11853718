"""Compile the kernels ahead of use, and recover when what was compiled before cannot be read."""

import functools
import gc
import logging
import pickle
import platform
import shutil
from contextlib import suppress
from pathlib import Path

import llvmlite.binding
from filelock import FileLock

from stemcal.fem.contact import Tool
from stemcal.fem.kernels.compile import CACHE
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate
from stemcal.processes.child import Child
from stemcal.processes.interrupts import put_off

logger = logging.getLogger(__name__)

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
        _mark().unlink(missing_ok=True)
        compile_once()
        _load()


def compile_once() -> None:
    """Compile every kernel of a simulation into the cache, if it is not there.

    Of several processes with one cache, the first compiles and the others wait for it. It does so in a process of its
    own, so that an interrupt is heard at once and reaches nothing half made. Where no process can be started it is
    done here, and interrupts wait.
    """
    if is_compiled():
        return
    lock = FileLock(CACHE / _LOCK)
    with suppress(OSError, NotImplementedError):  # a file system without locks: each compiles for itself
        lock.acquire()
    try:
        if not is_compiled():
            _empty_cache()  # there may be damaged entries of a compilation that was broken off
            if not _compiled_elsewhere():
                _load()
            with suppress(OSError):
                _mark().touch()
    finally:
        lock.release()


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


def is_compiled() -> bool:
    """Check that the cache has every kernel for this machine, as far as possible without loading them."""
    return _mark().exists()


def _mark() -> Path:
    """Return the file of what compiled code is bound to next to its sources: the processor and Python."""
    return CACHE / f"complete-{llvmlite.binding.get_host_cpu_name()}-{platform.python_version()}"


def _compiled_elsewhere() -> bool:
    """Compile in its own process; return whether that succeeded."""
    try:
        child = Child()
        try:
            _, error = child.call(pickle.dumps((_smallest_simulation, (), {})))
            if error is not None:
                raise error
            child.dismiss()
        finally:
            child.kill()
    except Exception as error:
        logger.debug("compilation in another process failed", exc_info=error)
        return False
    return True


def _smallest_simulation() -> None:
    """Take a few steps of one element with an edge pressed into it; its wanted time step calls mass scaling.

    The garbage collector pauses: numba's many small objects cost it a seventh of the compile time.
    """
    wedge = Tool(corners=((0.5, 0.1), (1.0, 2.0), (0.0, 2.0)), radius=0.1, height=1.0, speed=-1.0, edge=0.5)
    smallest = Model(
        mesh=brick((1.0, 1.0, 1.0), (1, 1, 1)),
        material=Material(1.0e-9, 1000.0, 0.3, yield_stress=10.0),
        tools=(wedge,),
        integration=Integration(outputs=1, precision="mixed", time_step=1.0e-9),
    )
    gc.disable()
    try:
        simulate(smallest, 1.0e-6)
    finally:
        gc.enable()
