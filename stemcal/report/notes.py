"""The sentences of a study's results: outcomes, their certainty, and the notes that its verdict allows."""

from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import Any

from stemcal.names import Names
from stemcal.note import SEVERITIES, Note
from stemcal.stages.base import stage_called
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results

MOST = 5
"""The number of notes that are shown after a run."""
_WORDS = {
    "screen": "stemcal.stages.screen",
    "climb": "stemcal.stages.climb",
    "rsm": "stemcal.stages.surface.words",
    "invert": "stemcal.stages.invert.words",
    "refine": "stemcal.stages.refine.words",
    "validate": "stemcal.stages.validate.words",
}
"""The module with the sentences of a stage: its outcome, and its certainty if it has any."""
_AGREEING = ("refine", "validate")
_CLAIMING = ("invert", *_AGREEING)
KNOWN = "known"
"""The kind of the notes on intervals, which are true of a calibrated study only."""
WITHHELD = "Not calibrated: no interval of the parameters and no statement of agreement is given."


def outcome_of(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return the outcome of a stage; no statement of agreement where the study is not calibrated."""
    return [] if not holds and result.name in _AGREEING else _sentences("outcome", result, labels)


def certainty(results: Results, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return how certain the results are; no interval where the study is not calibrated."""
    shown = [result for result in results.done() if holds or result.name not in _CLAIMING]
    found = [text for one in shown for text in _sentences("certainty", one, labels)]
    return found if holds else [*found, WITHHELD]


def _sentences(what: str, result: StageResult, labels: Mapping[str, str] | None) -> list[str]:
    words: Any = import_module(_WORDS[result.name])
    return getattr(words, what)(result, Names(result.naming, labels or {})) if hasattr(words, what) else []


def shown_notes(result: StageResult, holds: bool) -> list[Note]:
    """Return a stage's notes; without those on intervals where the study is not calibrated."""
    notes = list(result.notes)
    if holds or all(note.kind != KNOWN for note in notes):
        return notes
    return [*(note for note in notes if note.kind != KNOWN), Note("withheld", "warning", WITHHELD)]


def notes_of_all(results: Results, holds: bool) -> list[tuple[str, Note]]:
    """Return the notes of all stages, in their order, each with its stage's title."""
    return [(stage_called(one.name).title, note) for one in results.done() for note in shown_notes(one, holds)]


def read_first(notes: Iterable[tuple[str, Note]]) -> list[tuple[str, Note]]:
    """Return notes with their stages by severity, the first of each kind."""
    kinds: dict[str, tuple[str, Note]] = {}
    for title, note in sorted(notes, key=lambda each: SEVERITIES.index(each[1].severity)):
        kinds.setdefault(note.kind, (title, note))
    return list(kinds.values())
