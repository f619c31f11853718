"""A run of LS-DYNA: its command, its normal termination, the force in ``rcforc``."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from stemcal.errors import SimulationFailed
from stemcal.files.reading import lenient, open_plain
from stemcal.processes import Ended
from stemcal.solvers.deck.peak import Array, ContactForce
from stemcal.solvers.deck.radioss_files import DECK
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.programs.program_base import executable, run_command
from stemcal.solvers.programs.readers import NUMBER, number_of, read_text
from stemcal.solvers.protocol import Answer

FORCES = "rcforc"
# Where LS-DYNA reports its termination, besides its standard output; MPP writes a file per process.
_MESSAGES = ("messag", "mes0000", "d3hsp")
_TAIL_BYTES, _MOST_BYTES = 20_000, 20_000_000
# " solid element     1911 failed at time  2.8203E-01", once for each element that is taken away.
_FAILED = re.compile(rf"\belement[ \t]+(\d{{1,18}})[ \t]+failed at time[ \t]*({NUMBER})", re.IGNORECASE)
_VALUE = rf"({NUMBER}|[-+]?NaN|[-+]?Inf(?:inity)?|\*+)"
_ROW = re.compile(
    rf"\s*(slave|master|surfa|surfb)\s+(\d{{1,18}})\s+time\s*{_VALUE}\s+x\s*{_VALUE}\s+y\s*{_VALUE}\s+z\s*{_VALUE}",
    re.IGNORECASE,
)
_COLUMN = {"x": 4, "y": 5, "z": 6}


def prepare(options: DeckSolver, folder: Path) -> None:
    """Refuse to begin if the program is not there; `folder` is that of the spec."""
    executable(options.command[0], folder)


def run(folder: Path, options: DeckSolver, spec_folder: Path, peak: Callable[..., Answer]) -> Answer:
    """Run the deck in `folder` and return its answer, or why there is none."""
    read = partial(_read, folder, options, peak)
    return run_command(folder, options.command, options, spec_folder, {"deck": DECK}, read)


def _read(folder: Path, options: DeckSolver, peak: Callable[..., Answer], ended: Ended) -> Answer:
    """Return the peak force by what LS-DYNA has printed and left; raise if it did not end normally."""
    _require_normal_termination(folder, ended.output)
    contact = contact_force(read_text(folder, FORCES), 1, "z")
    return peak(contact, failed=failed_elements(folder, ended.output))


def contact_force(text: str, interface: int, component: str) -> ContactForce:
    """Return the force of a contact from the text of an ``rcforc`` in ASCII.

    Interfaces count from 1 in the order of the deck, or by their numbers where the deck gives them.

    Raises
    ------
    SimulationFailed
        ``no_result`` if the contact is not there, ``nan`` or ``bad_result`` if its numbers are none.
    """
    rows = [match for line in text.splitlines() if (match := _ROW.match(line))]
    mine = [match for match in rows if int(match[2]) == interface]
    if not mine:
        there = sorted({int(match[2]) for match in rows})
        raise SimulationFailed("no_result", f"{FORCES} has no contact {interface}, only {there}; see solver.interface")
    side = mine[0][1].lower()
    series = [(number_of(m[3]), number_of(m[_COLUMN[component]])) for m in mine if m[1].lower() == side]
    time, force = np.asarray(series, dtype=float).T
    if not np.isfinite(time).all() or not np.isfinite(force).all():
        raise SimulationFailed("nan", f"the force of contact {interface} is NaN from {_last_good(time, force):g} s on")
    if len(time) < 2 or not (np.diff(time) > 0).all():
        raise SimulationFailed("bad_result", f"the times of contact {interface} in {FORCES} do not rise")
    return ContactForce.turned(time, force)


def _last_good(time: Array, force: Array) -> float:
    good = np.isfinite(time) & np.isfinite(force)
    return float(time[good].max(initial=0.0))


def failed_elements(folder: Path, printed: str) -> list[float]:
    """Return when each element was deleted, s, as far as LS-DYNA has reported; several files report an element."""
    times: dict[int, float] = {}
    for text in (printed, *(tail(folder / name, _MOST_BYTES) for name in _MESSAGES)):
        times.update((int(number), number_of(time) or 0.0) for number, time in _FAILED.findall(text))
    return list(times.values())


def _require_normal_termination(folder: Path, printed: str) -> None:
    """Raise `SimulationFailed` unless LS-DYNA reports, in spaced letters, normal termination."""
    said = printed + "".join(tail(folder / name) for name in _MESSAGES)
    letters = "".join(said.lower().split())
    if "errortermination" in letters:
        lines = [line.strip() for line in said.splitlines() if "*** error" in line.lower()]
        raise SimulationFailed(
            "error_termination", f"LS-DYNA stopped with an error{f': {lines[0][:200]}' if lines else ''}"
        )
    if "normaltermination" not in letters:
        raise SimulationFailed("no_termination", "LS-DYNA did not report normal termination")


def tail(path: Path, most: int = _TAIL_BYTES) -> str:
    """Return the end of a text file, empty if there is none."""
    try:
        with open_plain(path) as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - most))
            return lenient(file.read(most))
    except OSError:
        return ""
