"""Factors by their labels, as readers of a page know them; specs and commands call them by name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping


def named(text: str, labels: Mapping[str, str]) -> str:
    """Return a text with the label of each factor in place of its name.

    >>> named("yield_stress = 17 fixes my_yield_stress", {"yield_stress": "Yield stress"})
    'Yield stress = 17 fixes my_yield_stress'
    """
    known = {name: label for name, label in labels.items() if label and name in text}
    if not known:
        return text
    longest_first = sorted(known, key=len, reverse=True)
    pattern = rf"(?<![\w`])({'|'.join(map(re.escape, longest_first))})(?![\w`])"
    return re.sub(pattern, lambda found: known[found[1]], text)


def named_all(texts: Iterable[str], labels: Mapping[str, str]) -> list[str]:
    """Return several texts so."""
    return [named(text, labels) for text in texts]
