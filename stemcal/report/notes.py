"""Which notes are read first: by their weight, in the order of what they would change."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module

from stemcal.remarks import Weight, weight_of
from stemcal.stages.base import STAGES, stage_called
from stemcal.stages.results import Results
from stemcal.stages.verdict.result import Verdict

MOST = 5


@dataclass(frozen=True)
class Note:
    """A sentence, the stage, or whatever else, that says it, and its weight."""

    source: str
    sentence: str
    weight: Weight

    def __str__(self) -> str:
        return f"{self.source}: {self.sentence}"


def warned(warnings: Iterable[str]) -> list[Note]:
    """Return what the solver warned of: it is about the numbers themselves."""
    return [Note("runs", sentence, Weight.NUMBERS) for sentence in warnings]


def weighed(notes: Iterable[Note], told: Iterable[str] = ()) -> list[Note]:
    """Return the notes by weight, each kind once; sentences told already are left out."""
    said, kinds, kept = set(told), set[str](), []
    for note in sorted(notes, key=lambda note: note.weight):
        kind = re.sub(r"[\d.]+", "#", note.sentence.partition(":")[0] if len(note.sentence) > 60 else note.sentence)
        if note.sentence not in said and kind not in kinds:
            kinds.add(kind)
            kept.append(note)
    return kept


def notes_of(results: Results, verdict: Verdict) -> list[Note]:
    """Return the notes of all stages, as far as the verdict bears them, in the order of the stages."""
    from stemcal.report.verdict import shown_notes

    for stage in STAGES:
        import_module(stage.module)  # which declares the remarks of its files
    return [
        Note(stage_called(result.name).title, sentence, weight_of(sentence))
        for result in results.done()
        for sentence in shown_notes(result, verdict.holds)
    ]
