"""The sentences of a study's results: outcomes, their certainty, and the notes that its verdict allows."""

from collections.abc import Iterable, Mapping

from stemcal.note import SEVERITIES, Note
from stemcal.report.showing import names_of, showing_of
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.stage import stage_called

MOST = 5
"""The number of notes that are shown after a run."""
KNOWN = "known"
"""The kind of the notes on intervals, which are true of a calibrated study only."""
WITHHELD = "Not calibrated: intervals of the parameters and the agreement are not reported."


def outcome_of(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return the outcome of a stage; no statement of agreement where the study is not calibrated."""
    showing = showing_of(result)
    return showing.outcome(result, names_of(result, labels)) if holds or showing.claims != "agreement" else []


def certainty(results: Results, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return how certain the results are; no interval where the study is not calibrated."""
    shown = [(showing_of(result), result) for result in results.done]
    each = [showing.certainty(one, names_of(one, labels)) for showing, one in shown if holds or not showing.claims]
    found = [text for texts in each for text in texts]
    return found if holds else [*found, WITHHELD]


def shown_notes(result: StageResult, holds: bool) -> list[Note]:
    """Return a stage's notes; without those on intervals where the study is not calibrated."""
    notes = list(result.notes)
    if holds or all(note.kind != KNOWN for note in notes):
        return notes
    return [*(note for note in notes if note.kind != KNOWN), Note("withheld", "warning", WITHHELD)]


def notes_of_all(results: Results, holds: bool) -> list[tuple[str, Note]]:
    """Return the notes of all stages, in their order, each with its stage's title."""
    return [(stage_called(one.name).title, note) for one in results.done for note in shown_notes(one, holds)]


def read_first(notes: Iterable[tuple[str, Note]]) -> list[tuple[str, Note]]:
    """Return notes with their stages by severity, the first of each kind."""
    kinds: dict[str, tuple[str, Note]] = {}
    for title, note in sorted(notes, key=lambda each: SEVERITIES.index(each[1].severity)):
        kinds.setdefault(note.kind, (title, note))
    return list(kinds.values())
