"""The stage optimise: find the optimum of a goal on the response surfaces, and confirm it by simulations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stemcal.stages.stage import STAGES, Stage

if TYPE_CHECKING:
    from stemcal.study.model.study import Study


class Optimise(Stage[Any]):
    """The optimum of a goal on the response surfaces, compared with the present cutter by simulations."""

    name, title, attribute, reads = "optimise", "Optimum", "optimum", ("goal", "optimise")
    pictured = True
    help = """Find the best settings for a goal, and confirm them by simulations.

        With two responses, the stage finds their Pareto front and its knee. The optimum and the present cutter are
        simulated. `stemcal run` includes this stage if the spec has a `goal` section.
        """
    purpose = "Last stage of a study with a `goal`: the optimum, confirmed by simulations."

    def needs(self, study: Study) -> str | None:
        return next((stage.name for stage in STAGES.built_in if stage.makes_surface(study)), None)

    def asked_for(self, study: Study) -> bool:
        return study.goal is not None

    def inputs(self, study: Study) -> Mapping[str, object]:
        """Return, as an input of the stage file, the other materials for which the gain is simulated."""
        others = [study.model_copy(update=other).model_dump(include=set(other)) for other in study.materials]
        return {"materials": others} if others else {}
