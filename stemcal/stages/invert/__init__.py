"""The calibration, the stage invert: the parameters with which the surface gives what was measured."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.stages.invert.result import InvertResult
    from stemcal.study.model import Study


class Calibration(Stage["InvertResult"]):
    """The calibrated parameters, and how well they are known."""

    name, title, reads, simulates = "invert", "Calibration", ("invert", "targets"), False
    help = "Solve the surface for the calibrated parameters and their intervals."

    def needs(self, study: Study) -> str | None:
        return "rsm"

    def result(self) -> type[InvertResult]:
        from stemcal.stages.invert.result import InvertResult

        return InvertResult

    def making(self) -> Callable[..., InvertResult]:
        from stemcal.stages.invert.analysis import invert

        return invert

    def showing(self) -> object:
        from stemcal.stages.invert.showing import InvertShowing

        return InvertShowing()
