"""A keyword deck as blocks of cards: standard, long and free format, titles, comments passed over."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.errors import UsageError
from stemcal.solvers.deck.fixed_width import LONG, SETTINGS, STANDARD

__all__ = ["Block", "blocks", "settings"]

Array = NDArray[np.float64]

# Options behind a keyword's name that put a card of text before the others.
_HEADED = re.compile(r"_(TITLE|ID)$")
# Keywords whose cards are as many parts or sections, each with its title if they have titles.
_SEVERAL = {"PART", "SECTION_SOLID"}
# A Fortran number may lack its E.
_NO_E = re.compile(r"(?<=[0-9.])([-+][0-9]+)$")


_MOST = 1e30


@dataclass(frozen=True)
class Block:
    """A keyword with its cards as they stand; `line` is that of the keyword."""

    name: str
    heading: str
    cards: tuple[str, ...]
    width: int
    line: int

    def fields(self, card: int, names: Sequence[str], width: int | None = None) -> dict[str, float]:
        """Return the numbers of a card by name; empty fields and missing cards are 0.

        Raises
        ------
        UsageError
            If a field holds no number.
        """
        texts = _split(self.cards[card], width or self.width) if card < len(self.cards) else []
        texts += [""] * (len(names) - len(texts))
        return {name: self._number(text, name) for name, text in zip(names, texts, strict=False)}

    def rows(self, widths: Sequence[int]) -> Array:
        """Return the cards (N, len(widths)) of a table such as *NODE; empty fields are 0."""
        edges = np.cumsum([0, *widths]).tolist()
        spans = list(pairwise(edges))
        rows = [self._row(card, spans) for card in self.cards]
        return np.array(rows, dtype=float).reshape(-1, len(widths))

    def _row(self, card: str, spans: Sequence[tuple[int, int]]) -> list[float]:
        texts = card.split(",") if "," in card else [card[begin:end] for begin, end in spans]
        texts += [""] * (len(spans) - len(texts))
        return [self._number(text, "a column") for text in texts[: len(spans)]]

    def _number(self, text: str, name: str) -> float:
        text = text.strip()
        for way in (text or "0", _NO_E.sub(r"e\1", text.upper().replace("D", "E"))):
            try:
                if isfinite(number := float(way)) and abs(number) < _MOST:
                    return number
            except ValueError:
                continue
        place = f"*{self.name} at line {self.line}"
        raise UsageError(f"{place}: {name} is {text[:40]!r}, no usable number; parameters (&) are not read")


def blocks(text: str) -> Iterator[Block]:
    """Yield the keywords of a deck up to ``*END``."""
    lines = text.splitlines()
    starts = [index for index, line in enumerate(lines) if line.startswith("*")]
    long_deck = False
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        word, *rest = lines[start][1:].strip().upper().split()
        if word == "KEYWORD":
            long_deck = any(re.fullmatch(r"LONG=[YS]", part) for part in rest)
        if word == "END":
            return
        long = word.endswith("+") or (long_deck and not word.endswith("-"))
        cards = [line for line in lines[start + 1 : end] if not line.startswith("$") and line.strip()]
        name = word.rstrip("+-")
        headed = _HEADED.search(name) is not None or name == "PART"  # which has a title always
        plain = _HEADED.sub("", name)
        each = (1 + headed) if plain in _SEVERAL and cards else max(len(cards), 1)
        for at in range(0, max(len(cards), 1), each):
            own = cards[at : at + each]
            heading = own.pop(0).strip() if headed and own else ""
            yield Block(plain, heading, tuple(own), LONG if long else STANDARD, start + 1)


def settings(text: str) -> dict[str, Any]:
    """Return what a deck of stemcal's tells in comments, since no card can."""
    told = " ".join(line.removeprefix(SETTINGS) for line in text.splitlines() if line.startswith(SETTINGS))
    try:
        found = json.loads(told) if told else {}
    except ValueError:
        raise UsageError(
            f"the lines that begin with {SETTINGS.strip()} are damaged; remove them or mend them"
        ) from None
    return found if isinstance(found, dict) else {}


def _split(card: str, width: int) -> list[str]:
    return card.split(",") if "," in card else [card[at : at + width] for at in range(0, len(card), width)]
