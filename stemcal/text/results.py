"""What the results of a study say beside their tables: all remarks, those a verdict lets stand, those read first."""

from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import Any

from stemcal.note import Note
from stemcal.notes import Weight
from stemcal.stages.base import stage_called
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark

MOST = 5
"""So many remarks are read."""


_TOPICS = {
    "screen": "stemcal.stages.screen_words",
    "climb": "stemcal.stages.climb_words",
    "rsm": "stemcal.stages.surface.words",
    "invert": "stemcal.stages.invert.words",
    "refine": "stemcal.stages.refine.words",
    "validate": "stemcal.stages.validate.words",
}
"""The module that words a stage: its remarks, what came of it, how sure that is, each from result and names."""
_AGREEING = ("refine", "validate")
_CLAIMING = ("invert", *_AGREEING)


def remarks_of(result: StageResult, labels: Mapping[str, str] | None = None) -> list[Remark]:
    """Return what a stage's result says beside its tables."""
    said = _said("remarks", result, labels)
    return said or [remark(note, Names(result.naming)) for note in result.notes if isinstance(note, Note)]


def outcome_of(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return what came out of a stage; no claim of agreement where the study does not bear it."""
    if not holds and result.name in _AGREEING:
        return []
    return _said("outcome", result, labels)


def certainty(results: Results, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return how sure it is, as far as the finished stages tell; no interval where the study is not calibrated."""
    shown = [result for result in results.done() if holds or result.name not in _CLAIMING]
    said = [text for one in shown for text in _said("certainty", one, labels)]
    return said if holds else [*said, withheld()]


def _said(what: str, result: StageResult, labels: Mapping[str, str] | None) -> list[Any]:
    """Return what the topic of a stage says of its result; nothing where it has no words of that kind."""
    topic = import_module(_TOPICS[result.name])
    return getattr(topic, what)(result, Names(result.naming, labels or {})) if hasattr(topic, what) else []


def shown_remarks(result: StageResult, holds: bool, labels: Mapping[str, str] | None = None) -> list[Remark]:
    """Return a stage's remarks; without those that claim something where the study does not bear them."""
    remarks = remarks_of(result, labels)
    kept = [one for one in remarks if holds or not one.claims]
    return kept if len(kept) == len(remarks) else [*kept, Remark(withheld(), Weight.USE, "withheld")]


def said_by_all(results: Results, holds: bool) -> list[tuple[str, Remark]]:
    """Return the remarks of all stages, in their order, each with its stage's title."""
    return [(stage_called(one.name).title, said) for one in results.done() for said in shown_remarks(one, holds)]


def warned(warnings: Iterable[str]) -> list[tuple[str, Remark]]:
    """Return what solvers warned of, in their own words: it is about the numbers themselves."""
    return [(say("runs"), Remark(sentence, Weight.NUMBERS, sentence)) for sentence in warnings]


def read_first(said: Iterable[tuple[str, Remark]]) -> list[tuple[str, Remark]]:
    """Return remarks by weight, the first of each kind."""
    kinds: dict[str, tuple[str, Remark]] = {}
    for title, one in sorted(said, key=lambda each: each[1].weight):
        kinds.setdefault(one.kind, (title, one))
    return list(kinds.values())


def say_more(count: int) -> str:
    """Say how many remarks are left to the report."""
    return say_number("{count} more note in the report", "{count} more notes in the report", count)


def withheld() -> str:
    """Say that intervals and agreement are not shown."""
    return say("Not calibrated: no interval of the parameters and no statement of agreement is given.")
