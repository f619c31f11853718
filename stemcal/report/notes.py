"""Which notes are read first: by weight, in the order of what they would change.

    numbers   something is missing or wrong in what the result is made of: runs that failed, forces that are bounds,
              terms left out, a surface that extrapolates
    use       how far the result may be used: diameters that it misses, effects that may be chance, factors left free
    trust     what makes statistics look better or worse than they are
    asides    what is told for completeness

A note that none of the patterns knows counts as one of trust.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from stemcal.stages.base import stage_called
from stemcal.stages.results import Results
from stemcal.stages.verdict.result import Verdict

MOST = 5
_KINDS = (
    r"runs? failed|still rose|has not fallen|kinetic energy|energy balance|hourglass energy|the others are left out"
    r"|these terms are left out|extrapolates|surface is mostly noise|knows no error|same response|may lie outside",
    r"no better than a formula|the model is wrong|is a trend|read from a table|free over the whole region"
    r"|outside the prediction interval|still .* % from the target|not shown equal|may be chance|not after Holm"
    r"|the two methods disagree|rests on one run|no point of the region|is missed by at most",
    r"",
    r"is the calibration \w+|grows as d\^|describes the measured|repeated points agree|add no information"
    r"|stationary point|the prediction interval holds the target|is nearest to the target|within the tolerance"
    r"|predicts the \S+ better|is the one found by simulation|lies equally far",
)
_WEIGHTS = [re.compile(pattern, re.IGNORECASE) if pattern else None for pattern in _KINDS]


@dataclass(frozen=True)
class Note:
    """A sentence and the stage, or whatever else, that says it."""

    source: str
    sentence: str

    def __str__(self) -> str:
        return f"{self.source}: {self.sentence}"


def weight(sentence: str) -> int:
    """Return the weight of a note: 0 is read first.

    >>> weight("In runs 6, 11 the force still rose."), weight("A new one."), weight("grows as d^2")
    (0, 2, 3)
    """
    found = (rank for rank, pattern in enumerate(_WEIGHTS) if pattern is not None and pattern.search(sentence))
    return next(found, 2)


def weighed(notes: Iterable[Note], told: Iterable[str] = ()) -> list[Note]:
    """Return the notes by weight, each kind once; sentences told already are left out."""
    said, kinds, kept = set(told), set[str](), []
    for note in sorted(notes, key=lambda note: weight(note.sentence)):
        kind = re.sub(r"[\d.]+", "#", note.sentence.partition(":")[0] if len(note.sentence) > 60 else note.sentence)
        if note.sentence not in said and kind not in kinds:
            kinds.add(kind)
            kept.append(note)
    return kept


def notes_of(results: Results, verdict: Verdict) -> list[Note]:
    """Return the notes of all stages, as far as the verdict bears them, in the order of the stages."""
    from stemcal.report.verdict import shown_notes

    return [
        Note(stage_called(result.name).title, sentence)
        for result in results.done()
        for sentence in shown_notes(result, verdict.holds)
    ]
