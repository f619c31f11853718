"""The climb between screening and surface: active factors stepped together towards the target."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.stages.climb.options import ClimbOptions
    from stemcal.stages.climb.result import ClimbResult
    from stemcal.stages.design import Later
    from stemcal.study.model import Study


class Climbing(Stage["ClimbResult"]):
    """Steps along the slope that the screening found; the best one centres the design of the surface."""

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
    by_section = True

    def needs(self, study: Study) -> str | None:
        return "screen"

    def later(self, study: Study) -> Later | None:
        from stemcal.stages.climb.analysis import later

        return later(study)

    def section(self) -> type[ClimbOptions]:
        from stemcal.stages.climb.options import ClimbOptions

        return ClimbOptions

    def result(self) -> type[ClimbResult]:
        from stemcal.stages.climb.result import ClimbResult

        return ClimbResult

    def making(self) -> Callable[..., ClimbResult]:
        from stemcal.stages.climb.analysis import climb

        return climb

    def showing(self) -> object:
        from stemcal.stages.climb.showing import ClimbShowing

        return ClimbShowing()
