"""Run LS-DYNA, check its normal termination, and read the blade force from ``rcforc``."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from stemcal.cutting.result import along_travel
from stemcal.errors import SimulationFailed
from stemcal.processes.program import ProgramRun
from stemcal.solvers.deck.peak import ContactForce
from stemcal.solvers.deck.writer import BLADE_CONTACT, DECK
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.program import code_is_zero, run_command
from stemcal.solvers.protocol import Answer
from stemcal.solvers.readers import NUMBER, read_text, required_number
from stemcal.storage.encodings import lenient
from stemcal.storage.plain import open_plain

FORCES = "rcforc"
# Files in which LS-DYNA reports its termination, in addition to its output; mes0000 is that of the first MPP process.
_MESSAGES = ("messag", "mes0000", "d3hsp")
_TAIL_BYTES, _MOST_BYTES = 20_000, 20_000_000
# LS-DYNA prints " solid element     1911 failed at time  2.8203E-01" once for each deleted element.
_FAILED = re.compile(rf"\belement[ \t]+(\d{{1,18}})[ \t]+failed at time[ \t]*({NUMBER})", re.IGNORECASE)
_VALUE = rf"({NUMBER}|[-+]?NaN|[-+]?Inf(?:inity)?|\*+)"
_ROW = re.compile(
    rf"\s*(slave|master|surfa|surfb)\s+(\d{{1,18}})\s+time\s*{_VALUE}\s+x.*?\s+y\s*{_VALUE}\s+z\s*{_VALUE}", re.I
)


def run(folder: Path, options: DeckSolver, spec_folder: Path, peak: Callable[..., Answer], angle: float) -> Answer:
    """Run the deck in `folder`; return the answer that `peak` makes from the blade force (`angle` in degrees)."""
    read = partial(_read, folder, peak, angle=angle)
    return run_command(folder, options.command, options, spec_folder, {"deck": DECK}, read)


def _read(folder: Path, peak: Callable[..., Answer], finished: ProgramRun, angle: float = 0.0) -> Answer:
    """Return the answer of a finished run; raise `SimulationFailed` if it did not terminate normally."""
    code_is_zero(finished)
    messages = finished.output + "".join(tail(folder / name) for name in _MESSAGES)
    letters = "".join(messages.lower().split())
    if "errortermination" in letters:
        lines = [line.strip() for line in messages.splitlines() if "*** error" in line.lower()]
        message = f"LS-DYNA stopped with an error{f': {lines[0][:200]}' if lines else ''}"
        raise SimulationFailed("error_termination", message)
    if "normaltermination" not in letters:
        raise SimulationFailed("no_termination", "LS-DYNA did not report normal termination")
    return peak(force_in_rcforc(read_text(folder, FORCES), angle), failed=failed_elements(folder, finished.output))


def force_in_rcforc(text: str, angle: float = 0.0) -> ContactForce:
    """Return the blade force along the travel in ``rcforc`` (`angle` in degrees); `SimulationFailed` if invalid."""
    rows = [match for line in text.splitlines() if (match := _ROW.match(line))]
    of_blade = [match for match in rows if int(match[2]) == BLADE_CONTACT]
    if not of_blade:
        there = sorted({int(match[2]) for match in rows})
        message = f"{FORCES} contains no force for contact {BLADE_CONTACT} (contacts found: {there})"
        raise SimulationFailed("no_result", message)
    side = of_blade[0][1].lower()
    columns = 3, 5, 4 if angle else 5  # time, z and, for a sliding blade, y
    series = [[required_number(match[i]) for i in columns] for match in of_blade if match[1].lower() == side]
    time, z, y = np.asarray(series, dtype=float).T
    return ContactForce.of(time, along_travel(z, y, angle), FORCES)


def failed_elements(folder: Path, printed: str) -> list[float]:
    """Return the times (s) at which elements were deleted; an element reported in several files counts once."""
    times: dict[int, float] = {}
    for text in (printed, *(tail(folder / name, _MOST_BYTES) for name in _MESSAGES)):
        times.update((int(number), required_number(time)) for number, time in _FAILED.findall(text))
    return list(times.values())


def tail(path: Path, most: int = _TAIL_BYTES) -> str:
    """Return the last `most` bytes of a text file as text; empty if there is no file."""
    try:
        with open_plain(path) as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - most))
            return lenient(file.read(most))
    except OSError:
        return ""
