"""Rules of the verdict on the refinement."""

from collections.abc import Iterator
from dataclasses import replace

from stemcal.notes import Note
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.verdict.verdict_rules import Evidence, Rank, ranked


@ranked(Rank.IDENTIFICATION)
def missed_there(evidence: Evidence) -> Iterator[Note]:
    """Yield a reason if the target is not reached in the other model."""
    result = evidence.of(RefineResult)
    if result is not None and result.elsewhere:
        yield from (replace(note, kind="missed_there") for note in result.notes if note.kind == "not_reached")


@ranked(Rank.IDENTIFICATION)
def without_surface(evidence: Evidence) -> Iterator[Note]:
    """Yield reasons if a study without a response surface lacks intervals, or does not determine some factors."""
    result = evidence.of(RefineResult)
    if result is not None:
        yield from (note for note in result.notes if note.kind in ("not_identified", "no_intervals"))


RULES = (missed_there, without_surface)
