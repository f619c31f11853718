"""Tables of measured and simulated responses: of a joint fit, of the refinement, of the validation."""

from collections.abc import Iterable, Mapping
from typing import Any

from stemcal.files.rows import Column, Table
from stemcal.files.typed import to_json
from stemcal.names import Names
from stemcal.numbers import fixed, interval, short, significant
from stemcal.report.tables.columns import ERROR, Form, condition, factor, levels, measured_of, simulated
from stemcal.stages.invert.result import JointFitted
from stemcal.stages.refine.element_size import TOLERANCE, SizedStrains
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.refine.words import program
from stemcal.stages.validate.result import ValidateResult

_JOINT = "Fitted together"
_LEFT_OUT = Column("left_out_percent", "Left out", "%", fixed)


def validation_tables(stage: ValidateResult, names: Names) -> list[Table]:
    """Return measured against simulated, and further responses."""
    tables = [validation_table(stage, names)]
    every = [{"condition": row.compared.condition, **to_json(one)} for row in stage.rows for one in row.further]
    further = from_means(every, names)
    if further:
        tables.append(further_table(further, ("simulated", "Simulated", significant), names, []))
    return tables


def validation_table(stage: ValidateResult, names: Names) -> Table:
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
    worst = [errors_in_short(stage, names)] if names.placed else []
    title = f"Measured against simulated {names.response.long}"
    return Table.of(columns, stage.rows, title, (*worst, "Error = 100·(measured − simulated)/measured."))


def errors_in_short(stage: ValidateResult, names: Names) -> str:
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


def joint_table(joint: JointFitted, names: Names) -> Table:
    """Return what was measured beside the surfaces."""
    values = ("measured", "Measured", short), ("predicted", "Surface", significant)
    columns = measured_of(names, bool(names.naming.others), values)
    error, left_out = joint.max_abs_error_percent, joint.max_abs_left_out_error_percent
    rows = from_means(map(to_json, joint.rows), names)
    columns.append(ERROR)
    if left_out is None:
        return Table.of(columns, rows, _JOINT, [f"Largest error {fixed(error)} %.", *_scores(names)])
    columns.append(Column("left_out_error_percent", "Left out", "%", fixed))
    tests = any(row.left_out_interval is not None for row in joint.rows)
    if tests:
        columns.append(Column("left_out_interval", "Others allow", form=interval, claims=True))
    largest = f"Largest error {fixed(error)} %, left out {fixed(left_out)} %."
    others = "other tests. Others allow: where these put the mean, with 95 %." if tests else "others."
    foot = largest, f"Left out: predicted from a fit to the {others}", *_scores(names)
    return Table.of(columns, rows, _JOINT, foot)


def further_table(
    rows: Iterable[Mapping[str, Any]], found: tuple[str, str, Form], names: Names, foot: Iterable[str] = ()
) -> Table:
    """Return further responses at each condition: measured, beside what the surface or the simulation `found`."""
    columns = [*measured_of(names, True, [("measured", "Measured", short), found]), ERROR]
    of_stems = [] if names.naming.others else ["Travel and work of the blade from first touch to the maximum force."]
    return Table.of(columns, rows, f"Besides the {names.response.long}", (*of_stems, *foot, *_scores(names)))


def _scores(names: Names) -> list[str]:
    """Return what the values are that count from their measured mean."""
    text = (
        "Score: how far along a mode a curve is from the mean of the measured ones; its error is in % of the maximum "
        "force."
    )
    return [text] if any(named.apart for named in names.naming.responses) else []


_VALUES = "measured", "predicted", "simulated"
_INTERVALS = ("left_out_interval",)


def from_means(rows: Iterable[dict[str, Any]], names: Names) -> list[dict[str, Any]]:
    """Return rows of responses; of one that counts so, how far values are from the measured mean."""
    found = []
    for row in rows:
        if (named := names.naming.named(row["response"])).apart:
            values: dict[str, Any] = {
                key: named.counted(row[key], row["measured"]) for key in _VALUES if row.get(key) is not None
            }
            ends = {key: row[key] for key in _INTERVALS if row.get(key) is not None}
            values |= {key: [named.counted(end, row["measured"]) for end in pair] for key, pair in ends.items()}
            row = row | values | ({"sd": float(f"{row['sd']:.4g}")} if row.get("sd") else {})
        found.append(row)
    return found


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
        Column("value", "There", form=significant),
        *([Column("interval", "95 % range", form=interval, claims=True)] if known else []),
        Column("between", "Between", form=interval, of=lambda one: (one.low, one.high)),
    ]
    foot = [
        "Other parameters keep their calibrated values. The search ends at the first values within its tolerance; "
        "others may be as near."
    ]
    foot += ["95 % range: by the scatter of the measured mean, the other parameters fixed."] if known else []
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
        foot += [f"After a joint fit the target is what the study's own model gives: {names.quantity(stage.aim)}."]
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
        Column("valid", "Valid", of=lambda row: "yes" if row.valid else "no"),
    ]
    foot = (
        f"The mean force over the positions of the mesh is {found.aim:.4g} N (stem of {found.condition:g} mm); the "
        f"search ends at the first strain within {100.0 * TOLERANCE:g} %. 95 % range: by the scatter over the "
        "positions. Valid: the mean and its standard error are within 5 %."
    )
    return Table.of(columns, found.rows, "Failure strain over element size", [foot])
