"""What an audit looks at and what it finds."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from stemcal.files.typed import Spread, absent, inline
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.printed_tables import Audited, Contradiction
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model import Study


@dataclass(frozen=True)
class Calibrated:
    """The results that an audit looks at."""

    screen: ScreenResult
    surface: SurfaceResult
    inversion: InvertResult
    validation: ValidateResult | None

    def published(self) -> list[Audited]:
        """Return what the stages found about the printed tables."""
        checked = None if self.validation is None else self.validation.published
        found = (self.screen.published, self.surface.published, checked)
        return [audited for audited in found if audited is not None]


Consequence = Literal["result", "conclusion", "method", "print"]
CONSEQUENCES: tuple[Consequence, ...] = ("result", "conclusion", "method", "print")


@dataclass(frozen=True)
class Found(Spread):
    """One thing that does not agree.

    `consequence`: the ``result`` would be another, a ``conclusion`` does not hold, the ``method`` is doubtful, or only
    the ``print`` is. Things of the same `cause` are one finding, told by the first; `follows` says what else comes of
    it.
    """

    fact: Contradiction = inline()
    consequence: Consequence = "conclusion"
    cause: str = ""
    follows: tuple[Contradiction, ...] = absent(())


Check = Callable[[Study, Calibrated], Iterator[Found]]


def ranked(found: Iterable[Found]) -> list[Found]:
    """Return one finding for each cause by consequence, those of a cell's sign before others."""
    causes: dict[str, list[Found]] = {}
    for number, one in enumerate(found):
        causes.setdefault(one.cause or f"#{number}", []).append(one)
    return sorted(map(_together, causes.values()), key=lambda one: (CONSEQUENCES.index(one.consequence), _weight(one)))


def _together(found: Sequence[Found]) -> Found:
    """Return the weightiest of one cause, with what the others say."""
    first = min(found, key=lambda one: CONSEQUENCES.index(one.consequence))
    return replace(first, follows=tuple(one.fact for one in found if one is not first))


def _weight(found: Found) -> int:
    return 0 if found.fact.of_sign else 1
