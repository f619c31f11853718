"""What OpenRadioss leaves: errors, echoed values, termination, deleted elements, forces; or why a run has failed."""

import csv
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from stemcal.cutting.checks import nothing_deleted
from stemcal.errors import SimulationFailed
from stemcal.processes.program import Ended
from stemcal.solvers.deck.contact_card import BLADE_CONTACT
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.peak import ContactForce
from stemcal.solvers.deck.writer import (
    ENGINE_INPUT,
    ENGINE_LISTING,
    HISTORY,
    STARTER_LISTING,
    TABLE,
    TITLES,
    engine_text,
)
from stemcal.solvers.program import OUTPUT, code_is_zero
from stemcal.solvers.protocol import Answer
from stemcal.solvers.readers import NUMBER, read_text, required_number
from stemcal.storage.atomic import write_atomic

# No pattern goes beyond a line, or over the same letters twice: a listing of nothing but line ends takes no time.
_ERROR = re.compile(r"^ERROR ID :.*(?:\n(?!ERROR ID :|[ \t]*\.\.).*\S.*){0,6}", re.MULTILINE)
_VALUE = re.compile(rf"=[ \t]*({NUMBER})[ \t]*$", re.MULTILINE)
_FAILURE = re.compile(rf"^[ \t]+FIRST[ \t]+FAILURE PARAMETER \(D1\)[ \t.]*=[ \t]*({NUMBER})[ \t]*$", re.MULTILINE)
_DELETED = re.compile(rf"DELETE SOLID ELEMENT NUMBER[ \t]+(\d{{1,18}})(?:[ \t]+AT TIME :[ \t]*({NUMBER}))?")
_CYCLE = re.compile(rf"[ \t]*\d+[ \t]+({NUMBER})[ \t]+\d\S*[ \t]+[A-Z]+[ \t]+\d+")
_COLUMN = re.compile(r"TH-INTER (\d{1,18}) (?:.* )?(F[NT]Z)")
# Echoes have 13 digits, or four.
_CLOSE = 2e-4


def engine_ran(folder: Path, ended: Ended) -> Answer:
    """Raise unless the engine came to its normal end."""
    printed = f"{text_left(folder, ENGINE_LISTING)}\n{ended.output}"
    if missing := re.search(r"ERROR: FILE (\S+) NOT FOUND", printed):
        message = f"the engine did not find {missing[1]}, the restart file that the starter should have written"
        raise SimulationFailed("no_restart", message)
    if ended.code == 0 and "NORMAL TERMINATION" in printed:
        return Answer("ok")
    if "ERROR TERMINATION" in printed:
        wrong = [line.strip() for line in printed.splitlines() if "** ERROR" in line]
        message = f"the engine stopped with an error{f': {wrong[0][:200]}' if wrong else ''}"
        raise SimulationFailed("engine_error", message)
    code_is_zero(ended)
    raise SimulationFailed("no_termination", "the engine did not report normal termination")


def table_made(folder: Path, peak: Callable[..., Answer], ended: Ended) -> Answer:
    """Return the peak force by what the programs have left; raise if there is no table of the time histories."""
    if ended.code != 0 or not (folder / TABLE).is_file():
        because = "" if (folder / HISTORY).is_file() else f": the engine wrote no {HISTORY}"
        raise SimulationFailed("no_history", f"th_to_csv exited with code {ended.code} and wrote no table{because}")
    contact = force_in_histories(read_text(folder, TABLE))
    gone = deleted_elements(read_text(folder, ENGINE_LISTING), text_left(folder, OUTPUT))
    warnings = [] if deletes_elements(text_left(folder, STARTER_LISTING)) else [nothing_deleted()]
    return peak(contact, failed=gone, warnings=warnings)


def starter_ran(folder: Path, deck: Deck, ended: Ended) -> Answer:
    """Raise unless the starter has read the deck as it was written; then leave the engine its input."""
    listing = text_left(folder, STARTER_LISTING)
    if found := starter_errors(listing) or starter_errors(ended.output):
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise SimulationFailed("starter_error", f"the starter rejected the deck: {found[0]}{more}")
    code_is_zero(ended)
    if unread := values_not_read(listing, deck.material, deck.nonlocal_length):
        message = f"the starter did not read these values from the deck: {', '.join(unread)}"
        raise SimulationFailed("not_as_written", message)
    leave_engine_input(folder, engine_text(deck, "run") if deck.nonlocal_lengths else None)
    return Answer("ok")


def leave_engine_input(folder: Path, text: str | None) -> None:
    """Write the engine's input, by default what the starter has left for it, with the name of our runs and titles."""
    if (folder / ENGINE_INPUT).is_symlink():
        message = f"{ENGINE_INPUT} is a symbolic link, and stemcal writes only to regular files"
        raise SimulationFailed("no_engine_input", message)
    try:
        engine = read_text(folder, ENGINE_INPUT) if text is None else text
    except SimulationFailed as missing:
        raise SimulationFailed("no_engine_input", f"the starter wrote no {ENGINE_INPUT}: {missing}") from None
    # the starter calls the run after the whole name of the deck, runk; its restart file is run's
    engine = re.sub(r"^/RUN/[^/\r\n]+/", "/RUN/run/", engine, flags=re.MULTILINE)
    if TITLES not in engine:
        engine = f"{engine.rstrip()}\n{TITLES}\n"
    write_atomic(folder / ENGINE_INPUT, engine)


def values_not_read(listing: str, written: Mapping[str, float], nonlocal_length: float = 0.0) -> list[str]:
    """Return the values of the stem's card, as written in the deck, that the starter's listing does not echo.

    A keyword or a field that the reader does not support gives no error, only other values. `written` has ``ro e pr
    sigy etan fail c p`` of the card, the length of its nonlocal failure is in mm, 0 for none.
    """
    e, tangent = written["e"], written["etan"]
    wanted = {"density": written["ro"], "elastic modulus": e, "Poisson's ratio": written["pr"]}
    wanted |= {"yield stress": written["sigy"], "failure strain": written["fail"], "nonlocal length": nonlocal_length}
    wanted["plastic modulus"] = e * tangent / (e - tangent)
    wanted |= {"C": written["c"], "1/P": 1.0 / written["p"]} if written["c"] > 0.0 else {}
    echoed = np.array([required_number(value) for value in _VALUE.findall(listing)])
    return [
        f"{name} = {value:.6g}"
        for name, value in wanted.items()
        if value > 0.0 and not np.isclose(echoed, value, rtol=_CLOSE, atol=0.0).any()
    ]


def deletes_elements(listing: str) -> bool:
    """Check the starter's listing for a failure criterion of the elements."""
    return _FAILURE.search(listing) is not None


def deleted_elements(listing: str, printed: str) -> list[float]:
    """Return when each element was deleted, s: as printed, or the time of the cycle before it in the listing."""
    times: dict[int, float] = {}
    now = 0.0
    for line in listing.splitlines():
        if (cycle := _CYCLE.match(line)) is not None:
            now = required_number(cycle[1])
        elif (gone := _DELETED.search(line)) is not None:
            times[int(gone[1])] = now
    times.update((int(number), required_number(time)) for number, time in _DELETED.findall(printed) if time)
    return sorted(times.values())


def force_in_histories(text: str) -> ContactForce:
    """Return the force along z of the blade's contact from the table of time histories, FNZ + FTZ, its peak positive.

    Raises `SimulationFailed`: ``impulse`` if the table has no titles or its force never drops: OpenRadioss stores
    impulses, of which ``th_to_csv`` makes forces by their titles. ``no_result`` if the contact is not there, ``nan`` or
    ``bad_result`` if its numbers are none.
    """
    try:
        header, *rows = csv.reader(text.splitlines())
    except (csv.Error, ValueError) as error:
        raise SimulationFailed("bad_result", f"the table of time histories is not valid CSV: {error}") from None
    names = [" ".join(name.split()) for name in header]
    chosen = [index for index, number in _columns(names) if number == BLADE_CONTACT]
    if not any(_columns(names)):
        raise SimulationFailed(
            "impulse",
            "the time histories have no titles, so they may contain impulses instead of forces; the engine file must "
            f"contain {TITLES}, and th_to_csv needs the file runT01_TITLES",
        )
    if len(chosen) != 2:
        there = sorted({number for _, number in _columns(names)})
        message = f"the time histories contain no force for contact {BLADE_CONTACT} (contacts found: {there})"
        raise SimulationFailed("no_result", message)
    try:
        values = np.array([[required_number(row[index]) for index in (0, *chosen)] for row in rows if row])
    except IndexError:
        raise SimulationFailed("bad_result", "the table of time histories has an incomplete row") from None
    time, normal, tangential = values.reshape(-1, 3).T
    found = ContactForce.of(time, normal + tangential, TABLE)
    if found.force.max() > 0.0 and (np.diff(found.force) >= 0.0).all():
        raise SimulationFailed(
            "impulse",
            "the blade force never decreases, so the time histories contain impulses instead of forces; "
            "install th_to_csv from the same OpenRadioss version",
        )
    return found


def _columns(names: list[str]) -> Iterator[tuple[int, int]]:
    """Yield column and contact of each force along z."""
    for index, name in enumerate(names):
        if (match := _COLUMN.fullmatch(name)) is not None:
            yield index, int(match[1])


def starter_errors(text: str) -> list[str]:
    """Return the errors of a listing or of what was printed, each in one line with its description."""
    return [" ".join(match[0].split())[:300] for match in _ERROR.finditer(text.replace("\r\n", "\n"))]


def text_left(folder: Path, name: str) -> str:
    """Return a text file of the run, empty if there is none."""
    try:
        return read_text(folder, name)
    except SimulationFailed:
        return ""
