"""The screening: which factors move the response."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.solvers.protocol import Solver
    from stemcal.stages.design import Asked
    from stemcal.stages.screen.options import ScreenOptions
    from stemcal.stages.screen.result import ScreenResult
    from stemcal.study.model import Study


class Screening(Stage["ScreenResult"]):
    """A design with two levels of every factor, and the effects found in it."""

    name, title, reads = "screen", "Screening", ("screen",)
    help = "Identify the factors that significantly affect the response."
    purpose = "Stage 1: screening of the factors."

    def asked_for(self, study: Study) -> bool:
        from stemcal.stages.screen.options import is_screened

        return is_screened(study)

    def foresee(self, study: Study, solver: Solver, folder: StudyFolder | None) -> Asked | None:
        from stemcal.stages.screen.analysis import foresee

        return foresee(study, solver) if self.asked_for(study) else None

    def section(self) -> type[ScreenOptions]:
        from stemcal.stages.screen.options import ScreenOptions

        return ScreenOptions

    def result(self) -> type[ScreenResult]:
        from stemcal.stages.screen.result import ScreenResult

        return ScreenResult

    def making(self) -> Callable[..., ScreenResult]:
        from stemcal.stages.screen.analysis import screen

        return screen

    def showing(self) -> object:
        from stemcal.stages.screen.showing import ScreenShowing

        return ScreenShowing()
