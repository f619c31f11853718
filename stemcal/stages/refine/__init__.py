"""The refinement: simulate at the solution, correct it, again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Parts, Stage

if TYPE_CHECKING:
    from stemcal.stages.design import Later
    from stemcal.stages.refine.options import RefineOptions
    from stemcal.study.model import Study


class Refinement(Stage[Any]):
    """The parameters corrected by simulations, in the model of the study or of `refine.in`."""

    name, title, attribute, reads = "refine", "Refinement", "refinement", ("refine", "targets")
    parts = Parts(__name__, "RefineOptions", "RefineResult", "refine", "RefineShowing", reasons="showing")
    pictured = one_by_one = True
    help = """Correct the parameters until the simulation matches the measured value.

        The stage stops within refine.tolerance_percent of the measured value, or after refine.budget simulations. For a
        joint fit (invert.diameters) every fitted diameter is simulated; the stage also stops when the fit no longer
        changes. `stemcal run` includes the stage if the spec has a `refine` section, and the validation then uses the
        refined parameters. With refine.in the stage runs after the validation, in the program or on the mesh where the
        parameters will be used.
        """
    purpose = """Stage 4: simulate at the solution and correct it, also in another program; skipped without this
        section."""
    by_section = True

    def needs(self, study: Study) -> str | None:
        """Return the stage whose parameters it corrects; in another model it comes after the validation."""
        return "validate" if self._options(study).elsewhere else "invert"

    def seen(self, study: Study) -> Study:
        from stemcal.stages.refine.options import model_of

        return model_of(study)

    def calibrates(self, study: Study) -> bool:
        return self.asked_for(study) and not self._options(study).elsewhere

    def most_there(self, study: Study) -> int:
        return self._options(study).budget

    def _options(self, study: Study) -> RefineOptions:
        from stemcal.stages.refine.options import RefineOptions

        return study.of(RefineOptions)

    def later(self, study: Study) -> Later | None:
        from stemcal.stages.refine.analysis import later

        return later(study)
