"""The result of the stage validate: measured and simulated responses at every condition."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from stemcal.doe.comparison import Exponent, Formula, ValidationRow, error_percent
from stemcal.drawing.table import Table
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.stages.fitting import Measured
from stemcal.stages.result import Head, Judged, Prediction, StageResult
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, absent, inline
from stemcal.study.model.study import Study
from stemcal.vocabulary import Wording

_MEANS = ("condition", "measured", "simulated", "error_percent", "role", "left_out_percent")
_COLUMNS = (*_MEANS, "status", "reason", "sd", "n")


@dataclass(frozen=True)
class FurtherRow:
    """A further response, such as travel or work: measured mean and simulation."""

    response: str
    unit: str
    measured: float
    sd: float | None
    simulated: float
    error_percent: float | None
    n: int | None = absent()
    judged: bool = absent(False)

    @classmethod
    def of(cls, mean: Measured, simulated: float) -> FurtherRow:
        """Return the comparison of a mean and a simulated value; `judged` for responses that the spec declares."""
        named, error = mean.named, error_percent(mean.value, simulated)
        return cls(named.name, named.unit, mean.value, mean.sd, simulated, error, mean.n, mean.leads)


@dataclass(frozen=True, kw_only=True)
class ValidateRow(Spread):
    """One condition: the comparison of the first response and further ones, and the outcome of the run."""

    compared: ValidationRow = inline()
    outcome: Outcome = inline()
    further: Rows[FurtherRow] = absent(Rows())

    @property
    def errors_percent(self) -> list[float]:
        """Errors of the first response and of further responses that count in the verdict."""
        judged = [row.error_percent for row in self.further if row.judged]
        return [error for error in (self.compared.error_percent, *judged) if error is not None]


@dataclass(frozen=True, kw_only=True, repr=False)
class ValidateResult(StageResult):
    """Measured and simulated responses at all conditions, and exponents of the growth of a force with the diameter."""

    name: ClassVar[str] = "validate"
    shown = ("worst_percent",)

    head: Head = inline()
    parameters: dict[str, float]
    rows: Rows[ValidateRow]
    tolerance_percent: float = 10.0
    worst_percent: float | None
    mean_abs_error_percent: float | None
    worst_held_out_percent: float | None = None
    error_slope_percent_per_unit: float | None = None
    measured_exponent: Exponent | None = None
    simulated_exponent: Exponent | None = None
    formula: Formula | None = None
    notes: tuple[Note, ...] = ()

    @property
    def compared(self) -> list[ValidationRow]:
        """Comparisons of the measured with the simulated first response, at all conditions."""
        return [row.compared for row in self.rows]

    @property
    def fitted(self) -> tuple[float, ...]:
        """Conditions at which the parameters were fitted."""
        return tuple(row.condition for row in self.compared if row.role == "fitted")

    @property
    def held_out(self) -> list[ValidationRow]:
        """Comparisons at held-out conditions whose run did not fail."""
        return [row for row in self.compared if row.role == "held_out" and row.error_percent is not None]

    @property
    def prediction(self) -> Prediction | None:
        """Largest error at the held-out conditions, and the error of a formula through the fitted forces."""
        if self.worst_held_out_percent is None or self.naming.condition is None or self.is_from_table:
            return None
        return Prediction(self.worst_held_out_percent, self.formula, tuple(row.condition for row in self.held_out))

    @property
    def is_from_table(self) -> bool:
        """Whether the simulated values are from a table, so perhaps from other parameter values."""
        return any(note.kind == "from_table" for note in self.notes)

    def judged(self, study: Study) -> list[Judged]:
        """Return the errors of all responses, `fitted` or not; none if the simulated values are from a table."""
        judged, first = [], study.naming.response.name
        for row in self.rows if not self.is_from_table else ():
            at, fitted = row.compared, row.compared.role == "fitted"
            judged.append(Judged(first, at.condition, at.error_percent, fitted, row.outcome.key))
            for further in (each for each in row.further if each.judged):
                own = fitted and further.response in study.fitted_responses
                judged.append(Judged(further.response, at.condition, further.error_percent, own, row.outcome.key))
        return judged

    def _tables(self) -> dict[str, Table]:
        further = [{"condition": row.compared.condition, **vars(each)} for row in self.rows for each in row.further]
        tables = {"validate": Table.of(_COLUMNS, self.rows)}
        keys = ("condition", "response", "measured", "simulated", "error_percent")
        return tables | ({"validate_responses": Table.of(keys, further)} if further else {})

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        names = Wording(self.naming)
        for number, row in enumerate(self.rows, 1):
            place = names.conditions([row.compared.condition]) if names.has_condition else f"{self.name} {number}"
            yield place, row.outcome
