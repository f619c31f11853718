"""What an audit looks at and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

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
    validation: ValidateResult

    def published(self) -> list[Audited]:
        """Return what the stages found about the printed tables."""
        found = (self.screen.published, self.surface.published, self.validation.published)
        return [audited for audited in found if audited is not None]


@dataclass(frozen=True)
class Found:
    """One thing that does not agree. `kind`: sign, value, rounding, claim, design, extrapolation, law or setup."""

    place: str
    kind: str
    printed: str
    computed: str
    sentence: str


Check = Callable[[Study, Calibrated], Iterator[Found]]
