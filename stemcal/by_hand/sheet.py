"""The sheet: a row for each run that is awaited, with empty cells for its results, as CSV and as a workbook."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from stemcal.by_hand.awaited import run_name
from stemcal.naming import Named
from stemcal.solvers.protocol import Request
from stemcal.study.model import Study

RUN, REPLICATE, WHO, WHEN, REMARK, STUDY = "run", "replicate", "who", "when", "remark", "study"
FAILED, WITHDRAWN = "failed", "withdrawn"
_ROUND = 1e-5  # of a factor's range: what a level on the sheet may differ from the one that is asked for

Kind = Literal["run", "factor", "condition", "replicate", "response", "said", "study"]
ASKED: tuple[Kind, ...] = ("factor", "condition", "replicate")


@dataclass(frozen=True)
class Field:
    """A column of the sheet: what it is called, its unit, what it holds; a `content` is the same in every row."""

    name: str
    unit: str
    kind: Kind
    label: str = ""
    decimals: int | None = None
    content: str = ""

    @property
    def heading(self) -> str:
        """The heading.

        >>> Field("force", "N", "response").heading, Field("ratio", "1", "factor").heading
        ('force (N)', 'ratio')
        """
        return f"{self.name} ({self.unit})" if self.unit not in ("", "1") else self.name


def fields_of(study: Study) -> list[Field]:
    """Return the columns of a study's sheet."""
    factors = [Field(f.name, f.unit, "factor", f.label, decimals=_decimals(f.high - f.low)) for f in study.factors]
    at = study.naming.condition
    conditions = [] if at is None else [Field(at.name, at.unit, "condition", at.label)]
    replicates = [Field(REPLICATE, "", "replicate")] if study.replicates > 1 else []
    responses = [Field(r.name, r.unit, "response", r.label) for r in entered_responses(study)]
    asked = [Field(RUN, "", "run"), *factors, *conditions, *replicates, *responses]
    said = [*(Field(name, "", "said") for name in (WHO, WHEN, REMARK)), Field(STUDY, "", "study", content=study.name)]
    own = {field.name.casefold() for field in asked}  # a factor may be called `study`
    return [*asked, *(field for field in said if field.name not in own)]


def entered_responses(study: Study) -> tuple[Named, ...]:
    """Return the responses whose values are entered: of the shear test the force alone."""
    return study.naming.response, *study.naming.others


def _decimals(width: float) -> int:
    """Return the decimals by which a level is written to a hundred-thousandth of the factor's range.

    >>> _decimals(200.0), _decimals(0.04)
    (3, 7)
    """
    return max(0, -math.floor(math.log10(width * _ROUND)))


def cells(run: Request, fields: Sequence[Field]) -> list[str | float]:
    """Return the cells of a run's row, those to be filled in empty."""
    return [_cell(run, field) for field in fields]


def _cell(run: Request, field: Field) -> str | float:
    if field.kind == "factor":
        return round(run.levels[field.name], field.decimals)
    told: dict[Kind, str | float] = {"run": run_name(run), "condition": run.condition, "replicate": run.replicate}
    return told.get(field.kind, field.content)


def sheet_text(study: Study, runs: Sequence[Request]) -> str:
    """Return the sheet as CSV, with the mark by which Excel knows UTF-8."""
    fields, text = fields_of(study), io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.heading for field in fields])
    writer.writerows([[plain(cell) for cell in cells(run, fields)] for run in runs])
    return "\ufeff" + text.getvalue()


def plain(cell: str | float) -> str:
    """Return a cell as a text has it."""
    return cell if isinstance(cell, str) else f"{cell:.15g}"
