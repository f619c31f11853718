"""The calibration, the stage invert: the parameters with which the surface gives what was measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.note import Note
    from stemcal.stages.invert.options import InvertOptions
    from stemcal.stages.invert.result import InvertResult
    from stemcal.study.model import Study, Target


class Calibration(Stage["InvertResult"]):
    """The calibrated parameters, and how well they are known."""

    name, title, attribute, reads = "invert", "Calibration", "inversion", ("invert", "targets")
    simulates = False
    help = "Calibrate the parameters and compute their confidence intervals."
    purpose = "Stage 3: calibration of the parameters against the measured values."

    def needs(self, study: Study) -> str | None:
        return "rsm"

    def calibrates(self, study: Study) -> bool:
        return True

    def fits(self, study: Study) -> tuple[tuple[Target, ...], tuple[str, ...]]:
        from stemcal.stages.invert.options import InvertOptions, fitted_together

        return fitted_together(study), study.of(InvertOptions).responses

    def section(self) -> type[InvertOptions]:
        from stemcal.stages.invert.options import InvertOptions

        return InvertOptions

    def result(self) -> type[InvertResult]:
        from stemcal.stages.invert.result import InvertResult

        return InvertResult

    def making(self) -> Callable[..., InvertResult]:
        from stemcal.stages.invert.analysis import invert

        return invert

    def reasons(self) -> Sequence[Callable[[Any], Iterator[Note]]]:
        from stemcal.stages.invert.verdict_rules import RULES

        return RULES

    def showing(self) -> object:
        from stemcal.stages.invert.showing import InvertShowing

        return InvertShowing()
