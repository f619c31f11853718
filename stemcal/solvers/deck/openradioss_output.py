"""Read the output of OpenRadioss: errors, echoed values, termination, deleted elements and the blade force."""

import csv
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from stemcal.cutting.checks import nothing_deleted
from stemcal.errors import SimulationFailed
from stemcal.processes.program import ProgramRun
from stemcal.solvers.deck import writer
from stemcal.solvers.deck.contact_card import BLADE_CONTACT
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.peak import ContactForce
from stemcal.solvers.program import OUTPUT, code_is_zero
from stemcal.solvers.protocol import Answer
from stemcal.solvers.readers import NUMBER, read_text, required_number
from stemcal.storage.atomic import write_atomic

# These patterns do not backtrack over long texts, so that the time to search a listing is proportional to its length.
_ERROR = re.compile(r"^ERROR ID :.*(?:\n(?!ERROR ID :|[ \t]*\.\.).*\S.*){0,6}", re.MULTILINE)
_VALUE = re.compile(rf"=[ \t]*({NUMBER})[ \t]*$", re.MULTILINE)
_FAILURE = re.compile(rf"^[ \t]+FIRST[ \t]+FAILURE PARAMETER \(D1\)[ \t.]*=[ \t]*({NUMBER})[ \t]*$", re.MULTILINE)
_DELETED = re.compile(rf"DELETE SOLID ELEMENT NUMBER[ \t]+(\d{{1,18}})(?:[ \t]+AT TIME :[ \t]*({NUMBER}))?")
_CYCLE = re.compile(rf"[ \t]*\d+[ \t]+({NUMBER})[ \t]+\d\S*[ \t]+[A-Z]+[ \t]+\d+")
_COLUMN = re.compile(r"TH-INTER (\d{1,18}) (?:.* )?(F[NT]Z)")
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


def table_made(folder: Path, peak: Callable[..., Answer], finished: ProgramRun) -> Answer:
    """Return the answer that `peak` makes from the table of time histories; `SimulationFailed` if there is none."""
    if finished.code != 0 or not (folder / writer.TABLE).is_file():
        because = "" if (folder / writer.HISTORY).is_file() else f": the engine wrote no {writer.HISTORY}"
        raise SimulationFailed("no_history", f"th_to_csv exited with code {finished.code} and wrote no table{because}")
    contact = force_in_histories(read_text(folder, writer.TABLE))
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


def force_in_histories(text: str) -> ContactForce:
    """Return the force of the blade contact along z, FNZ + FTZ, from the table of time histories.

    OpenRadioss stores impulses; ``th_to_csv`` converts those with a title to forces. Raises `SimulationFailed`:
    ``impulse`` if the table has no titles or its force never decreases, ``no_result`` if the contact is missing,
    ``nan`` or ``bad_result`` for invalid numbers.
    """
    try:
        header, *rows = csv.reader(text.splitlines())
    except (csv.Error, ValueError) as error:
        raise SimulationFailed("bad_result", f"the table of time histories is not valid CSV: {error}") from None
    names = [" ".join(name.split()) for name in header]
    # index and contact of each column with a force along z
    columns = [(i, int(match[1])) for i, name in enumerate(names) if (match := _COLUMN.fullmatch(name)) is not None]
    of_blade = [index for index, contact in columns if contact == BLADE_CONTACT]
    if not columns:
        raise SimulationFailed(
            "impulse",
            "the time histories have no titles, so they may contain impulses instead of forces; the engine file must "
            f"contain {writer.TITLES}, and th_to_csv needs the file runT01_TITLES",
        )
    if len(of_blade) != 2:
        there = sorted({contact for _, contact in columns})
        message = f"the time histories contain no force for contact {BLADE_CONTACT} (contacts found: {there})"
        raise SimulationFailed("no_result", message)
    try:
        values = np.array([[required_number(row[index]) for index in (0, *of_blade)] for row in rows if row])
    except IndexError:
        raise SimulationFailed("bad_result", "the table of time histories has an incomplete row") from None
    time, normal, tangential = values.reshape(-1, 3).T
    blade = ContactForce.of(time, normal + tangential, writer.TABLE)
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
