"""What is said of a paper's printed numbers beside the computed ones."""

from __future__ import annotations

from stemcal.notes import Weight
from stemcal.stages.printed_tables import Audited, sentences
from stemcal.text.notes import Remark


def remarks(published: Audited | None) -> list[Remark]:
    """Return the printed cells that disagree, the first few in full."""
    return [Remark(sentence, Weight.TRUST, sentence) for sentence in sentences(published)]
