"""How a validation is shown: measured against simulated, at every condition."""

from dataclasses import replace

from stemcal.files.rows import Column, Table
from stemcal.files.typed import to_json
from stemcal.naming import Names
from stemcal.numbers import fixed, short, significant, tenths
from stemcal.report.figures.plot import Plot
from stemcal.report.showing import Setting, Showing
from stemcal.report.tables.columns import (
    ERROR,
    condition,
    from_means,
    further_table,
    simulated,
)
from stemcal.stages.validate import figures
from stemcal.stages.validate.result import ValidateResult
from stemcal.words import series

_LEFT_OUT = Column("left_out_percent", "Left out", "%", fixed)
_ERROR = "Error = 100·(measured − simulated)/measured"


class ValidateShowing(Showing[ValidateResult]):
    """The words, tables and figures of a validation."""

    claims = "agreement"

    def outcome(self, result: ValidateResult, names: Names) -> list[str]:
        """Return by how much simulation and measurement differ."""
        if result.worst_percent is None:
            return ["No run of the validation gave a response."]
        if len(result.rows) == 1:
            return [_single_outcome(result, names)]
        responses = "responses" if names.naming.others else names.response.long
        worst, mean = tenths(result.worst_percent), tenths(result.mean_abs_error_percent)
        return [
            f"At {len(result.rows)} values of the {names.condition.long}, the simulated and measured {responses} "
            f"differ by at most {worst} %, on average by {mean} %."
        ]

    def certainty(self, result: ValidateResult, names: Names) -> list[str]:
        """Return what checks the result independently, and whether a formula does as well."""
        tables = [note.text for note in result.notes if note.kind == "from_table"]
        return [_independent(result, names), *result.beside_formula(names), *tables]

    def tables(self, result: ValidateResult, names: Names, judged: bool = False) -> list[Table]:
        return _validation_tables(result, names)

    def closing(self, result: ValidateResult, setting: Setting) -> list[Table]:
        first, *others = _validation_tables(result, Names(setting.study.naming))
        return [replace(first, foot=first.foot[:1]), *(others if setting.study.naming.others else [])]

    def figures(self, result: ValidateResult, setting: Setting) -> list[Plot]:
        return figures.plots(setting.study, result)


def _validation_tables(stage: ValidateResult, names: Names) -> list[Table]:
    """Return measured against simulated, and further responses."""
    tables = [_validation_table(stage, names)]
    every = [{"condition": row.compared.condition, **to_json(one)} for row in stage.rows for one in row.further]
    further = from_means(every, names)
    if further:
        tables.append(further_table(further, ("simulated", "Simulated", significant), names, []))
    return tables


def _validation_table(stage: ValidateResult, names: Names) -> Table:
    """Return measured against simulated response over the conditions."""
    unit = names.response.written
    columns = [
        *condition(names.naming),
        Column("role", "Role", form=lambda role: role.replace("_", " "), words=True),
        Column("measured", "Measured", unit, short),
        simulated(names.response, "Simulated", "simulated"),
        ERROR,
        *([_LEFT_OUT] if any(row.left_out_percent is not None for row in stage.compared) else []),
    ]
    worst = [_errors_in_short(stage, names)] if names.placed else []
    title = f"Measured and simulated {names.response.long}"
    return Table.of(columns, stage.rows, title, (*worst, f"{_ERROR}."))


def _errors_in_short(stage: ValidateResult, names: Names) -> str:
    """Return the largest held-out error next to that of a formula, then the largest and the mean of all."""
    of = "over all responses" if names.naming.others else "absolute"
    every = f"argest error {fixed(stage.worst_percent)} %, mean {fixed(stage.mean_abs_error_percent)} % ({of})."
    if stage.worst_held_out_percent is None:
        return f"L{every}"
    formula = stage.formula
    beside = (
        f" (F = a·d^{formula.exponent:.3g} through the fitted forces: {fixed(formula.worst_held_out_percent)} %)"
        if formula is not None
        else ""
    )
    return f"Largest held-out error {fixed(stage.worst_held_out_percent)} %{beside}; l{every}"


def _single_outcome(stage: ValidateResult, names: Names) -> str:
    (row,) = stage.rows
    errors = {names.response.long: row.compared.error_percent}
    errors |= {names.naming.named(one.response).long: one.error_percent for one in row.further if one.judged}
    each = [f"{tenths(None if error is None else abs(error))} % ({response})" for response, error in errors.items()]
    return f"Simulated and measured values differ by {series(each)}."


def _independent(stage: ValidateResult, names: Names) -> str:
    errors = [abs(row.error_percent or 0.0) for row in stage.held_out]
    if not errors:
        return "Only fitted values were compared, so there is no independent check."
    places, within = names.conditions(row.condition for row in stage.held_out), f"{stage.tolerance_percent:g} %"
    if len(errors) == 1:
        verdict = "within" if errors[0] <= stage.tolerance_percent else "outside"
        return f"At {places}, not used for calibration, the error is {tenths(errors[0])} % ({verdict} {within})."
    good = sum(error <= stage.tolerance_percent for error in errors)
    return (
        f"At {places}, which were not used for calibration, the error is at most {tenths(max(errors))} %; {good} of "
        f"{len(errors)} values are within {within}."
    )
