"""Near misses: what somebody probably meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

__all__ = ["did_you_mean", "listed", "nearest"]

_MOST = 12
_LONGEST = 60


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word nearest to `word`, None if none is near.

    >>> nearest("yeild_stress", ["density", "yield_stress"])
    'yield_stress'
    """
    words = {name.lower(): name for name in known}
    near = difflib.get_close_matches(word.lower()[:100], list(words), n=1)
    return words[near[0]] if near else None


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the remedy for an unknown word: the nearest one, or else all there are."""
    names = list(known)
    near = nearest(word, names)
    if near is not None:
        return f"did you mean {near[:_LONGEST]}?"
    return f"use {listed(names)}" if names else ""


def listed(names: Iterable[str]) -> str:
    """Return names as people list them.

    >>> listed(["a", "b", "c"])
    'a, b or c'
    """
    words = [name[:_LONGEST] for name in names]
    if len(words) > _MOST:
        return ", ".join(words[:_MOST]) + ", …"
    return " or ".join(filter(None, [", ".join(words[:-1]), words[-1] if words else ""]))
