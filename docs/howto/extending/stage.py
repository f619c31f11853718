# ruff: noqa: D100, D101, D103, I001
# fmt: off
from dataclasses import dataclass

from stemcal.drawing.table import Column, Table
from stemcal.storage.typed import inline
from stemcal.notes import Note
from stemcal.formats import fixed
from stemcal.drawing.showing import Showing
from stemcal.solvers.protocol import Request
from stemcal.stages.result import Head, StageResult
from stemcal.stages.stage import Stage
from stemcal.stages.work import a_stage
from stemcal.study.types.field_types import Frozen

class MiddleOptions(Frozen):
    condition: float = 8.0

@dataclass(frozen=True, kw_only=True, repr=False)
class MiddleResult(StageResult):
    name = "middle"
    head: Head = inline()
    force: float | None
    notes: tuple[Note, ...] = ()
    def _tables(self):
        return {"middle": Table((Column("force"),), ((self.force,),))}

@a_stage(MiddleResult)
def make(work, head):
    at, levels = work.study.of(MiddleOptions).condition, work.study.midlevels()
    (outcome,) = work.outcomes([Request("middle", 0, levels, at)])
    return MiddleResult(head=head, force=outcome.response)

class MiddleShowing(Showing):
    def tables(self, result, names):
        column = Column("force", "Maximum force", "N", fixed)
        return [Table((column,), ((result.force,),), "Force in the middle of the ranges")]

class Middle(Stage):
    name, title, help = "middle", "Middle", "Simulate the middle of the ranges."
    def section(self):
        return MiddleOptions
    def result(self):
        return MiddleResult
    def making(self):
        return make
    def showing(self):
        return MiddleShowing()
