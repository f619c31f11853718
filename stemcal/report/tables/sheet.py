"""A table as data: made once from results, drawn by the terminal and by the page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from stemcal.naming import FORCE, Named, Naming
from stemcal.report.numbers import decimals, probability, short, significant


@dataclass(frozen=True)
class Sheet:
    """A table: the first `texts` columns are words, the others numbers; `strong` rows stand out, `long` words wrap.

    On the page a `detail` is folded. A sheet that `claims`, intervals or agreement, holds for a calibrated study only,
    as do `claiming` columns and lines of the foot.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    texts: int = 1
    foot: tuple[str, ...] = ()
    strong: frozenset[int] = frozenset()
    long: bool = False
    detail: bool = False
    claims: bool = False
    claiming: tuple[str, ...] = ()

    def unclaimed(self) -> Sheet | None:
        """Return what is left of it where the study is not calibrated."""
        if self.claims:
            return None
        kept = [index for index, column in enumerate(self.columns) if column not in self.claiming]
        return replace(
            self,
            columns=tuple(self.columns[index] for index in kept),
            rows=tuple(tuple(row[index] for index in kept) for row in self.rows),
            foot=tuple(line for line in self.foot if line not in self.claiming),
        )


def borne(sheets: Iterable[Sheet], holds: bool) -> list[Sheet]:
    """Return the sheets as a study bears them: whole, or without what holds for a calibrated one only."""
    return [left for sheet in sheets if (left := sheet if holds else sheet.unclaimed()) is not None]


def starred(p: float | None, stars: str) -> str:
    """Return a p-value with its stars, the digits aligned."""
    return f"{probability(p)}{stars:<2}" if p is not None else ""


def place_head(naming: Naming, between: str = ", ") -> tuple[str, ...]:
    """Return the head of the column that tells the condition; none where a study has none."""
    return () if naming.condition is None else (naming.condition.heading(between),)


def place_cell(naming: Naming, value: float | None) -> tuple[str, ...]:
    """Return the cell below it."""
    return () if naming.condition is None else (short(value),)


def response_decimals(response: Named, values: Iterable[float | None], usual: int = 2) -> int:
    """Return the decimals of a response's values: those of forces in N, more where a response is small."""
    return usual if response == FORCE else decimals(values, usual)


def response_or_reason(response: float | None, reason: str) -> str:
    """Return a force, or why there is none."""
    return significant(response) if response is not None else reason
