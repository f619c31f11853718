"""The stage rsm: a quadratic response surface in the selected factors, fitted to the runs of a design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage, stage_called

if TYPE_CHECKING:
    from stemcal.study.model.study import Study


class Rsm(Stage[Any]):
    """The runs of a design, and a quadratic surface fitted to them."""

    name, title, attribute, reads = "rsm", "Response surface", "surface", ("rsm",)
    of_surface = True
    help = "Run an experimental design and fit a response surface to the results."
    purpose = "Stage 2: simulation of the design points and fitting of a response surface."

    def makes_surface(self, study: Study) -> bool:
        return bool(self.options(study).wanted)

    def needs(self, study: Study) -> str | None:
        """Return the climb if the study has one, else the screening; None if the spec names the factors."""
        if stage_called("climb").asked_for(study):
            return "climb"
        return "screen" if isinstance(self.options(study).factors, str) else None

    def inputs(self, study: Study) -> Mapping[str, object]:
        """Return further inputs: version of another package's design, conditions and responses of a joint fit."""
        from stemcal.doe.designs import SURFACES

        joint, package = study.joint_targets, SURFACES.version_of(self.options(study).design)
        fitted = {"conditions": [target.condition for target in joint], "responses": study.fitted_responses}
        return ({"package": package} if package else {}) | (fitted if joint else {})
