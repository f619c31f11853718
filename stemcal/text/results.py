"""What the results of a study say beside their tables: all remarks, those a verdict lets stand, those read first."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from stemcal.notes import Weight
from stemcal.stages.base import stage_called
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.text import audit, calibration, climb, mesh, refinement, runs, screening, surface, transfer, validation
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import Remark, sentence

__all__ = [
    "MOST",
    "certainty",
    "outcome_of",
    "read_first",
    "remarks_of",
    "said_by_all",
    "say_more",
    "sentence",
    "shown_remarks",
    "warned",
    "withheld",
]

MOST = 5
"""So many remarks are read."""


@dataclass(frozen=True)
class _Topic:
    """What is said of a stage: its remarks, what came of it, how sure that is, each from result and names."""

    remarks: Callable[[Any, Names], list[Remark]]
    outcome: Callable[[Any, Names], list[str]]
    certainty: Callable[[Any, Names], list[str]] = lambda _result, _names: []


_TOPICS = {
    "screen": _Topic(screening.remarks, screening.outcome, screening.certainty),
    "climb": _Topic(climb.remarks, climb.outcome),
    "rsm": _Topic(surface.remarks, surface.outcome, surface.certainty),
    "invert": _Topic(calibration.remarks, calibration.outcome, calibration.certainty),
    "refine": _Topic(refinement.remarks, refinement.outcome),
    "mesh": _Topic(mesh.remarks, mesh.certainty, mesh.certainty),
    "validate": _Topic(validation.remarks, validation.outcome, validation.certainty),
    "transfer": _Topic(transfer.remarks, transfer.outcome, transfer.certainty),
    "audit": _Topic(audit.remarks, audit.outcome),
}
TOPICS = (runs,)
"""What gives notes of several stages their sentences."""
_AGREEING = ("refine", "validate", "transfer")
_CLAIMING = ("invert", "mesh", *_AGREEING)


def remarks_of(result: StageResult, labels: Mapping[str, str] | None = None) -> list[Remark]:
    """Return what a stage's result says beside its tables."""
    return _TOPICS[result.name].remarks(result, Names(result.naming, labels or {}))


def outcome_of(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return what came out of a stage; no claim of agreement where the study does not bear it."""
    if not holds and result.name in _AGREEING:
        return []
    return _TOPICS[result.name].outcome(result, Names(result.naming, labels or {}))


def certainty(results: Results, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return how sure it is, as far as the finished stages tell; no interval where the study is not calibrated."""
    shown = [result for result in results.done() if holds or result.name not in _CLAIMING]
    said = [text for one in shown for text in _TOPICS[one.name].certainty(one, Names(one.naming, labels or {}))]
    return said if holds else [*said, withheld()]


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
