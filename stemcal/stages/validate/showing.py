"""Sentences, tables and figures of the validation."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from stemcal.doe.comparison import ValidationRow
from stemcal.drawing.columns import ERROR, condition, from_means, measured_columns, scores, simulated
from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import Setting, Showing
from stemcal.drawing.style import BLUE, INK, ORANGE, Figure, legend_above, literal, new_figure
from stemcal.drawing.table import Column, Table
from stemcal.formats import direction, fixed, short, significant
from stemcal.stages.validate.result import ValidateResult
from stemcal.storage.typed import to_json
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST, Variable, Wording

_LEFT_OUT = Column("left_out_percent", "Cross-val.", "%", direction)


class ValidateShowing(Showing[ValidateResult]):
    """Sentences, tables and figures of a validation."""

    claims = True

    def outcome(self, result: ValidateResult, names: Wording) -> list[str]:
        if result.worst_percent is None:
            return ["All validation runs failed."]
        differ = "responses differ" if names.naming.others else f"{names.response.long} differs"
        worst, mean = fixed(result.worst_percent, 1), fixed(result.mean_abs_error_percent, 1)
        over = f" ({mean} % on average over {len(result.rows)} values of the {names.condition.long})"
        of_all = over if len(result.rows) > 1 else ""
        measured = "measurements" if names.naming.others or of_all else "measurement"
        return [f"The simulated {differ} from the {measured} by at most {worst} %{of_all}."]

    def tables(self, result: ValidateResult, names: Wording) -> list[Table]:
        tables = [_validation_table(result, names)]
        every = [{"condition": row.compared.condition, **to_json(mean)} for row in result.rows for mean in row.further]
        if further := from_means(every, names):
            values = ("measured", "Measured", short), ("simulated", "Simulated", significant)
            title = f"Responses other than the {names.response.long}"
            tables.append(Table.of([*measured_columns(names, True, values), ERROR], further, title, scores(names)))
        return tables

    def closing(self, result: ValidateResult, setting: Setting) -> list[Table]:
        first, *others = self.tables(result, Wording(setting.study.naming))
        return [replace(first, foot=first.foot[:1]), *others]

    def figures(self, result: ValidateResult, setting: Setting) -> list[Plot]:
        return validate_plots(setting.study, result)


def _validation_table(stage: ValidateResult, names: Wording) -> Table:
    unit = names.response.written
    columns = [
        *condition(names.naming),
        Column("role", "Role", form=lambda role: role.replace("_", " "), words=True),
        Column("measured", "Measured", unit, short),
        simulated(names.response, "Simulated"),
        ERROR,
        *([_LEFT_OUT] if any(row.left_out_percent is not None for row in stage.compared) else []),
    ]
    worst = [_errors_in_short(stage, names)] if names.has_condition else []
    title = f"Measured and simulated {names.response.long}"
    return Table.of(columns, stage.rows, title, (*worst, "Error in % = 100·(measured − simulated)/measured."))


def _errors_in_short(stage: ValidateResult, names: Wording) -> str:
    of = " (all responses)" if names.naming.others else ""
    worst, mean = fixed(stage.worst_percent), fixed(stage.mean_abs_error_percent)
    every = f"Largest absolute percentage error: {worst} %; mean absolute percentage error: {mean} %{of}."
    if stage.worst_held_out_percent is None:
        return every
    held_out = f"{every} Largest held-out error: {fixed(stage.worst_held_out_percent)} %"
    if (formula := stage.formula) is None:
        return f"{held_out}."
    return f"{held_out} (formula F = a·d^{formula.exponent:.3g}: {fixed(formula.worst_held_out_percent)} %)."


MOST_RESPONSES = 6  # largest number of responses with a figure in the report
_MOST_TICKS = 12


def validate_plots(study: Study, validate: ValidateResult) -> list[Plot]:
    """Return a figure for each response; the report shows the first `MOST_RESPONSES`."""
    naming, plots = study.naming, []
    simulated = {further.response for row in validate.rows for further in row.further}
    responses = [naming.response, *(other for other in naming.others if other.name in simulated)]
    for number, response in enumerate(responses):
        called = FIRST if response is naming.response else response.name
        measured = ((target.condition, target.mean_of(called)[1]) for target in study.targets.means)
        spread = {place: sd for place, sd in measured if sd is not None}
        text = f"Measured and simulated {response.long}"
        if naming.condition is not None:
            text += "; the circled values were used in the fit" if validate.fitted else ""
        text += ". Bars show the standard deviation of the measurements." if spread else "."
        name = "validation" if response is naming.response else f"validation-{response.name}"
        draw = partial(draw_validation, validate, spread, response)
        if response is naming.response and len(responses) > MOST_RESPONSES:
            text += f" Of {len(responses)} responses, the report shows the first {MOST_RESPONSES}."
        plots.append(Plot(name, "validate", text, draw, number < MOST_RESPONSES))
    return plots


def draw_validation(
    validate: ValidateResult, spread: Mapping[float, float] | None = None, response: Variable | None = None
) -> Figure:
    """Draw a response over the condition, fitted values circled; `spread`: standard deviations by condition."""
    condition, response = validate.naming.condition, response or validate.naming.response
    rows, spread = _pairs(validate, response), spread or {}
    with new_figure(height=2.9) as figure:
        axes = figure.add_subplot()
        axes.plot([r.condition for r in rows], [r.measured for r in rows], "o-", color=BLUE, label="measured")
        done = [(r.condition, r.simulated) for r in rows if r.simulated is not None]
        axes.plot([at for at, _ in done], [value for _, value in done], "s--", color=ORANGE, label="simulated")
        if bars := [(r.condition, r.measured, spread[r.condition]) for r in rows if r.condition in spread]:
            places, means, lengths = zip(*bars, strict=True)
            axes.errorbar(places, means, yerr=lengths, fmt="none", ecolor=BLUE, elinewidth=1, capsize=3)
        for row in rows:
            if row.role == "fitted":
                axes.plot(row.condition, row.measured, "o", color=INK, fillstyle="none", markersize=13)
        axes.set_xlabel("" if condition is None else literal(condition.headed(condition.long)))
        axes.set_ylabel(literal(response.headed(response.long)))
        if response.apart:
            axes.margins(y=0.1)
        else:
            highest = (1.03 * (r.measured + spread.get(r.condition, 0.0)) for r in rows)
            axes.set_ylim(0.0, max(axes.get_ylim()[1], *highest))
        if len(at := sorted({row.condition for row in rows})) <= _MOST_TICKS:
            axes.set_xticks(at, [f"{place:g}" if condition is not None else "" for place in at])
        legend_above(axes)
    return figure


def _pairs(validate: ValidateResult, response: Variable) -> list[ValidationRow]:
    if response == validate.naming.response:
        return validate.compared
    pairs = ((row.compared, each) for row in validate.rows for each in row.further if each.response == response.name)
    shown = response.table_value
    return [
        replace(row, measured=shown(each.measured, each.measured), simulated=shown(each.simulated, each.measured))
        for row, each in pairs
    ]
