"""Select the sentences, tables and notes of finished stages for the page, the terminal and the export."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from stemcal.drawing.showing import Finished, Showing, names_of
from stemcal.drawing.table import MOST_ROWS, Table, showable
from stemcal.formats import counted
from stemcal.notes import SEVERITIES, Note
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.stage import stage_called
from stemcal.storage.encodings import in_a_line


def showing_of(result: StageResult) -> Showing[Any]:
    """Return the object that creates the sentences, tables and figures of a result."""
    return stage_called(result.name).showing()


def cited_ranges(results: Finished) -> Mapping[str, str]:
    """Return the confidence interval of each calibrated parameter as text; empty before the calibration."""
    return next((ranges for result in results.done if (ranges := showing_of(result).cited(result))), {})


def tables_of(stage: StageResult, labels: Mapping[str, str] | None = None, holds: bool = True) -> list[Table]:
    """Return the tables of a stage, shortened; without claims of agreement if the study is not calibrated (`holds`)."""
    tables = showing_of(stage).tables(stage, names_of(stage, labels))
    return [shortened(stage, table) for table in showable(tables, holds)]


def shortened(stage: StageResult, table: Table) -> Table:
    """Return a table of a stage cut to `MOST_ROWS` rows; if rows are cut, its foot names the CSV file with all."""
    if len(table.rows) <= MOST_ROWS:
        return table
    # the file that has the most columns in common with the table
    files, keys = stage.tables(), {column.key for column in table.headed(stage.naming.headings).columns}
    file = max(files, key=lambda name: len(keys & {column.key for column in files[name].columns}))
    return table.shortened(f"`{file}.csv`")


MOST = 5  # the largest number of notes printed after a run
KNOWN = "known"  # the kind of notes on confidence intervals, which are shown only if the study is calibrated
_WITHHELD = "The study is not calibrated: confidence intervals and agreement with the measurements are not reported."


def outcome_sentences(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return sentences on the outcome of a stage; none if they claim agreement and the study is not calibrated."""
    showing = showing_of(result)
    return showing.outcome(result, names_of(result, labels)) if holds or not showing.claims else []


def certainty(results: Results, holds: bool = True) -> list[str]:
    """Return sentences on the certainty of the parameters; without intervals if the study is not calibrated."""
    texts = [note.text for result in results.done for note in result.notes if note.kind in (KNOWN, "gain_sources")]
    return texts if holds else [_WITHHELD]


def shown_notes(result: StageResult, holds: bool) -> list[Note]:
    """Return the notes of a stage; if the study is not calibrated, notes on confidence intervals are left out."""
    notes = list(result.notes)
    if holds or all(note.kind != KNOWN for note in notes):
        return notes
    return [*(note for note in notes if note.kind != KNOWN), Note("withheld", "warning", _WITHHELD)]


def failures_of(result: StageResult) -> str:
    """Return a sentence on the failed runs of a stage: number, reasons, first message; empty if none failed."""
    every = list(result.runs())
    failed = [(label, outcome) for label, outcome in every if not outcome.ok]
    if not failed:
        return ""
    reasons = Counter(outcome.reason or "no reason given" for _, outcome in failed)
    why = ", ".join(f"{reason} ({count})" for reason, count in reasons.items())
    messages = ((label, in_a_line(outcome.message)) for label, outcome in failed if outcome.message)
    first = next((f"; first message ({label}): {message}" for label, message in messages), "")
    return f"{result.name}: {len(failed)} of {counted(len(every), 'run')} failed: {why}{first}; see {result.name}.json"


def notes_of_all(results: Results, holds: bool) -> list[tuple[str, Note]]:
    """Return the notes of all stages in order, each with the title of its stage."""
    return [(stage_called(result.name).title, note) for result in results.done for note in shown_notes(result, holds)]


def read_first(notes: Iterable[tuple[str, Note]]) -> list[tuple[str, Note]]:
    """Return the first note of each kind, the most severe kinds first; each with the title of its stage."""
    kinds: dict[str, tuple[str, Note]] = {}
    for title, note in sorted(notes, key=lambda each: SEVERITIES.index(each[1].severity)):
        kinds.setdefault(note.kind, (title, note))
    return list(kinds.values())
