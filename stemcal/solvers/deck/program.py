"""LS-DYNA or OpenRadioss as a solver: a deck in, the peak force of a contact out."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import isclose
from pathlib import Path
from typing import Any, ClassVar

from stemcal.errors import SimulationFailed
from stemcal.outputs import write_output
from stemcal.solvers.deck import lsdyna, openradioss
from stemcal.solvers.deck.form import form_of
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.own_deck import find_material, replaced
from stemcal.solvers.deck.peak import peak_answer
from stemcal.solvers.deck.radioss_files import DECK, STARTER_INPUT, starter_text
from stemcal.solvers.deck.writer import deck_text
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.programs.inputs import Inputs
from stemcal.solvers.programs.program_base import Program
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.types.placeholders import template_bytes

_SECTIONS = ("specimen", "blade", "supports", "loading", "contact")
# Options that change no answer, or whose files are known by their content.
_APART = {"environment", "time_limit", "decks", "files", "programs"}


@dataclass(frozen=True)
class DeckProgram(Program):
    """Answers requests by the program of a `DeckSolver`."""

    revision: ClassVar[int] = 8

    @property
    def options(self) -> DeckSolver:
        """What the spec says of the program."""
        assert isinstance(self.study.solver, DeckSolver)
        return self.study.solver

    @property
    def _is_lsdyna(self) -> bool:
        return self.options.program == "lsdyna"

    def prepare(self) -> None:
        """Refuse to begin if the program is not there."""
        (lsdyna if self._is_lsdyna else openradioss).prepare(self.options, self.study.source.parent)

    def _inputs(self) -> Inputs:
        for deck in self._own().values():
            find_material(template_bytes(deck))
        return Inputs.of([], [*self._own().values(), *self.options.files])

    def _determining(self, request: Request) -> dict[str, Any]:
        """Return all the deck is written from, or that there is one of the user's own."""
        dump = self.study.model_dump(mode="json")
        return {
            "options": self.options.model_dump(mode="json", exclude=_APART),
            "model": {} if self._own() else {name: dump[name] for name in _SECTIONS},
            "material": self.study.parameters(request.levels, request.condition),
        }

    def _write(self, folder: Path, request: Request) -> dict[str, Any]:
        """Write the deck of a request; tell the text of each value that went into the user's own deck."""
        self.inputs.write(folder, {})
        if own := self._own():
            text = template_bytes(_at(own, request.condition))
            values = self.study.parameters(request.levels, request.condition)
            deck, written = replaced(text, find_material(text), values)
            write_output(folder / DECK, deck)
            return {"written": written}
        written_deck = self._deck(request)
        write_output(folder / DECK, deck_text(written_deck))
        if not self._is_lsdyna and written_deck.nonlocal_length > 0.0:
            write_output(folder / STARTER_INPUT, starter_text(written_deck, DECK))
        return {}

    def _deck(self, request: Request) -> Deck:
        """Return the deck in the form that the program reads; for OpenRadioss without pictures, 50 files for a run."""
        form = replace(form_of(self.study), pictures=self._is_lsdyna)
        return Deck.of(self.study, request.levels, request.condition, form)

    def _run(self, folder: Path, request: Request) -> Answer:
        options, place = self.options, self.study.source.parent
        modes = self.study.targets.modes_at(request.condition)
        peak = partial(peak_answer, options=options, loading=self.study.loading, modes=modes)
        if self._is_lsdyna:
            return lsdyna.run(folder, options, place, peak)
        return openradioss.run(folder, options, place, peak, self._deck(request))

    def _own(self) -> dict[float, Path]:
        """Return the user's own decks by diameter."""
        return self.options.own_decks()


def _at(decks: Mapping[float, Path], diameter: float) -> Path:
    for known, deck in decks.items():
        if isclose(known, diameter, rel_tol=1e-6):
            return deck
    raise SimulationFailed("no_deck", f"solver.decks has none for a diameter of {diameter:g} mm")
