"""The refinement: simulate at the solution, correct it, again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.study.model.study import Study


class Refine(Stage[Any]):
    """The parameters corrected by simulations, in the model of the study or of `refine.in`."""

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
        program. If a spec has no `refine` section, the study has no refinement."""
    by_section = True

    def needs(self, study: Study) -> str | None:
        """Return the stage whose parameters it corrects; in another model it comes after the validation."""
        return "validate" if self.options(study).elsewhere else "invert"

    def calibrates(self, study: Study) -> bool:
        return self.asked_for(study) and not self.options(study).elsewhere
