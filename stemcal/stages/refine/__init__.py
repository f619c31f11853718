"""The refinement: simulate the calibrated parameters, correct them, and repeat."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage, has_surface

if TYPE_CHECKING:
    from stemcal.study.model.study import Study


class Refine(Stage[Any]):
    """Correction of the parameters by simulation, in the study's own model or in the model of `refine.in`."""

    name, title, attribute, reads = "refine", "Refinement", "refinement", ("refine", "targets")
    pictured = one_by_one = True
    help = """Adjust the parameters until the simulation agrees with the measurement.

        The refinement stops when the error in the simulated response is below `refine.tolerance_percent`, or after
        `refine.budget` simulations. If forces at several diameters were fitted (`invert.diameters`), the refinement
        includes all these diameters. `stemcal run` includes the refinement if the spec has a `refine` section. The
        validation uses the refined parameters. If the spec has a `refine.in` key, the refinement follows the
        validation and uses the finite element program or mesh specified by this key.
        """
    purpose = """Stage 4: correction of the calibrated parameters by simulation, optionally in another finite element
        program. If a spec has no `refine` section, the study has no refinement, except with `rsm: {design: none}`: the
        refinement then calibrates the parameters."""
    by_section = True

    def asked_for(self, study: Study) -> bool:
        return super().asked_for(study) or not has_surface(study)

    def inputs(self, study: Study) -> Mapping[str, object]:
        """Return the varied factors and fitted means; with a surface, earlier stages already have them as inputs."""
        from stemcal.stages.rsm.options import RsmOptions

        if has_surface(study):
            return {}
        conditions = [target.condition for target in study.joint_targets]
        return {"varied": study.of(RsmOptions).factors, "fitted": [conditions, study.fitted_responses]}

    def needs(self, study: Study) -> str | None:
        """Return the stage whose parameters are corrected; in another model this follows the validation."""
        if not has_surface(study):
            return None
        return "validate" if self.options(study).elsewhere else "invert"

    def calibrates(self, study: Study) -> bool:
        return self.asked_for(study) and not self.options(study).elsewhere
