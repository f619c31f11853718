"""A run of LS-DYNA from beginning to end: deck, process, normal termination, peak force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np

from stemcal.cutting.result import moving_mean
from stemcal.cutting.stroke import stroke_end
from stemcal.errors import SimulationFailed
from stemcal.files.decoding import lenient
from stemcal.solvers.deck import deck_text
from stemcal.solvers.lsdyna.mat003 import find_material, replaced
from stemcal.solvers.processes import Ended
from stemcal.solvers.programs.aside import LEAST_READING_S, aside
from stemcal.solvers.programs.frame import Program
from stemcal.solvers.programs.inputs import Inputs
from stemcal.solvers.programs.rcforc import FILE, ContactForce, contact_force
from stemcal.solvers.programs.readers import is_small, read_text
from stemcal.solvers.programs.reductions import NoResult
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.outside import LsDynaSolver
from stemcal.study.spec.placeholders import template_bytes

__all__ = ["LsDyna", "peak_answer"]

DECK = "run.k"
# Where LS-DYNA says how it ended, besides its standard output; MPP writes a file per process.
_MESSAGES = ("messag", "mes0000", "d3hsp")
_TAIL_BYTES = 20_000
_CURVE_POINTS = 200


@dataclass(frozen=True)
class LsDyna(Program):
    """Answers requests by LS-DYNA; see `study.outside.LsDynaSolver`."""

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
            "material": self.study.parameters(request.levels),
        }

    def _write(self, folder: Path, request: Request) -> dict[str, Any]:
        """Write the deck of a request; tell the text of each value that went into the user's own deck."""
        self.inputs.write(folder, {})
        if not self._own():
            text = deck_text(self.study, request.levels, request.diameter)
            (folder / DECK).write_text(text, encoding="utf-8", newline="\n")
            return {}
        own = template_bytes(self._own_at(request.diameter))
        material = find_material(own, self.options.material)
        deck, written = replaced(own, material, self.study.parameters(request.levels))
        (folder / DECK).write_bytes(deck)
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

    def _read(self, folder: Path, ended: Ended) -> Answer:
        _require_normal_termination(folder, ended)
        options = self.options
        asked = folder, options.interface, options.component
        left = max(options.time_limit - ended.seconds, LEAST_READING_S)
        contact = _contact(*asked) if is_small(folder / FILE) else aside(left, _contact, *asked)
        loading = self.study.loading
        return peak_answer(contact, options.scale, options.filter_window, loading.speed, loading.gap)


def _contact(folder: Path, interface: int, component: str) -> ContactForce:
    return contact_force(read_text(folder, FILE), interface, component)


def peak_answer(contact: ContactForce, scale: float, window: float, speed: float, gap: float) -> Answer:
    """Return the peak of the filtered force, as the embedded solver reports it."""
    time, force = contact.time, scale * contact.force
    rows = max(1, round(window / float(np.median(np.diff(time)))))
    filtered = moving_mean(force, rows)
    peak = int(np.argmax(filtered))
    if filtered[peak] <= 0.0:
        raise NoResult("no_contact", "the blade met no resistance: check gap, speed and duration")
    travel = speed * time - gap
    end = stroke_end(travel, force, filtered, rows)
    keep = np.unique(np.linspace(0, len(time) - 1, _CURVE_POINTS).round().astype(int))
    details: dict[str, Any] = {
        "peak_force": float(filtered[peak]),
        "peak_force_raw": float(force.max()),
        "peak_time": float(time[peak]),
        "peak_travel": float(travel[peak]),
        "stroke_was_enough": end.was_enough,
        "stroke_end": end.kind,
        "warnings": [] if end.was_enough else [f"{end.sentence}; lengthen the run"],
        "curve": {
            "travel": [round(float(v), 6) for v in travel[keep]],
            "force": [round(float(v), 4) for v in filtered[keep]],
        },
    }
    return Answer("ok", force=float(filtered[peak]), details=details)


def _require_normal_termination(folder: Path, ended: Ended) -> None:
    """Raise `NoResult` unless LS-DYNA says, in spaced letters, that it came to its normal end."""
    said = ended.output + "".join(_tail(folder / name) for name in _MESSAGES)
    letters = "".join(said.lower().split())
    if "errortermination" in letters:
        raise NoResult("error_termination", f"LS-DYNA stopped with an error{_first_error(said)}")
    if "normaltermination" not in letters:
        raise NoResult("no_termination", "LS-DYNA did not say that it came to its normal end")


def _first_error(said: str) -> str:
    lines = [line.strip() for line in said.splitlines() if "*** error" in line.lower()]
    return f": {lines[0][:200]}" if lines else ""


def _tail(path: Path) -> str:
    try:
        with path.open("rb") as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - _TAIL_BYTES))
            return lenient(file.read())
    except OSError:
        return ""
