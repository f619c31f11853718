"""Where OpenRadioss lies, and the environment its programs need."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import UsageError
from stemcal.solvers.programs.program_base import executable
from stemcal.study.model import OpenRadiossSolver

__all__ = ["HOME", "Installation", "installation"]

HOME = "OPENRADIOSS_PATH"
# Usual names begin so; what follows tells platform, precision and parallel library, the shortest is the plain one.
_BEGINNINGS = {"starter": "starter_", "engine": "engine_", "th_to_csv": "th_to_csv"}
_ON_PATH = {
    "starter": ("starter_linux64_gf", "starter_linuxa64_gf", "starter_win64", "starter"),
    "engine": ("engine_linux64_gf", "engine_linuxa64_gf", "engine_win64", "engine"),
    "th_to_csv": ("th_to_csv", "th_to_csv_linux64_gf", "th_to_csv_win64"),
}
_LIBRARIES = ("exec", "extlib/hm_reader/linux64", "extlib/h3d/lib/linux64")


class Installation(NamedTuple):
    """Full paths of the three programs, and variables to be set for them."""

    starter: str
    engine: str
    th_to_csv: str
    environment: dict[str, str]


def installation(options: OpenRadiossSolver, folder: Path) -> Installation:
    """Return the programs that a spec in `folder` means.

    Raises
    ------
    UsageError
        If one of them is nowhere.
    """
    named = options.home or options.environment.get(HOME) or os.environ.get(HOME)
    home = None if named is None else folder / named
    if home is not None and not home.is_dir():
        raise UsageError(f"solver.home: there is no folder {home}; name that of OpenRadioss, or set {HOME}")
    programs = {name: _program(name, getattr(options, name), home, folder) for name in _BEGINNINGS}
    return Installation(**programs, environment={**_variables(options, home), **options.environment})


def _program(name: str, given: str | None, home: Path | None, folder: Path) -> str:
    if given is not None:
        return executable(given, folder, key=name)
    found = sorted(_in_home(name, home), key=lambda path: (len(path.name), path.name))
    if found:
        return str(found[0].absolute())
    for candidate in _ON_PATH[name]:
        try:
            return executable(candidate, folder, key=name)
        except UsageError:
            continue
    where = f"in {home / 'exec'} nor on PATH" if home is not None else f"on PATH, and {HOME} is not set"
    raise UsageError(f"solver.{name}: there is no {name} {where}; install OpenRadioss, or name it as solver.{name}")


def _in_home(name: str, home: Path | None) -> list[Path]:
    if home is None:
        return []
    return [path for path in (home / "exec").glob(f"{_BEGINNINGS[name]}*") if os.access(path, os.X_OK)]


def _variables(options: OpenRadiossSolver, home: Path | None) -> dict[str, str]:
    """Return what OpenRadioss asks for, but for what the environment has already."""
    threads = {"OMP_NUM_THREADS": str(options.threads)}
    if home is None:
        return threads
    at = home.absolute()
    wanted = {
        HOME: str(at),
        "RAD_CFG_PATH": str(at / "hm_cfg_files"),
        "RAD_H3D_PATH": str(at / "extlib" / "h3d" / "lib" / "linux64"),
        "OMP_STACKSIZE": "400m",
    }
    libraries = [str(at / name) for name in _LIBRARIES]
    before = [path for path in (os.environ.get("LD_LIBRARY_PATH"),) if path]
    return {
        **{name: value for name, value in wanted.items() if name not in os.environ},
        "LD_LIBRARY_PATH": os.pathsep.join([*libraries, *before]),
        **threads,
    }
