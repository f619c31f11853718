"""A run of OpenRadioss: where starter, engine and ``th_to_csv`` lie, and how they run one after the other."""

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import SimulationFailed, UsageError
from stemcal.files.durable import write_atomic
from stemcal.note import nothing_deleted
from stemcal.processes import Ended, run_program
from stemcal.solvers.deck.model import STEM, Deck
from stemcal.solvers.deck.openradioss_output import (
    contact_force,
    deleted_elements,
    deletes_elements,
    differences,
    engine_ran,
    starter_accepted,
    table_made,
    text_left,
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
from stemcal.solvers.program import OUTPUT, executable, run_in
from stemcal.solvers.protocol import Answer
from stemcal.solvers.readers import read_text

HOME = "OPENRADIOSS_PATH"
# The version that the starter prints.
_VERSION = re.compile(r"^[ \t]*(?:Commit ?ID|Date of build)[ \t]*:[ \t]*\S.*$", re.MULTILINE | re.IGNORECASE)
_VERSION_S = 20.0  # for asking it
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
        If one of them is nowhere, or the definitions of keywords that the starter reads.
    """
    named = options.programs.get("home") or options.environment.get(HOME) or os.environ.get(HOME)
    home = None if named is None else folder / named
    if home is not None and not home.is_dir():
        raise UsageError(
            f"solver.programs.home: the folder {home} does not exist; give the folder of OpenRadioss, or set {HOME}"
        )
    given: Mapping[str, str] = {str(name): program for name, program in options.programs.items()}
    programs = {name: _program(name, given.get(name), home, folder) for name in _BEGINNINGS}
    if home is None and (at := Path(programs["starter"]).resolve().parent.parent / _DEFINITIONS_FOLDER).is_dir():
        home = at.parent  # of a starter on PATH
    environment = {**_variables(home), **options.environment}
    _require_definitions(environment)
    return _Installation(**programs, environment=environment)


def program_version(there: _Installation) -> str:
    """Return commit and date of build as the starter prints them; empty if it prints neither."""
    try:
        said = run_program([there.starter, "-version"], Path.cwd(), there.environment, _VERSION_S).output
    except OSError:
        return ""
    found = [" ".join(match[0].split()) for match in _VERSION.finditer(said)]
    return ", ".join(dict.fromkeys(found))


def _require_definitions(environment: Mapping[str, str]) -> None:
    """Refuse where the definitions of keywords are missing: without them the starter reads no deck."""
    named = environment.get(DEFINITIONS) or os.environ.get(DEFINITIONS)
    if named and Path(named).is_dir():
        return
    where = f"the folder {named} does not exist" if named else f"{DEFINITIONS} is not set"
    raise UsageError(
        f"solver.programs.home: {where}, so the starter ends every run with 'Check and set {DEFINITIONS} variable'; "
        f"put {_DEFINITIONS_FOLDER} of OpenRadioss into that folder, or set {DEFINITIONS} to its path"
    )


def _program(name: str, given: str | None, home: Path | None, folder: Path) -> str:
    if given is not None:
        return executable(given, folder, key=name)
    there = [] if home is None else (home / "exec").glob(f"{_BEGINNINGS[name]}*")
    found = sorted((path for path in there if os.access(path, os.X_OK)), key=lambda path: (len(path.name), path.name))
    if found:
        return str(found[0].absolute())
    for candidate in _ON_PATH[name]:
        try:
            return executable(candidate, folder, key=name)
        except UsageError:
            continue
    where = f"in {home / 'exec'} nor on PATH" if home is not None else f"on PATH, and {HOME} is not set"
    raise UsageError(
        f"solver.programs: no {name} was found {where}; install OpenRadioss, or give its path in solver.programs"
    )


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


_LEAST_SECONDS = 2.0  # for each program, also after one that took all of the time


def run(folder: Path, options: DeckSolver, spec_folder: Path, peak: Callable[..., Answer], deck: Deck) -> Answer:
    """Run the deck in `folder` and return its answer, or why there is none."""
    given = STARTER_INPUT if deck.nonlocal_length > 0.0 else DECK
    there, started = installation(options, spec_folder), partial(_starter_ran, folder, deck)
    return run_programs(folder, there, options, given, started, partial(_read, folder, peak))


def run_programs(
    folder: Path,
    there: _Installation,
    options: DeckSolver,
    given: str,
    starter_ran: Callable[[Ended], None],
    read: Callable[[Ended], Answer],
) -> Answer:
    """Run starter, engine and ``th_to_csv`` one after the other, in one time limit; then read the force.

    The starter begins with the file `given`; `starter_ran` raises if it went wrong, and leaves the engine its input.
    """
    options = options.model_copy(update={"environment": there.environment})
    steps: dict[str, tuple[list[str], Callable[[Ended], None], Callable[[Ended], Answer]]] = {
        "starter": ([there.starter, "-i", given, "-np", "1"], starter_ran, lambda _: Answer("ok")),
        "engine": ([there.engine, "-i", ENGINE_INPUT], partial(engine_ran, folder), lambda _: Answer("ok")),
        "th_to_csv": ([there.th_to_csv, HISTORY], partial(table_made, folder), read),
    }
    seconds: dict[str, float] = {}
    try:
        for name, (command, check, read_it) in steps.items():
            left = max(options.time_limit - sum(seconds.values()), _LEAST_SECONDS)
            answer = run_in(folder, command, options, read_it, left, check)
            seconds[name] = answer.details.get("program_seconds", 0.0)
            answer = replace(answer, details={**answer.details, "program_seconds": dict(seconds)})
            if not answer.ok:
                return answer
        return replace(answer, details={**answer.details, "program_version": program_version(there)})
    finally:
        for path in folder.glob("run_*.rst"):  # what takes most room and no one reads
            path.unlink(missing_ok=True)


def _read(folder: Path, peak: Callable[..., Answer], _ended: Ended) -> Answer:
    """Return the peak force by what the programs have left."""
    contact = contact_force(read_text(folder, TABLE))
    gone = deleted_elements(read_text(folder, ENGINE_LISTING), text_left(folder, OUTPUT))
    warnings = [] if deletes_elements(text_left(folder, STARTER_LISTING)) else [nothing_deleted()]
    return peak(contact, failed=gone, warnings=warnings)


def _starter_ran(folder: Path, deck: Deck, ended: Ended) -> None:
    """Raise unless the starter has read the deck as it was written; then leave the engine its input."""
    wrong = differences(starter_accepted(folder, ended), STEM, deck.material, deck.nonlocal_length)
    if wrong:
        raise SimulationFailed(
            "not_as_written", f"the starter read a material that differs from the deck: {'; '.join(wrong)}"
        )
    leave_engine_input(folder, engine_text(deck, "run") if deck.nonlocal_length > 0.0 else None)


def leave_engine_input(folder: Path, text: str | None) -> None:
    """Write the engine's input, by default what the starter has left for it, with the name of our runs and titles."""
    if (folder / ENGINE_INPUT).is_symlink():
        raise SimulationFailed(
            "no_engine_input", f"{ENGINE_INPUT} is a symbolic link, and stemcal does not write through links"
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
