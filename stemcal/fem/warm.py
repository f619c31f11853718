"""Compile the kernels before their first use, and rebuild the cache of compiled kernels when it is damaged."""

import functools
import gc
import logging
import pickle
import platform
import shutil
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import llvmlite.binding
from filelock import FileLock

from stemcal.fem.kernels.compile import CACHE
from stemcal.fem.material import Material, Transverse
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate
from stemcal.fem.tools import Tool
from stemcal.processes.child import Child
from stemcal.processes.interrupts import put_off

logger = logging.getLogger(__name__)

_LOCK = ".compiling"


@functools.cache
def warm(layered: bool = False) -> None:
    """Load every kernel of a simulation once per process, compiling those that are not in the cache.

    Stems with layers or fibres use other kernels, selected by `layered`. A damaged cache entry makes numba raise many
    kinds of exceptions, so any failure empties the cache and repeats the attempt once; a second failure is raised.
    """
    compile_once(layered)
    try:
        _load(layered)
    except Exception:
        for kind in (False, True):
            _mark(kind).unlink(missing_ok=True)
        compile_once(layered)
        _load(layered)


def compile_once(layered: bool = False) -> None:
    """Compile every kernel of a simulation into the cache, unless it is there already.

    Of several processes that share a cache, the first compiles in a child process and the others wait. In a child,
    Ctrl-C takes effect at once and leaves no incomplete cache. If no child can be started, this process compiles and
    defers interrupts.
    """
    if is_compiled(layered):
        return
    lock = FileLock(CACHE / _LOCK)
    with suppress(OSError, NotImplementedError):  # on a file system without locks, every process compiles
        lock.acquire()
    try:
        if not is_compiled() and not is_compiled(layered=True):
            _empty_cache()  # an interrupted compilation may have left damaged entries
        if not is_compiled(layered):
            if not _compiled_elsewhere(layered):
                _load(layered)
            with suppress(OSError):
                _mark(layered).touch()
    finally:
        lock.release()


def _load(layered: bool) -> None:
    with put_off():  # Ctrl-C inside LLVM's code could make it free memory twice
        _smallest_simulation(layered)


def _empty_cache() -> None:
    """Remove the compiled code, but not the lock file, because this or another process may have locked it."""
    CACHE.mkdir(mode=0o700, parents=True, exist_ok=True)
    for path in CACHE.iterdir():
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        elif path.name != _LOCK:
            with suppress(OSError):
                path.unlink()


def is_compiled(layered: bool = False) -> bool:
    """Check for the marker file of a complete cache for this machine, without loading a kernel."""
    return _mark(layered).exists()


def _mark(layered: bool = False) -> Path:
    """Return the path of the file that marks a complete cache for this processor and version of Python."""
    name = f"complete-{llvmlite.binding.get_host_cpu_name()}-{platform.python_version()}"
    return CACHE / f"{name}{'-layers' if layered else ''}"


def _compiled_elsewhere(layered: bool) -> bool:
    """Compile in a child process; return True on success."""
    try:
        child = Child()
        try:
            _, error = child.call(pickle.dumps((_smallest_simulation, (layered,), {})))
            if error is not None:
                raise error
            child.dismiss()
        finally:
            child.kill()
    except Exception as error:
        logger.debug("compilation in another process failed", exc_info=error)
        return False
    return True


def _smallest_simulation(layered: bool) -> None:
    """Simulate a few steps of one element with an edge pressed into it and a time step that adds mass.

    The garbage collector is paused: with numba's many small objects it uses a seventh of the compile time.
    """
    wedge = Tool(corners=((0.5, 0.1), (1.0, 2.0), (0.0, 2.0)), radius=0.1, height=1.0, speed=-1.0, edge=0.5)
    law = Material(1.0e-9, 1000.0, 0.3, yield_stress=10.0)
    if layered:
        law = replace(law, transverse=Transverse(1000.0, 400.0, 0.3, 10.0, 6.0))
    smallest = Model(
        mesh=brick((1.0, 1.0, 1.0), (1, 1, 1)),
        material=law,
        tools=(wedge,),
        integration=Integration(outputs=1, precision="mixed", time_step=1.0e-9),
    )
    gc.disable()
    try:
        simulate(smallest, 1.0e-6)
    finally:
        gc.enable()
