"""What was found, one finding for each cause, the weightiest first."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from stemcal.stages.audit.found import CONSEQUENCES, Found


def ranked(found: Iterable[Found]) -> list[Found]:
    """Return one finding for each cause by consequence; a changed sign of the equation stands before other results."""
    causes: dict[str, list[Found]] = {}
    for number, one in enumerate(found):
        causes.setdefault(one.cause or f"#{number}", []).append(one)
    return sorted(map(_together, causes.values()), key=lambda one: (CONSEQUENCES.index(one.consequence), _weight(one)))


def _together(found: Sequence[Found]) -> Found:
    """Return the weightiest of one cause, with what the others say."""
    first = min(found, key=lambda one: CONSEQUENCES.index(one.consequence))
    return replace(first, follows=tuple(one.sentence for one in found if one is not first))


def _weight(found: Found) -> int:
    return 0 if found.kind == "sign" else 1
