"""The last screen of a study: parameters and forces, so small that a terminal of 24 lines shows them whole."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from stemcal.report.tables.findings import response_sheets
from stemcal.report.tables.sheet import Sheet, borne
from stemcal.report.tables.stages import cited_ranges, validation_sheet
from stemcal.stages.results import Results
from stemcal.stages.validate import ValidateResult
from stemcal.text.numbers import short, significant, unit_written

if TYPE_CHECKING:
    from stemcal.study.model import Study

LINES = 24  # of a terminal, the last of them the prompt's
_AROUND = 9  # lines of the two tables beside their rows: titles, heads, rules, a foot, an empty line below each


def final_sheets(study: Study, results: Results, holds: bool, taken: int) -> list[Sheet]:
    """Return parameters and forces for what is left of a screen of which `taken` lines are used otherwise."""
    sheets = borne([_parameters(study, results)], holds) if results.inversion is not None else []
    if results.validation is not None:
        left = LINES - 1 - taken - _AROUND - sum(len(sheet.rows) for sheet in sheets)
        sheets.append(shortened(results.validation, left))
        sheets += response_sheets(results.validation) if results.validation.naming.others else []
    return sheets


def _parameters(study: Study, results: Results) -> Sheet:
    """Return each calibrated parameter with its unit and the range to cite."""
    found = results.inversion
    assert found is not None
    head, ranges = cited_ranges(found)
    values = results.parameters
    published = {} if found.published is None else found.published.point.solution
    rows = tuple(
        (
            name,
            significant(values[name]),
            unit_written(study.factor(name).unit),
            ranges[name],
            *([short(published.get(name))] if published else []),
        )
        for name in found.point.solution
    )
    columns = ("Parameter", "Calibrated", "Unit", head, *(["Published"] if published else []))
    return Sheet("Calibrated parameters", columns, rows, claiming=(head,))


def shortened(validation: ValidateResult, most: int) -> Sheet:
    """Return measured against simulated force in so many rows at most: those fitted, and the largest errors."""
    sheet = validation_sheet(validation)
    sheet = replace(sheet, foot=sheet.foot[:1])
    most = max(most, 3)
    if len(sheet.rows) <= most:
        return sheet
    ranked = sorted(
        range(len(sheet.rows)),
        key=lambda i: (validation.compared[i].role != "calibration", -abs(validation.compared[i].error_percent or 1e9)),
    )
    kept = sorted(ranked[: most - 1])
    left = f"{validation.naming.counted(len(sheet.rows) - len(kept), 'other ')} of smaller error in the report"
    return replace(sheet, rows=tuple(sheet.rows[i] for i in kept), foot=(*sheet.foot, f"{left}."))
