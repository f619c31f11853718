"""Tables of responses, measured beside simulated or predicted: the validation, its tests, further responses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from stemcal.files.rows import Column, Table
from stemcal.naming import Named
from stemcal.report.tables.columns import ERROR, condition, with_unit
from stemcal.stages.invert.result import JointRow
from stemcal.stages.validate import FurtherRow, ValidateResult
from stemcal.text.names import Names
from stemcal.text.numbers import interval, probability, short, significant
from stemcal.text.tables import failed, line

Further = Iterable[tuple[float, JointRow | FurtherRow]]
"""Rows of further responses, each with its condition."""


def validation_tables(stage: ValidateResult, names: Names) -> list[Table]:
    """Return measured against simulated, further responses, and what the measured scatter tells of both."""
    further = [(row.compared.condition, each) for row in stage.rows for each in row.further]
    tables = [validation_table(stage, names)]
    if further:
        tables.append(further_responses(further, "simulated", names, _mesh_intervals(further, names)))
        tables += _tests([(each.response, place, each) for place, each in further], names)
    tables += [_corrected_table(stage, names)] if stage.discrepancy is not None else []
    return [*tables, *_tests([(None, row.condition, row) for row in stage.compared], names)]


def validation_table(stage: ValidateResult, names: Names) -> Table:
    """Return measured against simulated response over the conditions."""
    unit, meshed = names.response.written, any(row.mesh_interval is not None for row in stage.rows)
    columns = [
        *condition(names.naming),
        Column("role", "Role"),
        Column("measured", "Measured", unit, short),
        Column("simulated", "Simulated", unit, significant, simulated),
        ERROR,
        *([Column("mesh_interval", "95 % over meshes", unit, interval, claims=True)] if meshed else []),
    ]
    errors = {"largest": stage.max_abs_error_percent, "mean": stage.mean_abs_error_percent}
    worst = [line("largest", **errors)] if names.naming.condition is not None else []
    return Table.of(columns, stage.rows, line("validation", names), (*worst, line("error")))


def simulated(row: Any) -> float | str:
    """Return what the run of a comparison gave, or why it gave nothing."""
    value: float | None = row.compared.simulated
    return failed(row.reason) if value is None else value


def further_responses(rows: Further, found: str, names: Names, foot: Iterable[str] = ()) -> Table:
    """Return further responses at each condition: measured beside those that the surface or the simulation `found`."""
    naming = names.naming

    def value(key: str, form: Any) -> Column:
        def of(row: Any) -> str:
            return with_unit(getattr(row[1], key), naming.named(row[1].response), form)

        return Column(key, key.capitalize(), "", form, of)

    columns = [
        Column("response", "Response", of=lambda row: naming.named(row[1].response).noun),
        *condition(naming, lambda row: row[0]),
        value("measured", short),
        value(found, significant),
        replace(ERROR, of=lambda row: row[1].error_percent),
    ]
    return Table.of(columns, rows, line("further", names), (*([] if naming.others else [line("of stems")]), *foot))


def _mesh_intervals(rows: Iterable[tuple[float, FurtherRow]], names: Names) -> Iterator[str]:
    """Yield within which interval each further response lies with the mesh at another place."""
    for place, row in rows:
        if row.mesh_interval is not None:
            led = Names(names.naming.led_by(row.response))
            yield line("other place", led, at=place, range=row.mesh_interval)


def _tests(rows: list[tuple[str | None, float, Any]], names: Names) -> list[Table]:
    """Return the tests against the measured scatter, a response in each row or none; nothing without any test."""
    if all(row.p_different is None for _, _, row in rows):
        return []
    further = rows[0][0] is not None

    def numbers(label: str, form: Any, of: Any, named: Named | None = names.response) -> Column:
        unit = "" if further or named is None else named.written
        return Column(label, label, unit, form, lambda row: of(row[2]))

    columns = [
        *([Column("response", "Response", of=lambda row: names.naming.named(row[0]).heading())] if further else []),
        *condition(names.naming, lambda row: row[1]),
        numbers("Measured ± SD (n)", str, lambda row: with_scatter(row.measured, row.sd, row.n)),
        numbers("95 % of the mean", interval, _of_the_mean),
        numbers("Simulated", significant, lambda row: row.simulated),
        numbers("p different", probability, lambda row: row.p_different, None),
        numbers("p equal", probability, lambda row: row.p_equivalent, None),
    ]
    foot = () if further else (line("tests"),)
    return [Table.of(columns, rows, line("tested further" if further else "tested", names), foot, claims=True)]


def _of_the_mean(row: Any) -> tuple[float, float] | None:
    return None if row.measured_low is None or row.measured_high is None else (row.measured_low, row.measured_high)


def with_scatter(mean: float, sd: float | None, n: int | None) -> str:
    """Return a measured mean with its standard deviation and number of specimens, as far as they are known.

    >>> with_scatter(745.0, 6.0, 5), with_scatter(745.0, 6.0, None), with_scatter(745.0, None, 5)
    ('745 ± 6 (5)', '745 ± 6', '745')
    """
    told = short(mean) if sd is None else f"{short(mean)} ± {short(sd)}"
    return f"{told} ({n})" if sd is not None and n is not None else told


def _corrected_table(stage: ValidateResult, names: Names) -> Table:
    """Return what one scale for what the model misses predicts."""
    unit, rows = names.response.written, [row for row in stage.rows if row.corrected is not None]
    columns = [
        *condition(names.naming),
        Column("measured", "Measured", unit, short),
        Column("predicted", "Predicted", unit, significant, lambda row: row.corrected.response),
        Column("interval", "95 %", unit, interval, lambda row: row.corrected.interval),
    ]
    return Table.of(columns, rows, line("corrected"), [line("scaled")], claims=True)
