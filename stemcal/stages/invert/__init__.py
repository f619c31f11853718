"""The stage invert: find the parameters at which the response surfaces reproduce the measured means."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.study.model.measured_targets import Target
    from stemcal.study.model.study import Study


class Invert(Stage[Any]):
    """The calibrated parameters and their uncertainty."""

    name, title, attribute, reads = "invert", "Calibration", "inversion", ("invert", "targets")
    simulates, of_surface = False, True
    help = "Calibrate the parameters and compute their confidence intervals."
    purpose = "Stage 3: calibration of the parameters against the measured values."

    def needs(self, study: Study) -> str | None:
        return "rsm"

    def calibrates(self, study: Study) -> bool:
        return True

    def fits(self, study: Study) -> tuple[tuple[Target, ...], tuple[str, ...]]:
        from stemcal.stages.invert.options import InvertOptions, fitted_together

        return fitted_together(study), study.of(InvertOptions).responses
