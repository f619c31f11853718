"""Rules of the verdict on the refinement."""

from collections.abc import Iterator
from dataclasses import replace

from stemcal.notes import Note
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.verdict.verdict_rules import Evidence, Rank, ranked


@ranked(Rank.IDENTIFICATION)
def refinement(evidence: Evidence) -> Iterator[Note]:
    """Yield notes on missing intervals, undetermined factors, or a target that is not reached in another model."""
    result = evidence.of(RefineResult)
    for note in result.notes if result is not None else ():
        if note.kind in ("not_identified", "no_intervals"):
            yield note
        elif note.kind == "not_reached" and result is not None and result.elsewhere:
            yield replace(note, kind="missed_there")


RULES = (refinement,)
