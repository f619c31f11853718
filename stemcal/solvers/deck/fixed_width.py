"""Keyword cards: fields in columns, numbers as they are.

A keyword is written in LS-DYNA's standard format, fields of ten columns, which every reader knows. If one of its
numbers needs more, that keyword alone is in long format, fields of twenty columns, marked by a ``+`` behind its
name. So a value of the study stands in the deck with all its digits.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import chain

__all__ = ["Card", "fitted", "keyword", "text_of"]

Card = Mapping[str, float | int | str]

STANDARD, LONG = 10, 20
_HEADING = "$#"


def keyword(name: str, *cards: Card, title: str | None = None) -> Iterable[str]:
    """Yield the lines of a keyword: its name, a title if it has one, and each card below its fields' names.

    >>> print(*keyword("DATABASE_GLSTAT", {"dt": 0.001, "binary": 1}), sep="\\n")
    *DATABASE_GLSTAT
    $#      dt    binary
         0.001         1
    """
    widest = max((len(text_of(value)) for card in cards for value in card.values()), default=0)
    if widest > LONG:
        raise ValueError(f"*{name}: a value has more than {LONG} characters")
    width = STANDARD if widest <= STANDARD else LONG
    yield f"*{name}{'+' if width == LONG else ''}"
    if title is not None:
        yield title[:80]
    yield from chain.from_iterable(_card(card, width) for card in cards)


def _card(card: Card, width: int) -> Iterable[str]:
    heading = "".join(f"{name:>{width}}" for name in card)
    yield _HEADING + heading[len(_HEADING) :]
    yield "".join(f"{text_of(value):>{width}}" for value in card.values())


def text_of(value: float | int | str) -> str:
    """Return the shortest text that reads back as the same value.

    >>> text_of(17.96), text_of(1.1e-09), text_of(1000.0), text_of(4)
    ('17.96', '1.1e-09', '1000.0', '4')
    """
    return value if isinstance(value, str) else repr(float(value) if isinstance(value, float) else int(value))


def fitted(value: float, width: int) -> str:
    """Return a number with as many of its digits as `width` columns hold.

    >>> fitted(17.96, 10), fitted(14.204482103412, 10), fitted(-1.2345678901e-05, 10)
    ('17.96', '14.2044821', '-1.2346e-5')
    """
    exact = repr(float(value))
    if len(exact) <= width:
        return exact
    for digits in range(16, 0, -1):
        text = _short_exponent(f"{value:.{digits}g}")
        if len(text) <= width:
            return text
    raise ValueError(f"{value:g} does not fit into {width} columns")


def _short_exponent(text: str) -> str:
    """Return ``1.5e-05`` as ``1.5e-5``, and a whole number with its point."""
    mantissa, exponent, power = text.partition("e")
    if not exponent:
        return mantissa if "." in mantissa else f"{mantissa}.0"
    return f"{mantissa}e{int(power)}"
