"""The climb between screening and surface: active factors stepped together towards the target."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.stages.climb.result import ClimbResult
    from stemcal.stages.design import Later
    from stemcal.study.model import Study


class Climbing(Stage["ClimbResult"]):
    """Steps along the slope that the screening found; the best one centres the design of the surface."""

    name, title, reads = "climb", "Climb", ("climb", "rsm", "targets")
    one_by_one = True
    help = """Step the active factors together towards the measured value; the best step centres the surface's design.

        It walks along the slope that the screening found, climb.steps at most, until the response is past the target.
        With a section climb in the spec it is part of `stemcal run`.
        """

    def needs(self, study: Study) -> str | None:
        return "screen"

    def asked_for(self, study: Study) -> bool:
        return study.climb is not None

    def result(self) -> type[ClimbResult]:
        from stemcal.stages.climb.result import ClimbResult

        return ClimbResult

    def making(self) -> Callable[..., ClimbResult]:
        from stemcal.stages.climb.analysis import climb

        return climb

    def later(self, study: Study) -> Later | None:
        from stemcal.stages.climb.analysis import later

        return later(study)

    def showing(self) -> object:
        from stemcal.stages.climb.showing import ClimbShowing

        return ClimbShowing()
