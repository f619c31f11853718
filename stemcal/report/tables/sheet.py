"""A table as data: made once from results, drawn by the terminal and by the page."""

from __future__ import annotations

from dataclasses import dataclass

from stemcal.report.numbers import probability, significant


@dataclass(frozen=True)
class Sheet:
    """A table: the first `texts` columns are words, the others numbers; `strong` rows stand out, `long` words wrap."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    texts: int = 1
    foot: tuple[str, ...] = ()
    strong: frozenset[int] = frozenset()
    long: bool = False


def starred(p: float | None, stars: str) -> str:
    """Return a p-value with its stars, the digits aligned."""
    return f"{probability(p)}{stars:<2}" if p is not None else ""


def force_or_reason(force: float | None, reason: str) -> str:
    """Return a force, or why there is none."""
    return significant(force) if force is not None else reason
