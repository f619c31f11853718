"""How a refinement is shown: what moved, the responses before and after, every run."""

from collections.abc import Iterator
from functools import partial

from stemcal.files.rows import Column, Table
from stemcal.naming import Names, program
from stemcal.note import Note, Remedy
from stemcal.numbers import interval, short, significant
from stemcal.report.figures.plot import Plot
from stemcal.report.figures.style import BLUE, FAINT, GREEN, INK, Figure, legend_above, new_figure, plain
from stemcal.report.showing import Setting, Showing
from stemcal.report.tables.columns import ERROR, PaperTable, condition, factor, levels, printed, run_heads, simulated
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.verdict.rules import Evidence
from stemcal.words import counted, series

_SERIES = (("measured", "o-", BLUE), ("before", "^:", FAINT), ("after", "D-", GREEN))


class RefineShowing(Showing[RefineResult]):
    """The words, tables and figures of a refinement."""

    claims = "agreement"

    def outcome(self, result: RefineResult, names: Names) -> list[str]:
        """Return what the refinement changed, and the error that is left."""
        if result.elsewhere:
            return _there(result, names)
        count = len(result.made)
        runs = "Solution checked in 1 run" if count == 1 else f"Solution corrected in {count} runs"
        error = f"{abs(result.error_percent):.2f} %, {'' if result.converged else 'not '}within the tolerance of"
        return [f"{runs}: the error is {error} {result.tolerance_percent:g} %."]

    def warnings(self, result: RefineResult) -> list[str]:
        return [] if result.converged else [_shortfall(result)]

    def tables(self, result: RefineResult, names: Names) -> list[Table]:
        return refine_tables(result, names)

    def findings(self, result: RefineResult, names: Names) -> list[Table]:
        return [table for table in refine_tables(result, names) if not table.detail] if result.elsewhere else []

    def figures(self, result: RefineResult, setting: Setting) -> list[Plot]:
        response = result.naming.response.capital
        text = f"{response}: measured, and simulated before and after the refinement. The target is circled."
        return [Plot("refinement", result.name, text, partial(refined, result))] if len(result.rows) > 1 else []

    def printed(self, result: RefineResult, setting: Setting) -> list[PaperTable]:
        heads = {**run_heads(setting.study, "run"), "predicted": "Predicted Value"}
        caption, note = "Iterations of simulation and refitted surface.", "Predicted by the surface before the run."
        return [printed("refinement", caption, runs(result, setting.symbols), heads, note)]


_INSIDE = {True: "inside", False: "outside", None: ""}


def refine_tables(stage: RefineResult, names: Names) -> list[Table]:
    """Return what moved in another model, the responses, and every run."""
    return [*([_parameters(stage, names)] if stage.elsewhere else []), responses(stage, names), runs(stage, names)]


def _parameters(stage: RefineResult, names: Names) -> Table:
    settings = ", ".join(f"{name} {value}" for name, value in (stage.model.belongs_to or {}).items())
    known = any(one.interval is not None for one in stage.adjusted)
    columns = [
        factor(names),
        Column("calibrated", "Calibrated", form=significant),
        Column("value", "Other", form=significant),
        *([Column("interval", "95 % range", form=interval, claims=True)] if known else []),
        Column("between", "Range", form=interval, of=lambda one: (one.low, one.high)),
    ]
    foot = [
        "Other parameters keep their calibrated values. The search ends at the first values within the tolerance; "
        "other values may fit equally well."
    ]
    foot += ["95 % range: from the scatter of the measured mean, other parameters fixed."] if known else []
    foot += [f"They depend on {settings}."] if settings else []
    return Table.of(columns, stage.adjusted, f"Parameters for {program(stage.model.kind)}", foot)


def responses(stage: RefineResult, names: Names) -> Table:
    """Return measured and simulated responses, before and after."""
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
        f"The best point is {'' if stage.converged else 'not '}within {stage.tolerance_percent:g} %, after "
        f"{len(stage.made)} of {stage.budget} runs."
    ]
    if not stage.aims_at_measured:
        foot += [f"After a joint fit the target is the result of the study's own model: {names.quantity(stage.aim)}."]
    where = program(stage.model.kind) if stage.elsewhere else "the study's own model"
    foot += ["Error = 100·(measured − after)/measured."]
    return Table.of(columns, stage.rows, f"Measured and simulated, {where}", foot)


def runs(stage: RefineResult, names: Names) -> Table:
    """Return every run: its levels, the response predicted by then, and the simulated one."""
    columns = [
        Column("run", "No.", form=format),
        Column("how", "From"),
        *condition(names.naming),
        *levels(stage.varied, names),
        Column("predicted", "Predicted", names.response.written, significant),
        *([] if stage.elsewhere else [Column("interval", "Interval", of=lambda run: _INSIDE[run.inside_interval])]),
        simulated(names.response, "Simulated"),
    ]
    foot = (
        f"Predicted: before the run. Interval: whether the simulated {names.response.long} is inside its 95 % "
        "prediction interval."
    )
    return Table.of(columns, stage.made, "Runs of the refinement", [foot], detail=True)


def refined(stage: RefineResult) -> Figure:
    """Return the responses over the condition; the target is ringed."""
    condition = stage.naming.condition
    with new_figure(height=3.1) as figure:
        axes = figure.add_subplot()
        for key, style, colour in _SERIES:
            points = [(row.condition, value) for row in stage.rows if (value := getattr(row, key)) is not None]
            axes.plot([at for at, _ in points], [value for _, value in points], style, color=colour, label=key)
        axes.plot(stage.condition, stage.aim, "o", color=INK, fillstyle="none", markersize=13)
        at = [row.condition for row in stage.rows]
        axes.set_xticks(at, [f"{value:g}" for value in at] if condition is not None else [""] * len(at))
        axes.set_xlabel("" if condition is None else plain(condition.axis()))
        axes.set_ylabel(plain(stage.naming.response.axis()))
        axes.set_ylim(bottom=0)
        legend_above(axes, most=3)
    return figure


def _there(stage: RefineResult, names: Names) -> list[str]:
    row, there = stage.fitted, program(stage.model.kind)
    if row.after is None:
        return []
    target = f"the target is {names.quantity(stage.aim)}"
    moved = [one for one in stage.adjusted if one.value != one.calibrated]
    if not moved:
        return [f"In {there} the calibrated parameters give {names.quantity(row.after)}; {target}."]
    values = ", ".join(f"{names.factor(one.factor)} {significant(one.value)}" for one in moved)
    before = "" if row.before is None else f", the calibrated values give {names.quantity(row.before)}"
    return [f"For {there}: {values}. These give {names.quantity(row.after)}{before}; {target}."]


def _shortfall(stage: RefineResult) -> str:
    """Return how far from the target a refinement ended that did not reach it."""
    return f"refine: {abs(stage.error_percent):.2f} % from the target after {counted(len(stage.made), 'run')}"


def missed(evidence: Evidence) -> Iterator[Note]:
    """Yield that the other model does not reach its target."""
    found = evidence.of(RefineResult)
    if found is None or not found.elsewhere or found.converged:
        return
    budget, factors = 2 * found.budget, series([one.factor for one in found.adjusted])
    wider = f"give {factors} a wider range under `refine.adjust`"
    remedies = {
        "budget": Remedy(f"Raise `refine.budget` to {budget}, or {wider}.", f"refine: {{budget: {budget}}}"),
        "out_of_reach": Remedy(f"{wider.capitalize()}, or add another factor there."),
    }
    aim = "the measured one" if found.aims_at_measured else "that of the study's own model"
    missed = f"differs from {aim} by {abs(found.error_percent):.1f} %."
    text = f"In {found.model.kind} the {evidence.names.response.long} {missed}"
    smoother = Remedy("Average over mesh positions in `refine.in`, or adjust another factor.")
    yield Note("missed_there", "warning", text, remedies.get(found.stopped, smoother))


RULES = (missed,)
