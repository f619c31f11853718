"""What is withheld of the results where the study is not calibrated.

Intervals of the parameters and statements of agreement suppose that the model fits and its runs can be trusted. Where
the verdict is "not calibrated" they are not shown, and it is said that they are not.
"""

from __future__ import annotations

from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.result import StageResult
from stemcal.stages.validate import ValidateResult
from stemcal.stages.verdict.result import Verdict

CLAIMING = ("profiles", "posterior", "solutions")  # figures of intervals
WITHHELD = "Not calibrated: no interval of the parameters and no statement of agreement is given."


def shown_notes(result: StageResult, verdict: Verdict) -> tuple[str, ...]:
    """Leave out a stage's notes that claim something, where the verdict does not bear them."""
    if verdict.holds:
        return result.notes
    claims = _claims(result)
    kept = tuple(note for note in result.notes if note not in claims)
    return (*kept, WITHHELD) if len(kept) < len(result.notes) else kept


def _claims(result: StageResult) -> set[str]:
    if isinstance(result, MeshResult):
        return set(result.certainty.sentences)
    if isinstance(result, InvertResult):
        return {sentence for part in result.known for sentence in part.sentences}
    if isinstance(result, ValidateResult):
        return {note for note in result.notes if note.startswith("Equal within ")}
    return set()
