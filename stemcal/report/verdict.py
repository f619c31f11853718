"""What is withheld of the results where the study is not calibrated.

Intervals of the parameters and statements of agreement suppose that the model fits and its runs can be trusted. Where
the verdict is "not calibrated" they are not shown, and it is said that they are not.
"""

from __future__ import annotations

from stemcal.doe.validation.comparison import EQUAL
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.result import StageResult
from stemcal.stages.validate import ValidateResult

CLAIMING = ("profiles", "posterior", "solutions")  # figures of intervals
WITHHELD = "Not calibrated: no interval of the parameters and no statement of agreement is given."


def shown_notes(result: StageResult, holds: bool) -> tuple[str, ...]:
    """Leave out a stage's notes that claim something, where the study does not bear them."""
    if holds:
        return result.notes
    claims = claims_of(result)
    kept = tuple(note for note in result.notes if note not in claims)
    return (*kept, WITHHELD) if len(kept) < len(result.notes) else kept


def claims_of(result: StageResult) -> set[str]:
    """Return the notes of a stage that hold for a calibrated study only."""
    if isinstance(result, InvertResult):
        return {sentence for part in result.known for sentence in part.sentences}
    if isinstance(result, ValidateResult):
        return {note for note in result.notes if EQUAL.says(note)}
    return set()
