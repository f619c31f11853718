"""What the results of a study say beside their tables: all remarks, those a verdict lets stand, those read first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stemcal.notes import Note, Weight
from stemcal.stages.base import stage_called
from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate import ValidateResult
from stemcal.text import calibration, climb, mesh, published, refinement, runs, screening, surface, validation
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, sentence

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

TOPICS = (calibration, climb, mesh, refinement, runs, screening, surface, validation)
"""The modules that give notes their sentences."""
MOST = 5
"""So many remarks are read."""
_AGREEING = (RefineResult, ValidateResult)
_CLAIMING = (InvertResult, MeshResult, *_AGREEING)


def remarks_of(result: StageResult, labels: Mapping[str, str] | None = None) -> list[Remark]:
    """Return what a stage's result says beside its tables."""
    names = Names(result.naming, labels or {})
    match result:
        case ScreenResult():
            return [*screening.remarks(result, names), *published.remarks(result.published)]
        case SurfaceResult():
            return surface.remarks(result, names)
        case MeshResult():
            return mesh.remarks(result, names)
        case ValidateResult():
            return validation.remarks(result, names)
    notes = (
        remark(note, names) if isinstance(note, Note) else Remark(note, Weight.TRUST, note) for note in result.notes
    )
    return [*_of_numbers(result, names), *notes]


def _of_numbers(result: StageResult, names: Names) -> Iterable[Remark]:
    """Return the remarks that a result's numbers ask for, its notes apart."""
    match result:
        case ClimbResult():
            return climb.remarks(result, names)
        case InvertResult():
            return calibration.remarks(result, names)
        case RefineResult():
            return refinement.remarks(result, names)
    return ()


def outcome_of(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return what came out of a stage; no claim of agreement where the study does not bear it."""
    names = Names(result.naming, labels or {})
    if not holds and isinstance(result, _AGREEING):
        return []
    match result:
        case ScreenResult():
            return screening.outcome(result, names)
        case ClimbResult():
            return climb.outcome(result, names)
        case SurfaceResult():
            return surface.outcome(result, names)
        case InvertResult():
            return calibration.outcome(result, names)
        case RefineResult():
            return refinement.outcome(result, names)
        case MeshResult():
            return mesh.certainty(result, names)
        case ValidateResult():
            return validation.outcome(result, names)
    return [result.summary()]


def certainty(results: Results, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return how sure it is, as far as the finished stages tell; no interval where the study is not calibrated."""
    told = [result for result in results.done() if holds or not isinstance(result, _CLAIMING)]
    said = [sentence for result in told for sentence in _certainty(result, Names(result.naming, labels or {}))]
    return said if holds else [*said, withheld()]


def _certainty(result: StageResult, names: Names) -> list[str]:
    match result:
        case ScreenResult():
            return screening.certainty(result, names)
        case SurfaceResult():
            return surface.certainty(result, names)
        case InvertResult():
            return calibration.certainty(result, names)
        case MeshResult():
            return mesh.certainty(result, names)
        case ValidateResult():
            return validation.certainty(result, names)
    return []


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
