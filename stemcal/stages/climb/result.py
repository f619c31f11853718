"""The result of the stage climb: all steps, and the coding of a design centred on the best one."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from stemcal.drawing.table import Table
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.stages.result import CodedScale, Head, StageResult
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, inline


@dataclass(frozen=True)
class ClimbRow(Spread):
    """One step: its levels, its error relative to the target, and the outcome of its run."""

    step: int
    levels: dict[str, float]
    coded: dict[str, float]
    error_percent: float | None
    outcome: Outcome = inline()


@dataclass(frozen=True, kw_only=True, repr=False)
class ClimbResult(StageResult):
    """The steps towards the target, the best step, and the coding of a design centred on it."""

    name: ClassVar[str] = "climb"
    shown = ("solution",)

    head: Head = inline()
    target: float
    condition: float
    names: tuple[str, ...]
    rows: Rows[ClimbRow]
    best_step: int
    passed: bool
    solution: dict[str, float]
    error_percent: float
    coding: dict[str, CodedScale]
    notes: tuple[Note, ...] = ()

    @property
    def recentred(self) -> dict[str, CodedScale]:
        return self.coding

    def _tables(self) -> dict[str, Table]:
        return {"climb": Table.of(("step", *self.names, "response", "error_percent", "status", "reason"), self.rows)}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        for number, row in enumerate(self.rows, 1):
            yield f"climb {number}", row.outcome
