"""The stage screen: find the factors that affect the response."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import Stage

if TYPE_CHECKING:
    from stemcal.study.model.study import Study


class Screen(Stage[Any]):
    """A two-level design in all factors, and the effects estimated from it."""

    name, title, reads = "screen", "Screening", ("screen",)
    help = "Identify the factors that significantly affect the response."
    of_surface = True
    purpose = "Stage 1: screening of the factors."

    def asked_for(self, study: Study) -> bool:
        return bool(self.options(study).wanted) and super().asked_for(study)
