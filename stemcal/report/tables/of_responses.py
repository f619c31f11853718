"""Tables of responses, measured beside predicted or simulated: of a joint fit, of the validation."""

from collections.abc import Iterable, Mapping
from typing import Any

from stemcal.files.rows import Column, Table
from stemcal.files.typed import to_json
from stemcal.names import Names
from stemcal.numbers import fixed, interval, short, significant
from stemcal.report.tables.columns import ERROR, Form, condition, measured_of, simulated
from stemcal.stages.invert.result import JointFitted
from stemcal.stages.validate.result import ValidateResult

_JOINT = "Fitted together"


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
        Column("role", "Role"),
        Column("measured", "Measured", unit, short),
        simulated(names.response, "Simulated", "simulated"),
        ERROR,
    ]
    largest, mean = fixed(stage.max_abs_error_percent), fixed(stage.mean_abs_error_percent)
    of = "over all responses" if names.naming.others else "absolute"
    worst = [f"Largest error {largest} %, mean {mean} % ({of})."] if names.placed else []
    title = f"Measured against simulated {names.response.long}"
    return Table.of(columns, stage.rows, title, (*worst, "Error = 100·(measured − simulated)/measured."))


def joint_table(joint: JointFitted, names: Names) -> Table:
    """Return what was measured beside the surfaces."""
    values = ("measured", "Measured", short), ("predicted", "Surface", significant)
    columns = measured_of(names, bool(names.naming.others), values)
    error, best = joint.max_abs_error_percent, joint.best_worst_error_percent
    left_out, rows = joint.max_abs_left_out_error_percent, from_means(map(to_json, joint.rows), names)
    columns.append(ERROR)
    better = f"no parameters in the region do better than {fixed(best)} %"
    if left_out is None:
        return Table.of(columns, rows, _JOINT, [f"Largest error {fixed(error)} %; {better}.", *_scores(names)])
    columns.append(Column("left_out_error_percent", "Left out", "%", fixed))
    tests = any(row.left_out_interval is not None for row in joint.rows)
    if tests:
        columns.append(Column("left_out_interval", "Others allow", form=interval, claims=True))
    largest = f"Largest error {fixed(error)} %, left out {fixed(left_out)} %; {better}."
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
