"""A run of LS-DYNA from beginning to end: deck, process, normal termination, peak force."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import Any, ClassVar

from stemcal.errors import SimulationFailed
from stemcal.files.encodings import lenient
from stemcal.files.plain import open_plain
from stemcal.measured.curve_modes import CurveModes
from stemcal.outputs import write_output
from stemcal.solvers.deck import Deck, deck_text
from stemcal.solvers.fortran import NUMBER, number_of
from stemcal.solvers.lsdyna.mat003 import find_material, replaced
from stemcal.solvers.programs.inputs import Inputs
from stemcal.solvers.programs.peak import peak_answer
from stemcal.solvers.programs.program_base import OneCommand
from stemcal.solvers.programs.rcforc import FILE, contact_force
from stemcal.solvers.programs.readers import read_text
from stemcal.solvers.programs.reductions import NoResult
from stemcal.solvers.protocol import Answer, Request
from stemcal.solvers.time_limited_program import Ended
from stemcal.study.model import LoadingSection, LsDynaSolver
from stemcal.study.types.placeholders import template_bytes

DECK = "run.k"
# Where LS-DYNA says how it ended, besides its standard output; MPP writes a file per process.
_MESSAGES = ("messag", "mes0000", "d3hsp")
_TAIL_BYTES, _MOST_BYTES = 20_000, 20_000_000
# " solid element     1911 failed at time  2.8203E-01", once for each element that is taken away.
_FAILED = re.compile(rf"\belement[ \t]+(\d{{1,18}})[ \t]+failed at time[ \t]*({NUMBER})", re.IGNORECASE)


@dataclass(frozen=True)
class LsDyna(OneCommand):
    """Answers requests by LS-DYNA; see `study.outside.LsDynaSolver`."""

    revision: ClassVar[int] = 6

    @property
    def options(self) -> LsDynaSolver:
        """What the spec says of LS-DYNA."""
        assert isinstance(self.study.solver, LsDynaSolver)
        return self.study.solver

    def _inputs(self) -> Inputs:
        for deck in self._own().values():
            find_material(template_bytes(deck), self.options.material)
        return Inputs.of([], [*self._own().values(), *self.options.files])

    def _determining(self, request: Request) -> dict[str, Any]:
        """Return all the deck is written from, or that there is one of the user's own."""
        dump = self.study.model_dump(mode="json")
        apart = {"command", "environment", "time_limit", "deck", "decks", "files", "version", "keep"}
        sections = ("specimen", "blade", "supports", "loading", "contact")
        return {
            "options": self.options.model_dump(mode="json", exclude=apart),
            "model": {} if self._own() else {name: dump[name] for name in sections},
            "material": self.study.parameters(request.levels, request.condition),
        }

    def _write(self, folder: Path, request: Request) -> dict[str, Any]:
        """Write the deck of a request; tell the text of each value that went into the user's own deck."""
        self.inputs.write(folder, {})
        if not self._own():
            text = deck_text(Deck.of(self.study, request.levels, request.condition))
            write_output(folder / DECK, text)
            return {}
        own = template_bytes(self._own_at(request.condition))
        material = find_material(own, self.options.material)
        deck, written = replaced(own, material, self.study.parameters(request.levels, request.condition))
        write_output(folder / DECK, deck)
        return {"written": written}

    def _values(self, _request: Request) -> Mapping[str, str]:
        return {"deck": DECK}

    def _own(self) -> dict[float, Path]:
        """Return the user's own decks by diameter."""
        options = self.options
        first = {self.study.targets.calibrate_at: options.deck} if options.deck else {}
        return {**first, **{entry.diameter: entry.deck for entry in options.decks}}

    def _own_at(self, diameter: float) -> Path:
        for known, deck in self._own().items():
            if isclose(known, diameter, rel_tol=1e-6):
                return deck
        raise SimulationFailed("no_deck", f"solver.decks has none for a diameter of {diameter:g} mm")

    def _read(self, folder: Path, request: Request, ended: Ended) -> Answer:
        modes = self.study.targets.modes_at(request.condition)
        return force_of_finished_run(folder, self.options, self.study.loading, ended, modes)


def force_of_finished_run(
    folder: Path,
    options: LsDynaSolver,
    loading: LoadingSection,
    ended: Ended | None = None,
    modes: CurveModes | None = None,
) -> Answer:
    """Return the peak force of a finished run by what LS-DYNA has left in its folder, and printed where that is known.

    Its curve is scored on the `modes` of those that were measured.

    Raises
    ------
    NoResult
        If LS-DYNA does not say that it came to its normal end, or its forces cannot be read.
    """
    printed = "" if ended is None else ended.output
    _require_normal_termination(folder, printed)
    contact = contact_force(read_text(folder, FILE), options.interface, options.component)
    return peak_answer(contact, options, loading, _failed_elements(folder, printed), modes=modes)


def _failed_elements(folder: Path, printed: str) -> list[float]:
    """Return when each element was taken away, s, as far as LS-DYNA has told; an element is told of in many files."""
    times: dict[int, float] = {}
    for text in (printed, *(_tail(folder / name, _MOST_BYTES) for name in _MESSAGES)):
        times.update((int(number), number_of(time) or 0.0) for number, time in _FAILED.findall(text))
    return list(times.values())


def _require_normal_termination(folder: Path, printed: str) -> None:
    """Raise `NoResult` unless LS-DYNA says, in spaced letters, that it came to its normal end."""
    said = printed + "".join(_tail(folder / name) for name in _MESSAGES)
    letters = "".join(said.lower().split())
    if "errortermination" in letters:
        raise NoResult("error_termination", f"LS-DYNA stopped with an error{_first_error(said)}")
    if "normaltermination" not in letters:
        raise NoResult("no_termination", "LS-DYNA did not say that it came to its normal end")


def _first_error(said: str) -> str:
    lines = [line.strip() for line in said.splitlines() if "*** error" in line.lower()]
    return f": {lines[0][:200]}" if lines else ""


def _tail(path: Path, most: int = _TAIL_BYTES) -> str:
    try:
        with open_plain(path) as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - most))
            return lenient(file.read(most))
    except OSError:
        return ""
