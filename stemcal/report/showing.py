"""How a stage is shown: its sentences, tables and figures, which page, terminal and export ask for in turn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Generic

from stemcal.files.encodings import in_a_line
from stemcal.files.rows import MOST_ROWS, Table
from stemcal.naming import Names
from stemcal.note import SEVERITIES, Note
from stemcal.numbers import unit_written
from stemcal.registry import Checked
from stemcal.report.figures.plot import Plot
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.stage import R, stage_called
from stemcal.study.model import Study
from stemcal.words import counted


@dataclass(frozen=True)
class Setting:
    """What a stage is shown in: its study, all results, and whether the study is calibrated (`holds`)."""

    study: Study
    results: Results
    holds: bool = True

    @cached_property
    def labels(self) -> dict[str, str]:
        """What people call the factors."""
        return {factor.name: factor.label for factor in self.study.factors}

    @cached_property
    def symbols(self) -> Names:
        """The factors by their symbols."""
        return Names(self.study.naming, {factor.name: factor.symbol for factor in self.study.factors})

    @cached_property
    def labelled(self) -> Names:
        """The factors by label and unit, as papers print them."""
        names = {}
        for factor in self.study.factors:
            unit = unit_written(factor.unit)
            names[factor.name] = f"{factor.label or factor.name} ({unit})" if unit else factor.label
        return Names(self.study.naming, names)


class Showing(Checked, Generic[R]):
    """The words, tables and figures of a stage, made from its result.

    An outcome that `claims` agreement with the measurements is shown of a calibrated study only.
    """

    claims: ClassVar[bool] = False

    def outcome(self, result: R, names: Names) -> list[str]:
        """Return the outcome in sentences."""
        return []

    def tables(self, result: R, names: Names) -> list[Table]:
        """Return its tables."""
        return []

    def findings(self, result: R, names: Names) -> list[Table]:
        """Return the tables that `stemcal run` prints before its end."""
        return []

    def figures(self, result: R, setting: Setting) -> list[Plot]:
        """Return its figures, none of them drawn yet."""
        return []

    def cited(self, result: R) -> Mapping[str, str]:
        """Return the 95 % confidence interval of each parameter that it sets, to cite."""
        return {}

    def beside(self, result: R, holds: bool) -> list[str]:
        """Return what the parameters are valid with and, where the study `holds`, what their ranges assume."""
        return []

    def closing(self, result: R, setting: Setting) -> list[Table]:
        """Return the tables of the last screen of a whole study."""
        return []

    def profiler(self, result: R, setting: Setting) -> dict[str, Any] | None:
        """Return what the profiler of the page computes from, for JSON."""
        return None

    def in_notebook(self, result: R, setting: Setting) -> R:
        """Return the result as a notebook uses it, which may do more."""
        return result


def showing_of(result: StageResult) -> Showing[Any]:
    """Return how a result is shown."""
    found = stage_called(result.name).showing()
    assert isinstance(found, Showing)
    return found


RANGE = "95 % confidence interval"
"""What the range of a parameter to cite is called."""


def cited_ranges(results: Results) -> Mapping[str, str]:
    """Return the range of each calibrated parameter to cite; nothing before they are calibrated."""
    return next((found for one in results.done if (found := showing_of(one).cited(one))), {})


def names_of(result: StageResult, labels: Mapping[str, str] | None = None) -> Names:
    """Return the names of a result's responses, its condition and its factors."""
    return Names(result.naming, labels or {})


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


# ---- the sentences of a study's results, as far as its verdict allows them


MOST = 5
"""The number of notes that are shown after a run."""
KNOWN = "known"
"""The kind of the notes on intervals, which are true of a calibrated study only."""
_WITHHELD = "The study is not calibrated: confidence intervals and agreement with the measurements are not reported."


def outcome_of(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return the outcome of a stage; no statement of agreement where the study is not calibrated."""
    showing = showing_of(result)
    return showing.outcome(result, names_of(result, labels)) if holds or not showing.claims else []


def certainty(results: Results, holds: bool = True) -> list[str]:
    """Return how certain the parameters are; no interval where the study is not calibrated."""
    known = [note.text for result in results.done for note in result.notes if note.kind == KNOWN]
    return known if holds else [_WITHHELD]


def shown_notes(result: StageResult, holds: bool) -> list[Note]:
    """Return a stage's notes; without those on intervals where the study is not calibrated."""
    notes = list(result.notes)
    if holds or all(note.kind != KNOWN for note in notes):
        return notes
    return [*(note for note in notes if note.kind != KNOWN), Note("withheld", "warning", _WITHHELD)]


def failed_runs(result: StageResult) -> str:
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
    return [(stage_called(one.name).title, note) for one in results.done for note in shown_notes(one, holds)]


def read_first(notes: Iterable[tuple[str, Note]]) -> list[tuple[str, Note]]:
    """Return notes with their stages by severity, the first of each kind."""
    kinds: dict[str, tuple[str, Note]] = {}
    for title, note in sorted(notes, key=lambda each: SEVERITIES.index(each[1].severity)):
        kinds.setdefault(note.kind, (title, note))
    return list(kinds.values())
