"""Notes: what a result has to say beside its numbers, as facts. `stemcal.text` makes the sentences.

A kind of note is a frozen dataclass with the values that it speaks of, declared beside the code that finds them. In
files it is ``{"kind": "flat_response", "weight": "numbers", ...values}``.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar

from stemcal.files.typed import Tagged

__all__ = ["Note", "Weight"]


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


@dataclass(frozen=True)
class Note(Tagged):
    """A fact worth a sentence. Each kind sets its weight; one that `claims` holds for a calibrated study only.

    >>> @dataclass(frozen=True)
    ... class BladeBent(Note):
    ...     weight = Weight.USE
    ...     angle: float
    >>> BladeBent(2.5).tags()
    {'kind': 'blade_bent', 'weight': 'use'}
    """

    weight: ClassVar[Weight] = Weight.TRUST
    claims: ClassVar[bool] = False

    def tags(self) -> dict[str, str]:
        """Return the kind and the weight."""
        return {**super().tags(), "weight": self.weight.name.lower()}
