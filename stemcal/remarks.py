"""Sentences that a result tells beside its numbers, and what each weighs.

A remark is declared beside the code that makes it: a template and its weight. Files hold the sentence alone, and its
weight is known again by the same template, so neither can change without the other.
"""

from __future__ import annotations

import fnmatch
import glob
from enum import IntEnum
from string import Formatter
from typing import ClassVar

__all__ = ["Remark", "Weight", "weight_of"]


class Weight(IntEnum):
    """How soon a remark is read, by what it would change; the first is read first."""

    NUMBERS = 0
    """Something is missing or wrong in what the result is made of: runs that failed, forces that are bounds, terms
    left out, a surface that extrapolates."""
    USE = 1
    """How far the result may be used: diameters that it misses, effects that may be chance, factors left free."""
    TRUST = 2
    """What makes statistics look better or worse than they are; so does every sentence that is no `Remark`."""
    ASIDE = 3
    """What is told for completeness."""


class Remark:
    """A sentence with fields, as `str.format` has them, and its weight.

    >>> bent = Remark(Weight.USE, "Blade {blade} is bent by {angle:.1f}°.")
    >>> bent(blade="A", angle=2.54)
    'Blade A is bent by 2.5°.'
    >>> bent.says("Blade B is bent by 0.3°."), bent.says("Blade B is straight.")
    (True, False)
    """

    declared: ClassVar[list[Remark]] = []
    """Every remark of the modules that are imported."""

    def __init__(self, weight: Weight, template: str) -> None:
        self.weight, self.template = weight, template
        parts = Formatter().parse(template)
        self._pattern = "".join(glob.escape(text) + ("" if field is None else "*") for text, field, _, _ in parts)
        self.declared.append(self)

    def __call__(self, **fields: object) -> str:
        """Return the sentence with its fields."""
        return self.template.format(**fields)

    def says(self, sentence: str) -> bool:
        """Tell whether a sentence is this remark, whatever its fields hold."""
        return fnmatch.fnmatchcase(sentence, self._pattern)


def weight_of(sentence: str) -> Weight:
    """Return what a sentence weighs, among the remarks of the modules that are imported."""
    return next((remark.weight for remark in Remark.declared if remark.says(sentence)), Weight.TRUST)
