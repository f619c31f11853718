"""The response surface, the stage rsm: a quadratic in the factors that matter, fitted to the runs of a design."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from stemcal.registry import surface_designs
from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.folder.study_folder import StudyFolder
    from stemcal.solvers.protocol import Solver
    from stemcal.stages.design import Asked
    from stemcal.stages.surface.result import SurfaceResult
    from stemcal.study.model import Study


class ResponseSurface(Stage["SurfaceResult"]):
    """The runs of a design, and a quadratic surface fitted to them."""

    name, title, reads = "rsm", "Response surface", ("rsm",)
    help = "Simulate the response surface design and fit the surface."

    def needs(self, study: Study) -> str | None:
        """Return a climb if there is one, else the screening; a surface of named factors needs neither."""
        if study.climb is not None:
            return "climb"
        return "screen" if isinstance(study.rsm.factors, str) else None

    def inputs(self, study: Study) -> Mapping[str, object]:
        """Return another package's design, where a joint fit has it run as well, and what it fits there."""
        joint, package = study.joint_targets, surface_designs().version_of(study.rsm.design)
        fitted = {"conditions": [target.condition for target in joint], "responses": study.invert.responses}
        return ({"package": package} if package else {}) | (fitted if joint else {})

    def result(self) -> type[SurfaceResult]:
        from stemcal.stages.surface.result import SurfaceResult

        return SurfaceResult

    def making(self) -> Callable[..., SurfaceResult]:
        from stemcal.stages.surface.analysis import fit_response_surface

        return fit_response_surface

    def foresee(self, study: Study, solver: Solver, folder: StudyFolder | None) -> Asked | None:
        from stemcal.stages.surface.analysis import foresee

        return foresee(study, solver, folder)

    def showing(self) -> object:
        from stemcal.stages.surface.showing import SurfaceShowing

        return SurfaceShowing()
