"""Factors by their labels, as readers of a page know them; specs and commands call them by name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace

from stemcal.report.tables.sheet import Sheet


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


def relabelled(sheet: Sheet, labels: Mapping[str, str]) -> Sheet:
    """Return a table so: its heads, its words and its foot."""
    rows = tuple((*named_all(row[: sheet.texts], labels), *row[sheet.texts :]) for row in sheet.rows)
    columns, foot = tuple(named_all(sheet.columns, labels)), tuple(named_all(sheet.foot, labels))
    return replace(sheet, columns=columns, rows=rows, foot=foot)
