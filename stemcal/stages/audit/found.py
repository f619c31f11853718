"""What an audit looks at and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

from stemcal.files.typed import absent
from stemcal.stages.audit.cells import Audited
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate import ValidateResult
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
class Found:
    """One thing that does not agree.

    `kind`: sign, value, rounding, claim, design, extrapolation, law or setup. `consequence`: the ``result`` would be
    another, a ``conclusion`` does not hold, the ``method`` is doubtful, or only the ``print`` is. Things of the same
    `cause` are one finding, told by the first; `follows` says what else comes of it.
    """

    place: str
    kind: str
    printed: str
    computed: str
    sentence: str
    consequence: Consequence = "conclusion"
    cause: str = ""
    follows: tuple[str, ...] = absent(())


Check = Callable[[Study, Calibrated], Iterator[Found]]
