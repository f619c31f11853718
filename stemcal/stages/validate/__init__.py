"""The validation: what was measured against what is simulated with the calibrated parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Parts, Stage, calibrating

if TYPE_CHECKING:
    from stemcal.folder import StudyFolder
    from stemcal.solvers.protocol import Solver
    from stemcal.stages.design import Asked
    from stemcal.study.model import Study


class Validating(Stage[Any]):
    """The comparison with what was measured, at every condition."""

    name, title, attribute, reads = "validate", "Validation", "validation", ("targets", "validate")
    parts = Parts(__name__, "ValidateOptions", "ValidateResult", "validate", "ValidateShowing", reasons="reasons")
    pictured = True
    help = "Simulate all measured conditions with the calibrated parameters."
    purpose = "Stage 5: the comparison at every measured diameter."

    def needs(self, study: Study) -> str | None:
        """Return the last stage at the solution that the study asks for."""
        return calibrating(study).name

    def foresee(self, study: Study, solver: Solver, folder: StudyFolder | None) -> Asked | None:
        from stemcal.stages.validate.analysis import foresee

        return foresee(study, solver, folder)
