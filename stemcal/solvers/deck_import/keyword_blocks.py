"""A keyword deck as blocks of cards: standard, long and free format, titles, comments passed over."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from stemcal.errors import UsageError
from stemcal.solvers.deck.fixed_width import LONG, STANDARD
from stemcal.solvers.fortran import number_of

Array = NDArray[np.float64]

# Options behind a keyword's name that put a card of text before the others.
_HEADED = re.compile(r"_(TITLE|ID)$")
# Keywords whose cards are as many parts or sections, each with its title if they have titles.
_SEVERAL = {"PART", "SECTION_SOLID"}
_KEYWORD = re.compile(r"\*([A-Z0-9_./-]{1,80}[+%]?)")
_NUMBERING = {"pid", "secid", "mid", "lcid"}
MOST = 1e30  # numbers whose powers are still numbers
_MOST_NUMBER = 1e9  # of nodes, elements, parts
_MOST_KEYWORDS = 100_000


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
            If a field holds no number, or the number of a part, section, material or curve is not whole.
        """
        texts = _split(self.cards[card], width or self.width) if card < len(self.cards) else []
        texts += [""] * (len(names) - len(texts))
        found = {name: self._number(text, name) for name, text in zip(names, texts, strict=False)}
        for name in _NUMBERING.intersection(found):
            if not _is_numbering(found[name]):
                raise UsageError(f"{self.place}: {name} is {found[name]:g}; number it from 1 to {_MOST_NUMBER:g}")
        return found

    def rows(self, widths: Sequence[int], whole: Sequence[int] = ()) -> Array:
        """Return the cards (N, len(widths)) of a table such as *NODE; empty fields are 0.

        Raises
        ------
        UsageError
            If a field holds no number, or no whole one in the columns `whole`.
        """
        edges = np.cumsum([0, *widths]).tolist()
        spans = list(pairwise(edges))
        rows = np.array([self._row(card, spans) for card in self.cards], dtype=float).reshape(-1, len(widths))
        numbers = rows[:, list(whole)]
        if (wrong := numbers[(numbers != np.floor(numbers)) | (numbers < 0.0) | (numbers > _MOST_NUMBER)]).size:
            raise UsageError(f"{self.place}: a number is {wrong[0]:g}; number from 1 to {_MOST_NUMBER:g}")
        return rows

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"*{self.name} at line {self.line}"

    def _row(self, card: str, spans: Sequence[tuple[int, int]]) -> list[float]:
        texts = card.split(",") if "," in card else [card[begin:end] for begin, end in spans]
        texts += [""] * (len(spans) - len(texts))
        return [self._number(text, "a column") for text in texts[: len(spans)]]

    def _number(self, text: str, name: str) -> float:
        number = number_of(text) if text.strip() else 0.0
        if number is None or not abs(number) < MOST:
            raise UsageError(
                f"{self.place}: {name} is {text.strip()[:40]!r}, no usable number; write one below {MOST:g} "
                "(parameters, &, are not read)"
            )
        return number


def blocks(text: str) -> Iterator[Block]:
    """Yield the keywords of a deck up to ``*END``.

    Raises
    ------
    UsageError
        If there is none, one cannot be a keyword, or there are too many.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    starts = [index for index, line in enumerate(lines) if line.startswith("*")]
    if not starts:
        raise UsageError("there is no keyword in it, no line that begins with *; is it an LS-DYNA deck?")
    if len(starts) > _MOST_KEYWORDS:
        raise UsageError(f"there are {len(starts)} keywords in it, at most {_MOST_KEYWORDS} are read; give one stem's")
    long_deck = False
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        word, rest = _keyword(lines[start], start + 1)
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


def _keyword(line: str, number: int) -> tuple[str, list[str]]:
    """Return the name of a keyword and the words behind it."""
    first, *rest = line.upper().split()
    if (found := _KEYWORD.fullmatch(first)) is None:
        raise UsageError(f"line {number}: {line[:40]!r} is not a keyword; write * and its name, or remove the line")
    return found[1], rest


def _is_numbering(number: float) -> bool:
    return number.is_integer() and 0.0 <= number <= _MOST_NUMBER


def _split(card: str, width: int) -> list[str]:
    return card.split(",") if "," in card else [card[at : at + width] for at in range(0, len(card), width)]
