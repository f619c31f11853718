"""Rules of the verdict on the refinement in another model."""

from collections.abc import Iterator
from dataclasses import replace

from stemcal.notes import Note
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.verdict.verdict_rules import Evidence, Rank, ranked


@ranked(Rank.IDENTIFICATION)
def missed_there(evidence: Evidence) -> Iterator[Note]:
    """Yield a target that the other model does not reach."""
    found = evidence.of(RefineResult)
    if found is not None and found.elsewhere:
        yield from (replace(note, kind="missed_there") for note in found.notes if note.kind == "not_reached")


@ranked(Rank.IDENTIFICATION)
def without_surface(evidence: Evidence) -> Iterator[Note]:
    """Yield the factors that a study without a response surface does not determine, and that there are no intervals."""
    found = evidence.of(RefineResult)
    if found is not None:
        yield from (note for note in found.notes if note.kind in ("not_identified", "no_intervals"))


RULES = (missed_there, without_surface)
