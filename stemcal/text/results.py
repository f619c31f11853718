"""What the results of a study say beside their tables: all remarks, those a verdict lets stand, those read first."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from stemcal.doe.validation.conditions import EQUAL
from stemcal.notes import Note, Weight
from stemcal.remarks import weight_of
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
from stemcal.text import calibration, climb, mesh, published, refinement, runs, screening, surface
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, sentence

__all__ = ["MOST", "read_first", "remarks_of", "said_by_all", "sentence", "shown_remarks", "warned", "withheld"]

TOPICS = (calibration, climb, mesh, refinement, runs, screening, surface)
"""The modules that give notes their sentences."""
MOST = 5
"""So many remarks are read."""


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
        case ClimbResult():
            return climb.remarks(result, names)
        case InvertResult():
            return calibration.remarks(result, names)
        case RefineResult():
            return refinement.remarks(result, names)
    return [_remark(note, result, names) for note in result.notes]


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


def withheld() -> str:
    """Say that intervals and agreement are not shown."""
    return say("Not calibrated: no interval of the parameters and no statement of agreement is given.")


def _remark(note: Note | str, result: StageResult, names: Names) -> Remark:
    """Return a note as a remark; a stage that still makes sentences has them weighed by their templates."""
    if isinstance(note, Note):
        return remark(note, names)
    claims = isinstance(result, ValidateResult) and EQUAL.says(note)
    kind = re.sub(r"[\d.]+", "#", note.partition(":")[0] if len(note) > 60 else note)
    return Remark(note, weight_of(note), kind, claims)
