"""The last screen of a study: parameters and forces, no longer than the terminal that shows them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from stemcal.files.rows import Column, Table
from stemcal.report.tables.of_parameters import calibration_table
from stemcal.report.tables.of_responses import validation_tables
from stemcal.report.tables.stages import visible
from stemcal.stages.results import Results
from stemcal.stages.validate import ValidateResult
from stemcal.text.names import Names
from stemcal.text.numbers import unit_written
from stemcal.text.tables import line

if TYPE_CHECKING:
    from stemcal.study.model import Study

_AROUND = 9  # lines of the two tables beside their rows: titles, heads, rules, a foot, an empty line below each


def final_tables(study: Study, results: Results, holds: bool, left: int | None) -> list[Table]:
    """Return parameters and forces for `left` lines of a screen, all of them where it has no end."""
    tables = visible([_parameters(study, results)], holds) if results.inversion is not None else []
    if results.validation is not None:
        first, *others = validation_tables(results.validation, Names(study.naming))
        most = len(first.rows) if left is None else left - _AROUND - sum(len(table.rows) for table in tables)
        tables.append(shortened(first, results.validation, most))
        tables += others if study.naming.others else []
    return tables


def _parameters(study: Study, results: Results) -> Table:
    """Return each calibrated parameter with its unit and the range to cite."""
    assert results.inversion is not None
    table = calibration_table(results.inversion, Names(study.naming), results.parameters)
    name, value, *others = table.columns
    unit = Column("unit", "Unit", form=unit_written, words=True)
    rows = tuple((*row[:2], study.factor(row[0]).unit, *row[2:]) for row in table.rows)
    whole = replace(
        table, columns=(replace(name, label="Parameter"), value, unit, *others), rows=rows, foot=(), claimed=()
    )
    return whole.only(column.key for column in whole.columns if column.key not in ("share", "coded"))


def shortened(table: Table, validation: ValidateResult, most: int) -> Table:
    """Return measured against simulated in so many rows at most: those fitted, and the largest errors."""
    table, most = replace(table, foot=table.foot[:1]), max(most, 3)
    if len(table.rows) <= most:
        return table
    ranked = sorted(
        range(len(table.rows)),
        key=lambda i: (validation.compared[i].role != "calibration", -abs(validation.compared[i].error_percent or 1e9)),
    )
    kept = sorted(ranked[: most - 1])
    rows = tuple(table.rows[i] for i in kept)
    return replace(table, rows=rows, foot=(*table.foot, line("smaller", count=len(table.rows) - len(kept))))
