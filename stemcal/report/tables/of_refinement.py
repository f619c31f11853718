"""Tables of the refinement: the parameters in another model, the responses before and after, and the runs."""

from stemcal.files.rows import Column, Table
from stemcal.numbers import fixed, interval, short, significant
from stemcal.report.tables.columns import ERROR, condition, factor, levels, simulated
from stemcal.stages.refine.element_size import TOLERANCE, SizedStrains
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.refine.words import program
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.tables import line

_INSIDE = {True: say("inside"), False: say("outside"), None: ""}


def refine_tables(stage: RefineResult, names: Names) -> list[Table]:
    """Return what moved in another model, the responses, and every run."""
    return [*([_parameters(stage, names)] if stage.elsewhere else []), responses(stage, names), runs(stage, names)]


def _parameters(stage: RefineResult, names: Names) -> Table:
    settings = ", ".join(f"{name} {value}" for name, value in (stage.model.belongs_to or {}).items())
    known = any(one.interval is not None for one in stage.adjusted)
    columns = [
        factor(names),
        Column("calibrated", "Calibrated", form=significant),
        Column("value", "There", form=significant),
        *([Column("interval", "95 % range", form=interval, claims=True)] if known else []),
        Column("between", "Between", form=interval, of=lambda one: (one.low, one.high)),
    ]
    foot = [line("alone"), *([line("range there")] if known else [])]
    foot += [line("belongs", settings=settings)] if settings else []
    return Table.of(columns, stage.adjusted, line("refined there", there=program(stage.model.kind)), foot)


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
    there = program(stage.model.kind) if stage.elsewhere else line("own model")
    near = {"tolerance": stage.tolerance_percent, "runs": len(stage.made), "budget": stage.budget}
    reached = line("within" if stage.converged else "beyond", **near)
    aim = [] if stage.aims_at_measured else [line("aim of own", names, aim=stage.aim)]
    return Table.of(columns, stage.rows, line("refinement", there=there), [reached, *aim, line("error after")])


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
    return Table.of(columns, stage.made, line("refinement runs"), [line("predicted then", names)], detail=True)


def strain_table(found: SizedStrains) -> Table:
    """Return the failure strain of every element size."""
    columns = [
        Column("element_size", "Element size", "mm", significant),
        Column("failure_strain", "Failure strain", form=significant),
        Column("interval", "95 % range", form=interval),
        Column("force", "Mean force", "N", significant),
        Column("sd_percent", "SD over positions", "%", fixed),
        Column("positions", "Positions", form=format),
        Column("runs", "Runs", form=format),
        Column("valid", "Valid", of=lambda row: line("valid" if row.valid else "not valid")),
    ]
    foot = line("strains", aim=found.aim, at=found.condition, tolerance=100.0 * TOLERANCE)
    return Table.of(columns, found.rows, line("strain by size"), [foot])
