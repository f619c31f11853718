"""How a validation is shown: measured against simulated, at every condition."""

from dataclasses import replace

from stemcal.drawing.columns import ERROR, condition, from_means, measured_columns, scores, simulated
from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import Setting, Showing
from stemcal.drawing.table import Column, Table
from stemcal.formats import direction, fixed, short, significant
from stemcal.stages.validate import figures
from stemcal.stages.validate.result import ValidateResult
from stemcal.storage.typed import to_json
from stemcal.vocabulary import Wording

_LEFT_OUT = Column("left_out_percent", "Left out", "%", direction)


class ValidateShowing(Showing[ValidateResult]):
    """The words, tables and figures of a validation."""

    claims = True

    def outcome(self, result: ValidateResult, names: Wording) -> list[str]:
        """Return by how much simulation and measurement differ."""
        if result.worst_percent is None:
            return ["All validation runs failed."]
        differ = "responses differ" if names.naming.others else f"{names.response.long} differs"
        worst, mean = fixed(result.worst_percent, 1), fixed(result.mean_abs_error_percent, 1)
        over = f" ({mean} % on average over {len(result.rows)} values of the {names.condition.long})"
        of_all = over if len(result.rows) > 1 else ""
        measured = "measurements" if names.naming.others or of_all else "measurement"
        return [f"The simulated {differ} from the {measured} by at most {worst} %{of_all}."]

    def tables(self, result: ValidateResult, names: Wording) -> list[Table]:
        """Return measured against simulated, and further responses."""
        tables = [_validation_table(result, names)]
        every = [{"condition": row.compared.condition, **to_json(one)} for row in result.rows for one in row.further]
        if further := from_means(every, names):
            values = ("measured", "Measured", short), ("simulated", "Simulated", significant)
            title = f"Responses other than the {names.response.long}"
            columns = [*measured_columns(names, True, values), ERROR]
            tables.append(Table.of(columns, further, title, scores(names)))
        return tables

    def closing(self, result: ValidateResult, setting: Setting) -> list[Table]:
        first, *others = self.tables(result, Wording(setting.study.naming))
        return [replace(first, foot=first.foot[:1]), *others]

    def figures(self, result: ValidateResult, setting: Setting) -> list[Plot]:
        return figures.validate_plots(setting.study, result)


def _validation_table(stage: ValidateResult, names: Wording) -> Table:
    """Return measured against simulated response over the conditions."""
    unit = names.response.written
    columns = [
        *condition(names.naming),
        Column("role", "Role", form=lambda role: role.replace("_", " "), words=True),
        Column("measured", "Measured", unit, short),
        simulated(names.response, "Simulated"),
        ERROR,
        *([_LEFT_OUT] if any(row.left_out_percent is not None for row in stage.compared) else []),
    ]
    worst = [_errors_in_short(stage, names)] if names.placed else []
    title = f"Measured and simulated {names.response.long}"
    return Table.of(columns, stage.rows, title, (*worst, "Error in % = 100·(measured − simulated)/measured."))


def _errors_in_short(stage: ValidateResult, names: Wording) -> str:
    """Return the largest and the mean error, then the largest held-out error next to that of a formula."""
    of = " (all responses)" if names.naming.others else ""
    worst, mean = fixed(stage.worst_percent), fixed(stage.mean_abs_error_percent)
    every = f"Largest absolute percentage error: {worst} %; mean absolute percentage error: {mean} %{of}."
    if stage.worst_held_out_percent is None:
        return every
    formula = stage.formula
    of_formula = (
        f" (formula F = a·d^{formula.exponent:.3g}: {fixed(formula.worst_held_out_percent)} %)" if formula else ""
    )
    return f"{every} Largest held-out error: {fixed(stage.worst_held_out_percent)} %{of_formula}."
