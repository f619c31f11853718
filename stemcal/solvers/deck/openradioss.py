"""A run of OpenRadioss: starter, engine and ``th_to_csv``, and what they may leave instead of a force."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import SimulationFailed
from stemcal.files.durable import write_atomic
from stemcal.processes import Ended
from stemcal.run_warnings import nothing_deleted
from stemcal.solvers.deck.installation import Installation, installation, program_version
from stemcal.solvers.deck.listing import (
    contact_force,
    deleted_elements,
    deletes_elements,
    differences,
    is_normal_end,
    problems,
)
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.radioss_files import (
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
from stemcal.solvers.deck.writer import STEM
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.programs.inputs import OUTPUT
from stemcal.solvers.programs.program_base import code_is_zero, run_in
from stemcal.solvers.programs.readers import read_text
from stemcal.solvers.protocol import Answer

_LEAST_SECONDS = 2.0  # for each program, also after one that took all of the time


class _Step(NamedTuple):
    """One program of a run: its name, command, and what raises `SimulationFailed` if it ended badly."""

    name: str
    command: Sequence[str]
    check: Callable[[Ended], None]


def prepare(options: DeckSolver, folder: Path) -> None:
    """Refuse to begin if a program is not there; `folder` is that of the spec."""
    installation(options, folder)


def run(folder: Path, options: DeckSolver, spec_folder: Path, peak: Callable[..., Answer], deck: Deck) -> Answer:
    """Run the deck in `folder` and return its answer, or why there is none."""
    given = STARTER_INPUT if deck.nonlocal_length > 0.0 else DECK
    there, started = installation(options, spec_folder), partial(_starter_ran, folder, deck)
    return run_programs(folder, there, options, given, started, partial(_read, folder, options, peak))


def run_programs(
    folder: Path,
    there: Installation,
    options: DeckSolver,
    given: str,
    starter_ran: Callable[[Ended], None],
    read: Callable[[Ended], Answer],
) -> Answer:
    """Run starter, engine and ``th_to_csv`` one after the other, in one time limit; then read the force.

    The starter begins with the file `given`; `starter_ran` raises if it went wrong, and leaves the engine its input.
    """
    options = options.model_copy(update={"environment": there.environment})
    *first, last = (
        _Step("starter", [there.starter, "-i", given, "-np", "1"], starter_ran),
        _Step("engine", [there.engine, "-i", ENGINE_INPUT], partial(_engine_ran, folder)),
        _Step("th_to_csv", [there.th_to_csv, HISTORY], partial(_table_made, folder)),
    )
    seconds: dict[str, float] = {}

    def run(step: _Step, read: Callable[[Ended], Answer]) -> Answer:
        left = max(options.time_limit - sum(seconds.values()), _LEAST_SECONDS)
        answer = run_in(folder, step.command, options, read, left, step.check)
        seconds[step.name] = answer.details.get("program_seconds", 0.0)
        return replace(answer, details={**answer.details, "program_seconds": dict(seconds)})

    try:
        for step in first:
            answer = run(step, lambda _: Answer("ok"))
            if not answer.ok:
                return answer
        answer = run(last, read)
        return replace(answer, details={**answer.details, "program_version": program_version(there)})
    finally:
        for path in folder.glob("run_*.rst"):  # what takes most room and no one reads
            path.unlink(missing_ok=True)


def _read(folder: Path, options: DeckSolver, peak: Callable[..., Answer], _ended: Ended) -> Answer:
    """Return the peak force by what the programs have left."""
    contact = contact_force(read_text(folder, TABLE), 1)
    gone = deleted_elements(read_text(folder, ENGINE_LISTING), _text_left(folder, OUTPUT))
    warnings = [] if deletes_elements(_text_left(folder, STARTER_LISTING)) else [nothing_deleted()]
    return peak(contact, failed=gone, warnings=warnings)


def _starter_ran(folder: Path, deck: Deck, ended: Ended) -> None:
    """Raise unless the starter has read the deck as it was written; then leave the engine its input."""
    wrong = differences(starter_accepted(folder, ended), STEM, deck.material, deck.nonlocal_length)
    if wrong:
        raise SimulationFailed(
            "not_as_written", f"the starter read another material than was written: {'; '.join(wrong)}"
        )
    leave_engine_input(folder, engine_text(deck, "run") if deck.nonlocal_length > 0.0 else None)


def starter_accepted(folder: Path, ended: Ended) -> str:
    """Return the starter's listing; raise `SimulationFailed` if it reports errors."""
    listing = _text_left(folder, STARTER_LISTING)
    found = problems(listing) or problems(ended.output)
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise SimulationFailed("starter_error", f"the starter refused the deck: {found[0]}{more}")
    code_is_zero(ended)
    return listing


def leave_engine_input(folder: Path, text: str | None) -> None:
    """Write the engine's input, by default what the starter has left for it, with the name of our runs and titles."""
    if (folder / ENGINE_INPUT).is_symlink():
        raise SimulationFailed("no_engine_input", f"{ENGINE_INPUT} is a link, which is not written through")
    try:
        engine = read_text(folder, ENGINE_INPUT) if text is None else text
    except SimulationFailed as missing:
        raise SimulationFailed("no_engine_input", f"the starter wrote no {ENGINE_INPUT}: {missing}") from None
    # the starter calls the run after the whole name of the deck, runk; its restart file is run's
    engine = re.sub(r"^/RUN/[^/\r\n]+/", "/RUN/run/", engine, flags=re.MULTILINE)
    if TITLES not in engine:
        engine = f"{engine.rstrip()}\n{TITLES}\n"
    write_atomic(folder / ENGINE_INPUT, engine)


def _engine_ran(folder: Path, ended: Ended) -> None:
    """Raise `SimulationFailed` unless the engine came to its normal end."""
    said = f"{_text_left(folder, ENGINE_LISTING)}\n{ended.output}"
    if missing := re.search(r"ERROR: FILE (\S+) NOT FOUND", said):
        raise SimulationFailed(
            "no_restart", f"the engine found no {missing[1]}: the starter's restart file is not there"
        )
    if ended.code == 0 and is_normal_end(said):
        return
    if "ERROR TERMINATION" in said:
        wrong = [line.strip() for line in said.splitlines() if "** ERROR" in line]
        raise SimulationFailed(
            "engine_error", f"the engine stopped with an error{f': {wrong[0][:200]}' if wrong else ''}"
        )
    code_is_zero(ended)
    raise SimulationFailed("no_termination", "the engine did not report normal termination")


def _table_made(folder: Path, ended: Ended) -> None:
    """Raise `SimulationFailed` unless there is a table of the time histories."""
    if ended.code != 0 or not (folder / TABLE).is_file():
        because = "" if (folder / HISTORY).is_file() else f": the engine wrote no {HISTORY}"
        raise SimulationFailed("no_history", f"th_to_csv ended with code {ended.code} and no table{because}")


def _text_left(folder: Path, name: str) -> str:
    """Return a text file of the run, empty if there is none."""
    try:
        return read_text(folder, name)
    except SimulationFailed:
        return ""
