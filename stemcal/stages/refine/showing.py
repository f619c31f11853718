"""Sentences and tables of a refinement: the moved factors, the responses before and after, every run."""

from collections.abc import Mapping

from stemcal.drawing.columns import ERROR, condition, factor, levels, simulated
from stemcal.drawing.showing import Setting, Showing
from stemcal.drawing.table import Column, Table
from stemcal.formats import counted, interval, series, short, significant
from stemcal.stages.refine.result import RefineResult
from stemcal.vocabulary import Wording, program


class RefineShowing(Showing[RefineResult]):
    """Sentences and tables of a refinement."""

    claims = True

    def outcome(self, result: RefineResult, names: Wording) -> list[str]:
        if result.elsewhere:
            return _there(result, names)
        count = len(result.trial_runs)
        done = "checked in 1 run" if count == 1 else f"corrected in {count} runs"
        done = f"determined in {counted(count, 'run')} from mid-range" if result.alone else done
        tolerance = f"{'is within' if result.converged else 'exceeds'} the tolerance of {result.tolerance_percent:g} %"
        return [
            f"The calibrated parameters were {done}. The error of {abs(result.error_percent):.2f} % at the calibrated "
            f"values {tolerance}."
        ]

    def tables(self, result: RefineResult, names: Wording) -> list[Table]:
        return [*_parameters(result, names), responses(result, names), runs(result, names)]

    def cited(self, result: RefineResult) -> Mapping[str, str]:
        return dict.fromkeys(result.determined, "")

    def closing(self, result: RefineResult, setting: Setting) -> list[Table]:
        names = Wording(setting.study.naming)
        return [*_parameters(result, names), *([responses(result, names)] if result.elsewhere else [])]


def _parameters(stage: RefineResult, names: Wording) -> list[Table]:
    """Return the table of the parameters for another model or, without a surface, of all parameters; else none."""
    if stage.alone:
        source = dict.fromkeys(stage.parameters, "mid-range") | dict.fromkeys(stage.determined, "refinement")
        rows = [{"factor": name, "value": stage.parameters[name], "source": source[name]} for name in source]
        columns = [factor(names), Column("value", "Value", form=significant), Column("source", "From")]
        return [Table.of(columns, rows, "Calibrated parameters")]
    if not stage.elsewhere:
        return []
    settings = ", ".join(f"{name} {value}" for name, value in (stage.model.depends_on or {}).items())
    known = any(row.interval is not None for row in stage.adjusted)
    columns = [
        factor(names),
        Column("calibrated", "Calibrated", form=significant),
        Column("value", "Other", form=significant),
        *([Column("interval", "95 % confidence interval", form=interval, claims=True)] if known else []),
        Column("between", "Range", form=interval, of=lambda row: (row.low, row.high)),
    ]
    foot = [
        "The other parameters retain their calibrated values. The search stops as soon as the error is within the "
        "tolerance, so other parameter values may fit equally well."
    ]
    if known:
        foot += [
            "95 % confidence interval: computed from the standard error of the measured mean, with the other "
            "parameters fixed."
        ]
    foot += [f"The parameters are valid only with {settings}."] if settings else []
    return [Table.of(columns, stage.adjusted, f"Parameters for {program(stage.model.kind)}", foot)]


def responses(stage: RefineResult, names: Wording) -> Table:
    """Return the table of measured and simulated responses, before and after the refinement."""
    several = len({row.response for row in stage.rows}) > 1
    unit = "" if several else names.response.written
    columns = [
        *condition(names.naming),
        *([Column("response", "Response", of=lambda row: names.naming.named(row.response).capital)] if several else []),
        Column("measured", "Measured", unit, short),
        Column("before", "Before", unit, significant),
        Column("after", "After", unit, significant),
        ERROR,
    ]
    foot = [
        f"The error relative to the target is {'below' if stage.converged else 'above'} {stage.tolerance_percent:g} % "
        f"after {len(stage.trial_runs)} of at most {stage.budget} runs."
    ]
    if stage.aim != stage.fitted.measured:
        foot += [f"After a joint fit, the target is the value predicted by the study ({names.quantity(stage.aim)})."]
    where = program(stage.model.kind) if stage.elsewhere else "the model of the study"
    foot += ["Error in % = 100·(measured − refined)/measured."]
    return Table.of(columns, stage.rows, f"Measured values and simulations in {where}", foot)


def runs(stage: RefineResult, names: Wording) -> Table:
    """Return the table of runs with levels, predicted and simulated response."""
    columns = [
        Column("run", "No.", form=format),
        Column("how", "From"),
        *condition(names.naming),
        *levels(stage.varied, names),
        Column("predicted", "Predicted", names.response.written, significant),
        simulated(names.response, "Simulated"),
    ]
    return Table.of(columns, stage.trial_runs, "Refinement runs", detail=True)


def _there(stage: RefineResult, names: Wording) -> list[str]:
    row, there = stage.fitted, program(stage.model.kind)
    if row.after is None:
        return []
    moved = [entry for entry in stage.adjusted if entry.value != entry.calibrated]
    values = series(f"{names.in_text(entry.factor)} = {significant(entry.value)}" for entry in moved)
    parameters = f"refined parameters ({values})" if moved else "calibrated parameters"
    return [
        f"The simulated {names.response.long} in {there} with the {parameters} is {names.quantity(row.after)}. The "
        f"target value is {names.quantity(stage.aim)}."
    ]
