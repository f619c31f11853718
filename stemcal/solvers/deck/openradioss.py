"""A run of OpenRadioss: where starter, engine and ``th_to_csv`` lie, and how they run one after the other."""

import os
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import SimulationFailed, UsageError
from stemcal.files.durable import write_atomic
from stemcal.note import nothing_deleted
from stemcal.processes import Ended, run_program
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.openradioss_output import (
    contact_force,
    deleted_elements,
    deletes_elements,
    require_normal_termination,
    starter_accepted,
    text_left,
    values_not_read,
)
from stemcal.solvers.deck.writer import (
    DECK,
    ENGINE_INPUT,
    ENGINE_LISTING,
    HISTORY,
    STARTER_INPUT,
    STARTER_LISTING,
    TABLE,
    TITLES,
    engine_text,
)
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.program import OUTPUT, run_in
from stemcal.solvers.protocol import Answer
from stemcal.solvers.readers import read_text

HOME = "OPENRADIOSS_PATH"
# The version that the starter prints.
_VERSION = re.compile(r"^[ \t]*(?:Commit ?ID|Date of build)[ \t]*:[ \t]*\S.*$", re.MULTILINE | re.IGNORECASE)
_VERSION_S = 20.0  # for asking it
# Names of the programs begin so; the rest is platform, precision and parallel library; the shortest is the plain one.
_BEGINNINGS = {"starter": "starter_", "engine": "engine_", "th_to_csv": "th_to_csv"}
_LIBRARIES = ("exec", "extlib/hm_reader/linux64", "extlib/h3d/lib/linux64")
_DEFINITIONS = "hm_cfg_files"  # the folder of the definitions of keywords, without which the starter reads no deck


class _Installation(NamedTuple):
    """Full paths of the three programs, and variables to be set for them."""

    starter: str
    engine: str
    th_to_csv: str
    environment: dict[str, str]


def installation(options: DeckSolver, folder: Path) -> _Installation:
    """Return the programs that a spec in `folder` means.

    Raises
    ------
    UsageError
        If there is no folder of OpenRadioss, or one of the programs or the definitions of keywords is not in it.
    """
    named = options.home or options.environment.get(HOME) or os.environ.get(HOME)
    if named is None:
        raise UsageError(
            f"solver.home: the OpenRadioss folder is unknown; add `home: FOLDER`, or set the environment "
            f"variable {HOME}"
        )
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
    return _Installation(**{name: _program(home, name) for name in _BEGINNINGS}, environment=environment)


def _program(home: Path, name: str) -> str:
    there = (path for path in (home / "exec").glob(f"{_BEGINNINGS[name]}*") if os.access(path, os.X_OK))
    if not (found := sorted(there, key=lambda path: (len(path.name), path.name))):
        raise UsageError(f"solver.home: {home / 'exec'} does not contain {name}; install the complete package")
    return str(found[0])


_LEAST_SECONDS = 2.0  # for each program, also after one that took all of the time


def run(folder: Path, options: DeckSolver, spec_folder: Path, peak: Callable[..., Answer], deck: Deck) -> Answer:
    """Run starter, engine and ``th_to_csv`` on the deck in `folder`, in one time limit; return the answer."""
    given = STARTER_INPUT if deck.nonlocal_length > 0.0 else DECK
    there = installation(options, spec_folder)
    options = options.model_copy(update={"environment": there.environment})
    steps: dict[str, tuple[list[str], Callable[[Ended], Answer]]] = {
        "starter": ([there.starter, "-i", given, "-np", "1"], partial(_starter_ran, folder, deck)),
        "engine": ([there.engine, "-i", ENGINE_INPUT], partial(_engine_ran, folder)),
        "th_to_csv": ([there.th_to_csv, HISTORY], partial(_table_made, folder, peak)),
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
        return replace(answer, details={**answer.details, "program_version": _program_version(there)})
    finally:
        for path in folder.glob("run_*.rst"):  # what takes most room and no one reads
            path.unlink(missing_ok=True)


def _program_version(there: _Installation) -> str:
    """Return commit and date of build as the starter prints them; empty if it prints neither."""
    try:
        said = run_program([there.starter, "-version"], Path.cwd(), there.environment, _VERSION_S).output
    except OSError:
        return ""
    found = [" ".join(match[0].split()) for match in _VERSION.finditer(said)]
    return ", ".join(dict.fromkeys(found))


def _engine_ran(folder: Path, ended: Ended) -> Answer:
    """Raise unless the engine came to its normal end."""
    require_normal_termination(folder, ended)
    return Answer("ok")


def _table_made(folder: Path, peak: Callable[..., Answer], ended: Ended) -> Answer:
    """Return the peak force by what the programs have left; raise if there is no table of the time histories."""
    if ended.code != 0 or not (folder / TABLE).is_file():
        because = "" if (folder / HISTORY).is_file() else f": the engine wrote no {HISTORY}"
        raise SimulationFailed("no_history", f"th_to_csv exited with code {ended.code} and wrote no table{because}")
    contact = contact_force(read_text(folder, TABLE))
    gone = deleted_elements(read_text(folder, ENGINE_LISTING), text_left(folder, OUTPUT))
    warnings = [] if deletes_elements(text_left(folder, STARTER_LISTING)) else [nothing_deleted()]
    return peak(contact, failed=gone, warnings=warnings)


def _starter_ran(folder: Path, deck: Deck, ended: Ended) -> Answer:
    """Raise unless the starter has read the deck as it was written; then leave the engine its input."""
    if unread := values_not_read(starter_accepted(folder, ended), deck.material, deck.nonlocal_length):
        raise SimulationFailed(
            "not_as_written", f"the starter did not read these values from the deck: {', '.join(unread)}"
        )
    leave_engine_input(folder, engine_text(deck, "run") if deck.nonlocal_length > 0.0 else None)
    return Answer("ok")


def leave_engine_input(folder: Path, text: str | None) -> None:
    """Write the engine's input, by default what the starter has left for it, with the name of our runs and titles."""
    if (folder / ENGINE_INPUT).is_symlink():
        raise SimulationFailed(
            "no_engine_input", f"{ENGINE_INPUT} is a symbolic link, and stemcal writes only to regular files"
        )
    try:
        engine = read_text(folder, ENGINE_INPUT) if text is None else text
    except SimulationFailed as missing:
        raise SimulationFailed("no_engine_input", f"the starter wrote no {ENGINE_INPUT}: {missing}") from None
    # the starter calls the run after the whole name of the deck, runk; its restart file is run's
    engine = re.sub(r"^/RUN/[^/\r\n]+/", "/RUN/run/", engine, flags=re.MULTILINE)
    if TITLES not in engine:
        engine = f"{engine.rstrip()}\n{TITLES}\n"
    write_atomic(folder / ENGINE_INPUT, engine)
