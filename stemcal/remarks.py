"""Sentences that a result tells beside its numbers, and what each weighs.

A remark is declared beside the code that makes it: a template and its weight. Files hold the sentence alone, and its
weight is known again by the same template, so neither can change without the other.
"""

from __future__ import annotations

import fnmatch
import glob
from string import Formatter
from typing import ClassVar

from stemcal.notes import Weight

__all__ = ["Remark", "Weight", "weight_of"]


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
