"""Notes: what a result has to say beside its numbers, as facts. `stemcal.text` makes the sentences.

A kind of note is declared beside the code that finds it, with the values that it speaks of; `Tagged` makes it a frozen
dataclass. In files it is ``{"kind": "flat_response", "weight": "numbers", ...values}``.
"""

from enum import IntEnum
from typing import ClassVar

from stemcal.files.typed import Tagged


class Weight(IntEnum):
    """How soon a note is read, by what it would change; the first is read first."""

    NUMBERS = 0
    """Something is missing or wrong in what the result is made of: runs that failed, values that are bounds, terms
    left out, a surface that extrapolates."""
    USE = 1
    """How far the result may be used: conditions that it misses, effects that may be chance, factors left free."""
    TRUST = 2
    """What makes statistics look better or worse than they are."""
    ASIDE = 3
    """What is said for completeness."""


class Note(Tagged):
    """A fact worth a sentence. Each kind sets its weight; one that `claims` holds for a calibrated study only.

    >>> class BladeBent(Note, weight=Weight.USE):
    ...     angle: float
    >>> BladeBent(2.5).tags()
    {'kind': 'blade_bent', 'weight': 'use'}
    """

    weight: ClassVar[Weight]
    claims: ClassVar[bool]

    def __init_subclass__(cls, weight: Weight = Weight.TRUST, claims: bool = False, **kind: str) -> None:
        """Set what holds for all notes of the kind."""
        super().__init_subclass__(**kind)
        cls.weight, cls.claims = weight, claims

    def tags(self) -> dict[str, str]:
        """Return the kind and the weight."""
        return {**super().tags(), "weight": self.weight.name.lower()}
