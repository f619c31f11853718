"""Sentences, tables and notes of finished stages, as page, terminal and export show them."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from stemcal.drawing.showing import Finished, Showing, names_of
from stemcal.drawing.table import MOST_ROWS, Table
from stemcal.formats import counted
from stemcal.notes import SEVERITIES, Note
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.stage import stage_called
from stemcal.storage.encodings import in_a_line


def showing_of(result: StageResult) -> Showing[Any]:
    """Return the sentences, tables and figures of a result."""
    return stage_called(result.name).showing()


def cited_ranges(results: Finished) -> Mapping[str, str]:
    """Return the range of each calibrated parameter to cite; nothing before they are calibrated."""
    return next((ranges for result in results.done if (ranges := showing_of(result).cited(result))), {})


def tables_of(stage: StageResult, labels: Mapping[str, str] | None = None) -> list[Table]:
    """Return the tables of a stage, factors by their `labels` where they have any, long ones shortened."""
    return [shortened(stage, table) for table in showing_of(stage).tables(stage, names_of(stage, labels))]


def shortened(stage: StageResult, table: Table) -> Table:
    """Return a table of a stage with at most `MOST_ROWS` rows, and the file that has all of them."""
    if len(table.rows) <= MOST_ROWS:
        return table
    files, keys = stage.tables(), {column.key for column in table.headed(stage.naming.headings).columns}
    file = max(files, key=lambda name: len(keys & {column.key for column in files[name].columns}))
    return table.shortened(f"`{file}.csv`")


MOST = 5
"""The number of notes that are shown after a run."""
KNOWN = "known"
"""The kind of the notes on intervals, which are true of a calibrated study only."""
_WITHHELD = "The study is not calibrated: confidence intervals and agreement with the measurements are not reported."


def outcome_sentences(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return the outcome of a stage; no statement of agreement where the study is not calibrated."""
    showing = showing_of(result)
    return showing.outcome(result, names_of(result, labels)) if holds or not showing.claims else []


def certainty(results: Results, holds: bool = True) -> list[str]:
    """Return sentences on the certainty of the parameters; without intervals if the study is not calibrated."""
    known = [note.text for result in results.done for note in result.notes if note.kind in (KNOWN, "gain_sources")]
    return known if holds else [_WITHHELD]


def shown_notes(result: StageResult, holds: bool) -> list[Note]:
    """Return a stage's notes; without those on intervals where the study is not calibrated."""
    notes = list(result.notes)
    if holds or all(note.kind != KNOWN for note in notes):
        return notes
    return [*(note for note in notes if note.kind != KNOWN), Note("withheld", "warning", _WITHHELD)]


def failures_of(result: StageResult) -> str:
    """Return the number of failed runs of a stage, their reasons and the first message; nothing if none failed."""
    every = list(result.runs())
    failed = [(label, outcome) for label, outcome in every if not outcome.ok]
    if not failed:
        return ""
    reasons = Counter(outcome.reason or "no reason given" for _, outcome in failed)
    why = ", ".join(f"{reason} ({count})" for reason, count in reasons.items())
    first = next((f"; first message ({label}): {in_a_line(one.message)}" for label, one in failed if one.message), "")
    return f"{result.name}: {len(failed)} of {counted(len(every), 'run')} failed: {why}{first}; see {result.name}.json"


def notes_of_all(results: Results, holds: bool) -> list[tuple[str, Note]]:
    """Return the notes of all stages, in their order, each with its stage's title."""
    return [(stage_called(result.name).title, note) for result in results.done for note in shown_notes(result, holds)]


def read_first(notes: Iterable[tuple[str, Note]]) -> list[tuple[str, Note]]:
    """Return notes with their stages by severity, the first of each kind."""
    kinds: dict[str, tuple[str, Note]] = {}
    for title, note in sorted(notes, key=lambda each: SEVERITIES.index(each[1].severity)):
        kinds.setdefault(note.kind, (title, note))
    return list(kinds.values())
