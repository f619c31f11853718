"""The response surface, the stage rsm: a quadratic in the factors that matter, fitted to the runs of a design."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from stemcal.registry import surface_designs
from stemcal.stages.stage import Parts, Stage, stage_called

if TYPE_CHECKING:
    from stemcal.folder import StudyFolder
    from stemcal.note import Note
    from stemcal.solvers.protocol import Solver
    from stemcal.stages.design import Asked
    from stemcal.stages.surface.options import RsmOptions
    from stemcal.study.model import Study


class ResponseSurface(Stage[Any]):
    """The runs of a design, and a quadratic surface fitted to them."""

    name, title, attribute, reads = "rsm", "Response surface", "surface", ("rsm",)
    parts = Parts(__name__, "RsmOptions", "SurfaceResult", "fit_response_surface", "SurfaceShowing", reasons="reasons")
    help = "Simulate the response surface design and fit the surface."
    purpose = "Stage 2: the response surface."

    def needs(self, study: Study) -> str | None:
        """Return a climb if there is one, else the screening; a surface of named factors needs neither."""
        if stage_called("climb").asked_for(study):
            return "climb"
        return "screen" if isinstance(self._options(study).factors, str) else None

    def inputs(self, study: Study) -> Mapping[str, object]:
        """Return another package's design, where a joint fit has it run as well, and what it fits there."""
        joint, package = study.joint_targets, surface_designs().version_of(self._options(study).design)
        fitted = {"conditions": [target.condition for target in joint], "responses": study.fitted_responses}
        return ({"package": package} if package else {}) | (fitted if joint else {})

    def _options(self, study: Study) -> RsmOptions:
        from stemcal.stages.surface.options import RsmOptions

        return study.of(RsmOptions)

    def beforehand(self, study: Study) -> Iterator[Note]:
        from stemcal.stages.surface.analysis import beforehand

        return beforehand(study)

    def foresee(self, study: Study, solver: Solver, folder: StudyFolder | None) -> Asked | None:
        from stemcal.stages.surface.analysis import foresee

        return foresee(study, solver, folder)
