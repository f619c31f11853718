"""Sentences and tables of steepest ascent."""

from stemcal.drawing.columns import ERROR, levels, simulated
from stemcal.drawing.showing import Showing
from stemcal.drawing.table import Column, Table
from stemcal.formats import counted, fixed, significant
from stemcal.stages.climb.result import ClimbResult
from stemcal.vocabulary import Wording


class ClimbShowing(Showing[ClimbResult]):
    """Sentences and tables of steepest ascent."""

    def outcome(self, result: ClimbResult, names: Wording) -> list[str]:
        moved = "was changed" if len(result.names) == 1 else "were changed together"
        reached = "passed" if result.passed else "did not reach"
        smallest = f"The smallest error ({fixed(abs(result.error_percent), 1)} %)"
        return [
            f"During steepest ascent, {names.factors(result.names)} {moved} in {counted(len(result.rows), 'run')}.",
            f"The response {reached} the target. {smallest} was obtained at step {result.best_step}.",
        ]

    def tables(self, result: ClimbResult, names: Wording) -> list[Table]:
        columns = [Column("step", "Step", form=format), *levels(result.names, names), simulated(names.response), ERROR]
        centres = ", ".join(
            f"{names.in_text(name)} {significant(scale.center)} ± {significant(scale.half_step)}"
            for name, scale in result.coding.items()
        )
        foot = (
            f"Target {names.quantity(result.target, '.6g')}{names.at(result.condition)}.",
            "Error in % = 100·(measured − simulated)/measured.",
            f"Levels of the response surface design: {centres} (coded 0 ± 1).",
        )
        return [Table.of(columns, result.rows, "Steps towards the target", foot, strong=frozenset({result.best_step}))]
