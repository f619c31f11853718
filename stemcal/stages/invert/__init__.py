"""The calibration, the stage invert: the parameters with which the surface gives what was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Parts, Stage

if TYPE_CHECKING:
    from stemcal.study.model import Study, Target


class Calibration(Stage[Any]):
    """The calibrated parameters, and how well they are known."""

    name, title, attribute, reads = "invert", "Calibration", "inversion", ("invert", "targets")
    parts = Parts(__name__, "InvertOptions", "InvertResult", "invert", "InvertShowing", reasons="reasons")
    simulates = False
    help = "Solve the surface for the calibrated parameters and their intervals."
    purpose = "Stage 3: the parameters that reproduce the measured force."

    def needs(self, study: Study) -> str | None:
        return "rsm"

    def calibrates(self, study: Study) -> bool:
        return True

    def fits(self, study: Study) -> tuple[tuple[Target, ...], tuple[str, ...]]:
        from stemcal.stages.invert.options import InvertOptions, fitted_together

        return fitted_together(study), study.of(InvertOptions).responses
