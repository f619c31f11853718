"""The sheet: a row for each run that is awaited, with empty cells for its results, as CSV and as a workbook."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from stemcal.by_hand.awaited import Row
from stemcal.naming import Named
from stemcal.study.model import Study

RUN, WHO, WHEN, REMARK = "run", "who", "when", "remark"
FAILED, WITHDRAWN = "failed", "withdrawn"
_ROUND = 1e-5  # of a factor's range: what a level on the sheet may differ from the one that is asked for

Kind = Literal["run", "factor", "condition", "response", "said"]


@dataclass(frozen=True)
class Field:
    """A column of the sheet: what it is called, its unit, what it holds; of a response for which replicate, from 1."""

    name: str
    unit: str
    kind: Kind
    label: str = ""
    replicate: int = 0
    decimals: int | None = None

    @property
    def title(self) -> str:
        """The heading without the unit."""
        return f"{self.name} {self.replicate}" if self.replicate else self.name

    @property
    def heading(self) -> str:
        """The heading.

        >>> Field("force", "N", "response", replicate=2).heading, Field("ratio", "1", "factor").heading
        ('force 2 (N)', 'ratio')
        """
        return f"{self.title} ({self.unit})" if self.unit not in ("", "1") else self.title


def fields_of(study: Study) -> list[Field]:
    """Return the columns of a study's sheet."""
    factors = [Field(f.name, f.unit, "factor", f.label, decimals=_decimals(f.high - f.low)) for f in study.factors]
    at = study.naming.condition
    conditions = [] if at is None else [Field(at.name, at.unit, "condition", at.label)]
    times = range(1, study.replicates + 1) if study.replicates > 1 else range(1)
    responses = [Field(r.name, r.unit, "response", r.label, n) for n in times for r in entered_responses(study)]
    said = [Field(name, "", "said") for name in (WHO, WHEN, REMARK)]
    return [Field(RUN, "", "run"), *factors, *conditions, *responses, *said]


def entered_responses(study: Study) -> tuple[Named, ...]:
    """Return the responses whose values are entered: of the shear test the force alone."""
    return study.naming.response, *study.naming.others


def _decimals(width: float) -> int:
    """Return the decimals by which a level is written to a hundred-thousandth of the factor's range.

    >>> _decimals(200.0), _decimals(0.04)
    (3, 7)
    """
    return max(0, -math.floor(math.log10(width * _ROUND)))


def cells(row: Row, fields: Sequence[Field]) -> list[str | float]:
    """Return the cells of a row, those to be filled in empty."""
    return [_cell(row, field) for field in fields]


def _cell(row: Row, field: Field) -> str | float:
    if field.kind == "factor":
        return round(row.levels[field.name], field.decimals)
    if field.kind == "condition":
        return row.condition
    return row.run if field.kind == "run" else ""


def sheet_text(study: Study, rows: Sequence[Row]) -> str:
    """Return the sheet as CSV, with the mark by which Excel knows UTF-8."""
    fields, text = fields_of(study), io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.heading for field in fields])
    writer.writerows([[plain(cell) for cell in cells(row, fields)] for row in rows])
    return "\ufeff" + text.getvalue()


def plain(cell: str | float) -> str:
    """Return a cell as a text has it."""
    return cell if isinstance(cell, str) else f"{cell:.15g}"
