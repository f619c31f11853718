"""Words in sentences: near misses, lists, numbers with their nouns."""

import difflib
from collections.abc import Iterable

_MOST = 12
_LONGEST = 60


def near(word: str, known: Iterable[str], most: int = 1) -> list[str]:
    """Return the known words nearest to `word`, none if none is near."""
    words = {name.lower(): name for name in known}
    return [words[found] for found in difflib.get_close_matches(word.lower()[:100], list(words), n=most)]


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word nearest to `word`, None if none is near.

    >>> nearest("yeild_stress", ["density", "yield_stress"])
    'yield_stress'
    """
    return next(iter(near(word, known)), None)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the remedy for an unknown word: the nearest one, or else all there are."""
    names = list(known)
    meant = nearest(word, names)
    if meant is not None:
        return f"did you mean {meant[:_LONGEST]}?"
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


def counted(count: int, noun: str) -> str:
    """Return a number with its noun.

    >>> counted(1, "run"), counted(12, "run")
    ('1 run', '12 runs')
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def series(words: Iterable[object], joint: str = "and") -> str:
    """Return several things as a sentence lists them.

    >>> series(["a"]), series(["a", "b"], "or"), series(["a", "b", "c"])
    ('a', 'a or b', 'a, b and c')
    """
    *first, last = [str(word) for word in words] or [""]
    return f"{', '.join(first)} {joint} {last}" if first else last
