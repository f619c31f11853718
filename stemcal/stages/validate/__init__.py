"""The validation: what was measured against what is simulated with the calibrated parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage, calibrating

if TYPE_CHECKING:
    from stemcal.note import Note
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.solvers.protocol import Solver
    from stemcal.stages.design import Asked
    from stemcal.stages.validate.options import ValidateOptions
    from stemcal.stages.validate.result import ValidateResult
    from stemcal.study.model import Study


class Validating(Stage["ValidateResult"]):
    """The comparison with what was measured, at every condition."""

    name, title, attribute, reads = "validate", "Validation", "validation", ("targets", "validate")
    pictured = True
    help = "Simulate all measured conditions with the calibrated parameters."
    purpose = "Stage 5: comparison of simulated and measured responses at every measured diameter."

    def needs(self, study: Study) -> str | None:
        """Return the last stage at the solution that the study asks for."""
        return calibrating(study).name

    def foresee(self, study: Study, solver: Solver, folder: StudyFolder | None) -> Asked | None:
        from stemcal.stages.validate.analysis import foresee

        return foresee(study, solver, folder)

    def section(self) -> type[ValidateOptions]:
        from stemcal.stages.validate.options import ValidateOptions

        return ValidateOptions

    def result(self) -> type[ValidateResult]:
        from stemcal.stages.validate.result import ValidateResult

        return ValidateResult

    def making(self) -> Callable[..., ValidateResult]:
        from stemcal.stages.validate.analysis import validate

        return validate

    def reasons(self) -> Sequence[Callable[[Any], Iterator[Note]]]:
        from stemcal.stages.validate.verdict_rules import RULES

        return RULES

    def showing(self) -> object:
        from stemcal.stages.validate.showing import ValidateShowing

        return ValidateShowing()
