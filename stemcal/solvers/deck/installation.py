"""The folder of OpenRadioss, and the environment of its programs."""

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import UsageError
from stemcal.processes import run_program
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.programs.program_base import executable

HOME = "OPENRADIOSS_PATH"
# Version that the starter prints, and the time limit for it in seconds.
_VERSION, _VERSION_S = (
    re.compile(r"^[ \t]*(?:Commit ?ID|Date of build)[ \t]*:[ \t]*\S.*$", re.MULTILINE | re.IGNORECASE),
    20.0,
)
# Usual names begin so; the rest is platform, precision and parallel library; the shortest is the plain one.
_BEGINNINGS = {"starter": "starter_", "engine": "engine_", "th_to_csv": "th_to_csv"}
_ON_PATH = {
    "starter": ("starter_linux64_gf", "starter_linuxa64_gf", "starter_win64", "starter"),
    "engine": ("engine_linux64_gf", "engine_linuxa64_gf", "engine_win64", "engine"),
    "th_to_csv": ("th_to_csv", "th_to_csv_linux64_gf", "th_to_csv_win64"),
}
_LIBRARIES = ("exec", "extlib/hm_reader/linux64", "extlib/h3d/lib/linux64")
# Where the definitions of keywords lie: the variable that names the folder, and its name in a home.
DEFINITIONS, _DEFINITIONS_FOLDER = "RAD_CFG_PATH", "hm_cfg_files"


class Installation(NamedTuple):
    """Full paths of the three programs, and variables to be set for them."""

    starter: str
    engine: str
    th_to_csv: str
    environment: dict[str, str]


def installation(options: DeckSolver, folder: Path) -> Installation:
    """Return the programs that a spec in `folder` means.

    Raises
    ------
    UsageError
        If one of them is nowhere, or the definitions of keywords that the starter reads.
    """
    named = options.programs.get("home") or options.environment.get(HOME) or os.environ.get(HOME)
    home = None if named is None else folder / named
    if home is not None and not home.is_dir():
        raise UsageError(f"solver.programs.home: there is no folder {home}; name that of OpenRadioss, or set {HOME}")
    given: Mapping[str, str] = {str(name): program for name, program in options.programs.items()}
    programs = {name: _program(name, given.get(name), home, folder) for name in _BEGINNINGS}
    environment = {**_variables(home or _home_of(programs["starter"])), **options.environment}
    _require_definitions(environment)
    return Installation(**programs, environment=environment)


def program_version(there: Installation) -> str:
    """Return commit and date of build as the starter prints them; empty if it prints neither."""
    try:
        said = run_program([there.starter, "-version"], Path.cwd(), there.environment, _VERSION_S).output
    except OSError:
        return ""
    found = [" ".join(match[0].split()) for match in _VERSION.finditer(said)]
    return ", ".join(dict.fromkeys(found))


def _home_of(starter: str) -> Path | None:
    """Return the home that a starter on PATH is in, if it is one."""
    home = Path(starter).resolve().parent.parent
    return home if (home / _DEFINITIONS_FOLDER).is_dir() else None


def _require_definitions(environment: Mapping[str, str]) -> None:
    """Refuse where the definitions of keywords are missing: without them the starter reads no deck."""
    named = environment.get(DEFINITIONS) or os.environ.get(DEFINITIONS)
    if named and Path(named).is_dir():
        return
    where = f"there is no folder {named}" if named else f"{DEFINITIONS} is not set"
    raise UsageError(
        f"solver.programs.home: {where}, so the starter ends every run with 'Check "
        f"and set {DEFINITIONS} variable'; put {_DEFINITIONS_FOLDER} of OpenRadioss there, or set {DEFINITIONS} to it"
    )


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
    raise UsageError(f"solver.programs: there is no {name} {where}; install OpenRadioss, or name it in solver.programs")


def _in_home(name: str, home: Path | None) -> list[Path]:
    if home is None:
        return []
    return [path for path in (home / "exec").glob(f"{_BEGINNINGS[name]}*") if os.access(path, os.X_OK)]


def _variables(home: Path | None) -> dict[str, str]:
    """Return what OpenRadioss asks for, but for what the environment has already; a run has one thread."""
    threads = {"OMP_NUM_THREADS": "1"}
    if home is None:
        return threads
    at = home.absolute()
    wanted = {
        HOME: str(at),
        DEFINITIONS: str(at / _DEFINITIONS_FOLDER),
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
