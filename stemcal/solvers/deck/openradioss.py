"""Find the programs of OpenRadioss, and run starter, engine and ``th_to_csv`` in sequence."""

import os
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import UsageError
from stemcal.processes.program import ProgramRun, run_program
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.openradioss_output import engine_ran, starter_ran, table_made
from stemcal.solvers.deck.writer import DECK, ENGINE_INPUT, HISTORY, STARTER_INPUT
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.program import run_in
from stemcal.solvers.protocol import Answer

HOME = "OPENRADIOSS_PATH"
# Lines with the version in the output of the starter.
_VERSION = re.compile(r"^[ \t]*(?:Commit ?ID|Date of build)[ \t]*:[ \t]*\S.*$", re.MULTILINE | re.IGNORECASE)
_VERSION_S = 20.0  # time limit for printing the version
# Program names begin with these texts and end with platform, precision and parallel library; the shortest is used.
_BEGINNINGS = {"starter": "starter_", "engine": "engine_", "th_to_csv": "th_to_csv"}
_LIBRARIES = ("exec", "extlib/hm_reader/linux64", "extlib/h3d/lib/linux64")
_DEFINITIONS = "hm_cfg_files"  # folder with the definitions of keywords, which the starter needs to read a deck


class _Installation(NamedTuple):
    """Full paths of the three programs, and the environment variables that they need."""

    starter: str
    engine: str
    th_to_csv: str
    environment: dict[str, str]


def installation(options: DeckSolver, folder: Path) -> _Installation:
    """Return the OpenRadioss programs for a spec in `folder`; `UsageError` if their folder is unknown or incomplete."""
    named = options.home or options.environment.get(HOME) or os.environ.get(HOME)
    if named is None:
        remedy = f"add `home: FOLDER`, or set the environment variable {HOME}"
        raise UsageError(f"solver.home: the OpenRadioss folder is unknown; {remedy}")
    home = (folder / named).absolute()
    if not (home / _DEFINITIONS).is_dir():
        raise UsageError(
            f"solver.home: {home} does not contain the folder {_DEFINITIONS}, which the starter requires; "
            "specify the OpenRadioss folder that contains `exec`, `extlib` and `hm_cfg_files`"
        )
    libraries = [*(str(home / name) for name in _LIBRARIES), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
    environment = {
        HOME: str(home),
        "RAD_CFG_PATH": str(home / _DEFINITIONS),
        "RAD_H3D_PATH": str(home / "extlib" / "h3d" / "lib" / "linux64"),
        "OMP_STACKSIZE": "400m",
        "OMP_NUM_THREADS": "1",
        "LD_LIBRARY_PATH": os.pathsep.join(libraries),
        **options.environment,
    }
    programs: dict[str, str] = {}
    for name, beginning in _BEGINNINGS.items():
        paths = [path for path in (home / "exec").glob(f"{beginning}*") if os.access(path, os.X_OK)]
        if not paths:
            raise UsageError(f"solver.home: {home / 'exec'} does not contain {name}; install the complete package")
        programs[name] = str(min(paths, key=lambda path: (len(path.name), path.name)))
    return _Installation(**programs, environment=environment)


_LEAST_SECONDS = 2.0  # time limit of a program after the previous programs have used the whole time limit of the run


def run(folder: Path, options: DeckSolver, spec_folder: Path, peak: Callable[..., Answer], deck: Deck) -> Answer:
    """Run starter, engine and ``th_to_csv`` on the deck in `folder` within one time limit; return the answer."""
    starter_input = STARTER_INPUT if deck.nonlocal_lengths else DECK
    programs = installation(options, spec_folder)
    options = options.model_copy(update={"environment": programs.environment})
    steps: dict[str, tuple[list[str], Callable[[ProgramRun], Answer]]] = {
        "starter": ([programs.starter, "-i", starter_input, "-np", "1"], partial(starter_ran, folder, deck)),
        "engine": ([programs.engine, "-i", ENGINE_INPUT], partial(engine_ran, folder)),
        "th_to_csv": ([programs.th_to_csv, HISTORY], partial(table_made, folder, peak)),
    }
    seconds: dict[str, float] = {}
    try:
        for name, (command, read) in steps.items():
            left = max(options.time_limit - sum(seconds.values()), _LEAST_SECONDS)
            answer = run_in(folder, command, options, read, left)
            seconds[name] = answer.details.get("program_seconds", 0.0)
            answer = replace(answer, details={**answer.details, "program_seconds": dict(seconds)})
            if not answer.ok:
                return answer
        return replace(answer, details={**answer.details, "program_version": _program_version(programs)})
    finally:
        for path in folder.glob("run_*.rst"):  # restart files, which are the largest files and no longer needed
            path.unlink(missing_ok=True)


def _program_version(programs: _Installation) -> str:
    """Return the commit and build date that the starter prints; empty if it prints neither."""
    try:
        printed = run_program([programs.starter, "-version"], Path.cwd(), programs.environment, _VERSION_S).output
    except OSError:
        return ""
    return ", ".join(dict.fromkeys(" ".join(match[0].split()) for match in _VERSION.finditer(printed)))
