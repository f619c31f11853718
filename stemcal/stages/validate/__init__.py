"""The stage validate: compare measured means with simulations at the calibrated parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage, calibrating

if TYPE_CHECKING:
    from stemcal.study.model.study import Study


class Validate(Stage[Any]):
    """Comparison with the measurements at every condition."""

    name, title, attribute, reads = "validate", "Validation", "validation", ("targets", "validate")
    pictured = True
    help = "Simulate all measured conditions with the calibrated parameters."
    purpose = "Stage 5: comparison of simulated and measured responses at every measured diameter."

    def needs(self, study: Study) -> str | None:
        """Return the last stage that calibrates the parameters."""
        return calibrating(study).name

    def tolerance_percent(self, study: Study) -> float:
        return float(self.options(study).tolerance_percent)
