"""Find the programs of OpenRadioss, run starter, engine and ``th_to_csv`` in sequence, and read their output."""

import csv
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stemcal.cutting.checks import nothing_deleted
from stemcal.cutting.result import along_travel
from stemcal.errors import SimulationFailed, UsageError
from stemcal.processes.program import ProgramRun, run_program
from stemcal.solvers.deck import writer
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.peak import ContactForce
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.program import OUTPUT, code_is_zero, run_in
from stemcal.solvers.protocol import Answer
from stemcal.solvers.readers import NUMBER, read_text, required_number
from stemcal.storage.atomic import write_atomic

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
    starter_input = writer.STARTER_INPUT if deck.nonlocal_lengths else writer.DECK
    programs, angle = installation(options, spec_folder), deck.study.blade.sliding_angle
    options = options.model_copy(update={"environment": programs.environment})
    steps: dict[str, tuple[list[str], Callable[[ProgramRun], Answer]]] = {
        "starter": ([programs.starter, "-i", starter_input, "-np", "1"], partial(starter_ran, folder, deck)),
        "engine": ([programs.engine, "-i", writer.ENGINE_INPUT], partial(engine_ran, folder)),
        "th_to_csv": ([programs.th_to_csv, writer.HISTORY], partial(table_made, folder, peak, angle=angle)),
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


# These patterns do not backtrack over long texts, so that the time to search a listing is proportional to its length.
_ERROR = re.compile(r"^ERROR ID :.*(?:\n(?!ERROR ID :|[ \t]*\.\.).*\S.*){0,6}", re.MULTILINE)
_VALUE = re.compile(rf"=[ \t]*({NUMBER})[ \t]*$", re.MULTILINE)
_FAILURE = re.compile(rf"^[ \t]+FIRST[ \t]+FAILURE PARAMETER \(D1\)[ \t.]*=[ \t]*({NUMBER})[ \t]*$", re.MULTILINE)
_DELETED = re.compile(rf"DELETE SOLID ELEMENT NUMBER[ \t]+(\d{{1,18}})(?:[ \t]+AT TIME :[ \t]*({NUMBER}))?")
_CYCLE = re.compile(rf"[ \t]*\d+[ \t]+({NUMBER})[ \t]+\d\S*[ \t]+[A-Z]+[ \t]+\d+")
_COLUMN = re.compile(r"TH-INTER (\d{1,18}) (?:.* )?F[NT]([YZ])")
_CLOSE = 2e-4  # relative tolerance of echoed values, some of which have only four digits


def engine_ran(folder: Path, finished: ProgramRun) -> Answer:
    """Raise `SimulationFailed` unless the engine has terminated normally."""
    printed = f"{_text_left(folder, writer.ENGINE_LISTING)}\n{finished.output}"
    if missing := re.search(r"ERROR: FILE (\S+) NOT FOUND", printed):
        message = f"the engine did not find {missing[1]}, the restart file that the starter should have written"
        raise SimulationFailed("no_restart", message)
    if finished.code == 0 and "NORMAL TERMINATION" in printed:
        return Answer("ok")
    if "ERROR TERMINATION" in printed:
        wrong = [line.strip() for line in printed.splitlines() if "** ERROR" in line]
        message = f"the engine stopped with an error{f': {wrong[0][:200]}' if wrong else ''}"
        raise SimulationFailed("engine_error", message)
    code_is_zero(finished)
    raise SimulationFailed("no_termination", "the engine did not report normal termination")


def table_made(folder: Path, peak: Callable[..., Answer], finished: ProgramRun, angle: float = 0.0) -> Answer:
    """Return the answer that `peak` makes from the table of time histories; `SimulationFailed` if there is none."""
    if finished.code != 0 or not (folder / writer.TABLE).is_file():
        because = "" if (folder / writer.HISTORY).is_file() else f": the engine wrote no {writer.HISTORY}"
        raise SimulationFailed("no_history", f"th_to_csv exited with code {finished.code} and wrote no table{because}")
    contact = force_in_histories(read_text(folder, writer.TABLE), angle)
    deleted = deleted_elements(read_text(folder, writer.ENGINE_LISTING), _text_left(folder, OUTPUT))
    warnings = [] if deletes_elements(_text_left(folder, writer.STARTER_LISTING)) else [nothing_deleted()]
    return peak(contact, failed=deleted, warnings=warnings)


def starter_ran(folder: Path, deck: Deck, finished: ProgramRun) -> Answer:
    """Raise `SimulationFailed` unless the starter has read the deck correctly; then write the engine's input."""
    listing = _text_left(folder, writer.STARTER_LISTING)
    if errors := starter_errors(listing) or starter_errors(finished.output):
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise SimulationFailed("starter_error", f"the starter rejected the deck: {errors[0]}{more}")
    code_is_zero(finished)
    if unread := values_not_read(listing, deck.material, deck.nonlocal_length):
        message = f"the starter did not read these values from the deck: {', '.join(unread)}"
        raise SimulationFailed("not_as_written", message)
    write_engine_input(folder, writer.engine_text(deck, "run") if deck.nonlocal_lengths else None)
    return Answer("ok")


def write_engine_input(folder: Path, text: str | None) -> None:
    """Write the engine input `text` (None: the starter's file), with the run name `run` and titles of histories."""
    if (folder / writer.ENGINE_INPUT).is_symlink():
        message = f"{writer.ENGINE_INPUT} is a symbolic link, and stemcal writes only to regular files"
        raise SimulationFailed("no_engine_input", message)
    try:
        engine = read_text(folder, writer.ENGINE_INPUT) if text is None else text
    except SimulationFailed as missing:
        raise SimulationFailed("no_engine_input", f"the starter wrote no {writer.ENGINE_INPUT}: {missing}") from None
    # the starter names the run `runk` (file name run.k without the dot), but the restart file `run`
    engine = re.sub(r"^/RUN/[^/\r\n]+/", "/RUN/run/", engine, flags=re.MULTILINE)
    if writer.TITLES not in engine:
        engine = f"{engine.rstrip()}\n{writer.TITLES}\n"
    write_atomic(folder / writer.ENGINE_INPUT, engine)


def values_not_read(listing: str, written: Mapping[str, float], nonlocal_length: float = 0.0) -> list[str]:
    """Return the values of the material card that the listing of the starter does not contain.

    The starter ignores keywords and fields that it does not support, without an error. `written` contains the values
    ``ro e pr sigy etan fail c p`` of the card. `nonlocal_length` is in mm, and 0 for local failure.
    """
    e, tangent = written["e"], written["etan"]
    values = {"density": written["ro"], "elastic modulus": e, "Poisson's ratio": written["pr"]}
    values |= {"yield stress": written["sigy"], "failure strain": written["fail"], "nonlocal length": nonlocal_length}
    values["plastic modulus"] = e * tangent / (e - tangent)
    values |= {"C": written["c"], "1/P": 1.0 / written["p"]} if written["c"] > 0.0 else {}
    echoed = np.array([required_number(value) for value in _VALUE.findall(listing)])
    return [
        f"{name} = {value:.6g}"
        for name, value in values.items()
        if value > 0.0 and not np.isclose(echoed, value, rtol=_CLOSE, atol=0.0).any()
    ]


def deletes_elements(listing: str) -> bool:
    """Check whether the listing of the starter contains a failure criterion, so that the engine deletes elements."""
    return _FAILURE.search(listing) is not None


def deleted_elements(listing: str, printed: str) -> list[float]:
    """Return the times (s) at which elements were deleted: as printed, or of the previous cycle in the listing."""
    times: dict[int, float] = {}
    now = 0.0
    for line in listing.splitlines():
        if (cycle := _CYCLE.match(line)) is not None:
            now = required_number(cycle[1])
        elif (deleted := _DELETED.search(line)) is not None:
            times[int(deleted[1])] = now
    times.update((int(number), required_number(time)) for number, time in _DELETED.findall(printed) if time)
    return sorted(times.values())


def force_in_histories(text: str, angle: float = 0.0) -> ContactForce:
    """Return the force of the blade contact along the travel, from FNZ + FTZ and, with an angle (°), FNY + FTY.

    OpenRadioss stores impulses; ``th_to_csv`` converts those with a title to forces. Raises `SimulationFailed`:
    ``impulse`` if the table has no titles or its force never decreases, ``no_result`` if the contact is missing,
    ``nan`` or ``bad_result`` for invalid numbers.
    """
    try:
        header, *rows = csv.reader(text.splitlines())
    except (csv.Error, ValueError) as error:
        raise SimulationFailed("bad_result", f"the table of time histories is not valid CSV: {error}") from None
    names = [" ".join(name.split()) for name in header]
    # index, contact and axis of each column with a force along y or z
    columns = [(i, int(match[1]), match[2]) for i, name in enumerate(names) if (match := _COLUMN.fullmatch(name))]
    of_blade = {axis: [i for i, *of in columns if of == [writer.BLADE_CONTACT, axis]] for axis in "ZY"}
    read = of_blade["Z"] + of_blade["Y" if angle else "Z"]
    if not columns:
        raise SimulationFailed(
            "impulse",
            "the time histories have no titles, so they may contain impulses instead of forces; the engine file must "
            f"contain {writer.TITLES}, and th_to_csv needs the file runT01_TITLES",
        )
    if len(read) != 4:
        there = sorted({contact for _, contact, _ in columns})
        message = f"the time histories contain no force for contact {writer.BLADE_CONTACT} (contacts found: {there})"
        raise SimulationFailed("no_result", message)
    try:
        values = np.array([[required_number(row[index]) for index in (0, *read)] for row in rows if row])
    except IndexError:
        raise SimulationFailed("bad_result", "the table of time histories has an incomplete row") from None
    time, *forces = values.reshape(-1, 5).T
    blade = ContactForce.of(time, along_travel(forces[0] + forces[1], forces[2] + forces[3], angle), writer.TABLE)
    if blade.force.max() > 0.0 and (np.diff(blade.force) >= 0.0).all():
        raise SimulationFailed(
            "impulse",
            "the blade force never decreases, so the time histories contain impulses instead of forces; "
            "install th_to_csv from the same OpenRadioss version",
        )
    return blade


def starter_errors(text: str) -> list[str]:
    """Return the errors in a listing or in printed output, each in one line with its description."""
    return [" ".join(match[0].split())[:300] for match in _ERROR.finditer(text.replace("\r\n", "\n"))]


def _text_left(folder: Path, name: str) -> str:
    """Return the content of a text file of the run; empty if there is no such file."""
    try:
        return read_text(folder, name)
    except SimulationFailed:
        return ""
