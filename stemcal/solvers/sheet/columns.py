"""The columns of a sheet, and its text: a row for each run, with empty cells for results that are missing."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from stemcal.naming import Named
from stemcal.solvers.protocol import Request
from stemcal.study.model import Study

RUN, REPLICATE, WHO, WHEN, REMARK, STUDY = "run", "replicate", "who", "when", "remark", "study"
FAILED = "failed"
_ROUND = 1e-5  # of a factor's range: what a level on the sheet may differ from the one that is asked for

Kind = Literal["run", "factor", "condition", "replicate", "response", "said", "study"]
ASKED: tuple[Kind, ...] = ("factor", "condition", "replicate")
SheetRow = tuple[Request, Mapping[str, str | float]]  # a run, and what is known of it by the names of columns


@dataclass(frozen=True)
class Field:
    """A column of the sheet: its name, unit and kind; a `content` is the same in every row."""

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

    def asked(self, run: Request) -> str | float:
        """Return what the cell of a run asks for; empty in columns for results."""
        if self.kind == "factor":
            return run.levels[self.name]
        cells: dict[Kind, str | float] = {"run": run_name(run), "condition": run.condition, "replicate": run.replicate}
        return cells.get(self.kind, self.content)

    def text(self, cell: str | float) -> str:
        """Return a cell as the sheet has it."""
        if isinstance(cell, str):
            return cell
        return f"{cell if self.decimals is None else round(cell, self.decimals):.15g}"


def run_name(request: Request) -> str:
    """Return the name of a run in a sheet.

    >>> run_name(Request("screen", 2, {}, 8.0))
    'screen 3'
    """
    return f"{request.stage} {request.row + 1}"


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


def sheet_text(study: Study, rows: Sequence[SheetRow]) -> str:
    """Return the sheet as CSV, with the mark by which Excel recognises UTF-8."""
    fields, text = fields_of(study), io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.heading for field in fields])
    for run, known in rows:
        writer.writerow([field.text(known.get(field.name, field.asked(run))) for field in fields])
    return "\ufeff" + text.getvalue()
