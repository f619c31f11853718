"""The nine fields of *MAT_PLASTIC_KINEMATIC in a user's own deck; every other byte stays as it is."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from stemcal.errors import UsageError
from stemcal.solvers.deck.fixed_width import LONG, STANDARD, fitted

# Parameter of stemcal → card (0, 1) and field of *MAT_003; field 0 of the first card is its number.
FIELDS: dict[str, tuple[int, int]] = {
    "density": (0, 1),
    "elastic_modulus": (0, 2),
    "poisson_ratio": (0, 3),
    "yield_stress": (0, 4),
    "tangent_modulus": (0, 5),
    "hardening_parameter": (0, 6),
    "strain_rate_c": (1, 0),
    "strain_rate_p": (1, 1),
    "failure_strain": (1, 2),
}

_NAMES = re.compile(rb"^\*MAT_(PLASTIC_KINEMATIC|0?03)(_TITLE)?[ \t]*([+-]?)[ \t]*\r?$", re.IGNORECASE | re.MULTILINE)
_LONG_DECK = re.compile(rb"^\*KEYWORD\b[^\r\n]*\bLONG\s*=\s*[YS]", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True)
class Material003:
    """Where a material stands in a deck: its number, its two cards as spans of bytes, the width of their fields."""

    number: int
    cards: tuple[tuple[int, int], tuple[int, int]]
    width: int


def find_material(deck: bytes) -> Material003:
    """Return the only *MAT_003 of a deck; raise `UsageError` if there is none, or more than one."""
    found = list(_materials(deck))
    if len(found) == 1:
        return found[0]
    there = ", ".join(str(material.number) for material in found) or "none"
    put = "put it into the deck itself, not into a file it includes"
    remedy = "put the others into a file that the deck includes" if found else put
    counted = f"{len(found)} *MAT_PLASTIC_KINEMATIC where one is needed"
    raise UsageError(f"solver.decks: {counted} (there are: {there}); {remedy}")


def replaced(deck: bytes, material: Material003, values: Mapping[str, float]) -> tuple[bytes, dict[str, str]]:
    """Return the deck with the material's values replaced, and the text that was written for each.

    A value is written with as many digits as its field holds.
    """
    written = {name: fitted(value, material.width) for name, value in values.items()}
    cards = [deck[begin:end] for begin, end in material.cards]
    for name, text in written.items():
        card, index = FIELDS[name]
        cards[card] = _with_field(cards[card], index, text.encode(), material.width)
    (begin, end), (then, last) = material.cards
    return deck[:begin] + cards[0] + deck[end:then] + cards[1] + deck[last:], written


def _materials(deck: bytes) -> Iterator[Material003]:
    long_deck = _LONG_DECK.search(deck) is not None
    for match in _NAMES.finditer(deck):
        long = match[3] == b"+" or (long_deck and match[3] != b"-")
        width = LONG if long else STANDARD
        wanted = 3 if match[2] else 2  # a title comes first
        cards = list(islice(_cards(deck, match.end()), wanted))
        if len(cards) == wanted:
            yield Material003(_number(deck[slice(*cards[-2])], width), (cards[-2], cards[-1]), width)


def _cards(deck: bytes, at: int) -> Iterator[tuple[int, int]]:
    r"""Yield where the cards after a keyword begin and end, comments passed over, \n or \r\n left out."""
    while (at := deck.find(b"\n", at) + 1) not in (0, len(deck)):
        first, end = deck[at : at + 1], deck.find(b"\n", at)
        end = len(deck) if end < 0 else end
        if first == b"*":
            return
        if first != b"$":
            yield at, end - (deck[end - 1 : end] == b"\r")


def _number(card: bytes, width: int) -> int:
    text = card.split(b",")[0] if b"," in card else card[:width]
    try:
        return int(float(text))
    except ValueError:
        shown = text.decode("ascii", "replace").strip()[:40]
        raise UsageError(f"solver.deck: *MAT_PLASTIC_KINEMATIC has the number {shown!r}; write a plain one") from None


def _with_field(card: bytes, index: int, text: bytes, width: int) -> bytes:
    """Return the card with one field replaced: between commas, or right-aligned in its columns."""
    if b"," in card:
        fields = card.split(b",")
        fields += [b""] * (index + 1 - len(fields))
        fields[index] = text
        return b",".join(fields)
    begin = index * width
    return card[:begin].ljust(begin) + text.rjust(width) + card[begin + width :]
