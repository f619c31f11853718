"""Tables of responses, measured beside predicted or simulated: of a joint fit, of the validation."""

from collections.abc import Iterable, Mapping
from typing import Any

from stemcal.files.rows import Column, Table
from stemcal.files.typed import to_json
from stemcal.numbers import fixed, interval, short, significant
from stemcal.report.tables.columns import ERROR, Form, condition, measured_of, simulated
from stemcal.stages.invert.result import JointFitted
from stemcal.stages.validate.result import ValidateResult
from stemcal.text.names import Names
from stemcal.text.tables import line


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
    errors = {"largest": stage.max_abs_error_percent, "mean": stage.mean_abs_error_percent}
    largest = line("largest of all" if names.naming.others else "largest", **errors)
    worst = [largest] if names.naming.condition is not None else []
    return Table.of(columns, stage.rows, line("validation", names), (*worst, line("error")))


def joint_table(joint: JointFitted, names: Names) -> Table:
    """Return what was measured beside the surfaces."""
    values = ("measured", "Measured", short), ("predicted", "Surface", significant)
    columns = measured_of(names, bool(names.naming.others), values)
    error, left_out = joint.max_abs_error_percent, joint.max_abs_left_out_error_percent
    rows = from_means(map(to_json, joint.rows), names)
    columns.append(ERROR)
    if left_out is None:
        return Table.of(columns, rows, line("joint"), [line("fitted errors", error=error), *_scores(names)])
    columns.append(Column("left_out_error_percent", "Left out", "%", fixed))
    tests = any(row.left_out_interval is not None for row in joint.rows)
    if tests:
        columns.append(Column("left_out_interval", "Others allow", form=interval, claims=True))
    largest = line("joint errors", error=error, left_out=left_out)
    foot = largest, line("test left out" if tests else "left out"), *_scores(names)
    return Table.of(columns, rows, line("joint"), foot)


def further_table(
    rows: Iterable[Mapping[str, Any]], found: tuple[str, str, Form], names: Names, foot: Iterable[str] = ()
) -> Table:
    """Return further responses at each condition: measured, beside what the surface or the simulation `found`."""
    columns = [*measured_of(names, True, [("measured", "Measured", short), found]), ERROR]
    of_stems = [] if names.naming.others else [line("of stems")]
    return Table.of(columns, rows, line("further", names), (*of_stems, *foot, *_scores(names)))


def _scores(names: Names) -> list[str]:
    """Say what values are that are told from their measured mean."""
    return [line("scores")] if any(named.apart for named in names.naming.responses) else []


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
