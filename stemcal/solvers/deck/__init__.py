"""The shear test as an LS-DYNA keyword deck, in mm, tonne, s, N and MPa."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from stemcal.solvers.deck import lsdyna, openradioss
from stemcal.solvers.deck.keywords import DeckForm, form_of
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.peak import peak_answer
from stemcal.solvers.deck.writer import DECK, STARTER_INPUT, deck_text, starter_around
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.program import Program, executable
from stemcal.solvers.protocol import Answer, Request
from stemcal.storage.atomic import write_atomic

__all__ = ["Deck", "DeckForm", "deck_text"]

_SECTIONS = ("specimen", "blade", "supports", "loading", "contact")
# Keys omitted from `options` in the identity: `time_limit` and `home` change no answer, the others have own entries.
_NOT_DETERMINING = {"environment", "time_limit", "files", "home"}


@dataclass(frozen=True)
class DeckProgram(Program[DeckSolver]):
    """Answers requests by running LS-DYNA or OpenRadioss on a deck."""

    revision: ClassVar[int] = 9

    @property
    def _is_lsdyna(self) -> bool:
        return self.options.program == "lsdyna"

    def prepare(self) -> None:
        folder = self.study.source.parent
        if self._is_lsdyna:
            executable(self.options.command[0], folder)
        else:
            openradioss.installation(self.options, folder)

    def _determining(self, request: Request) -> dict[str, Any]:
        study, stem = self.study.at(request.levels), self.study.stem_at(request.levels, request.condition)
        dump = study.model_dump(mode="json")
        return {
            "options": self.options.at_speed(study.loading.speed).model_dump(mode="json", exclude=_NOT_DETERMINING),
            "model": {name: dump[name] for name in _SECTIONS},
            "material": self.study.parameters(request.levels, stem),
        }

    def _write(self, folder: Path, request: Request) -> None:
        self.inputs.write(folder, {})
        deck = self._deck(request)
        write_atomic(folder / DECK, deck_text(deck))
        if not self._is_lsdyna and deck.nonlocal_lengths:
            write_atomic(folder / STARTER_INPUT, starter_around(DECK, deck.nonlocal_lengths))

    def _deck(self, request: Request) -> Deck:
        # no pictures from OpenRadioss, which would write 50 files in each run
        form = replace(form_of(self.study), pictures=self._is_lsdyna)
        return Deck.of(self.study, request.levels, request.condition, form)

    def _run(self, folder: Path, request: Request) -> Answer:
        study, place = self.study.at(request.levels), self.study.source.parent
        options, angle = self.options.at_speed(study.loading.speed), study.blade.sliding_angle
        modes = self.study.targets.modes_at(request.condition)
        peak = partial(peak_answer, options=options, loading=study.loading, modes=modes, angle=angle)
        if self._is_lsdyna:
            return lsdyna.run(folder, options, place, peak, angle)
        return openradioss.run(folder, options, place, peak, self._deck(request))
