"""The stage climb: steepest ascent of the significant factors between screening and response surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.study.model.study import Study


class Climb(Stage[Any]):
    """Steps of steepest ascent; the best step is the centre of the design of the surface."""

    name, title, reads = "climb", "Climb", ("climb", "rsm", "targets")
    one_by_one = True
    help = """Move the centre of the design towards the target by steepest ascent.

        All significant factors are changed simultaneously until the response passes the target. The effects
        estimated in the screening determine the direction of steepest ascent. The `climb.steps` key limits the number
        of steps. The step whose response is closest to the target becomes the centre of the response surface design.
        `stemcal run` includes the steepest ascent if the spec has a `climb` section.
        """
    purpose = (
        "Steepest ascent between stages 1 and 2: steps towards the target response. If a spec has no `climb` section, "
        "the study has no steepest ascent."
    )
    by_section = of_surface = True

    def needs(self, study: Study) -> str | None:
        return "screen"
