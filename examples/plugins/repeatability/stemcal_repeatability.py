"""A stage from another package, ``repeatability: {positions: 3}`` in a spec: the scatter over positions of the mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from statistics import mean, stdev
from typing import Annotated, ClassVar

from pydantic import Field

from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import Setting, Showing
from stemcal.drawing.style import BLUE, Figure, new_figure
from stemcal.drawing.table import Column, Table
from stemcal.errors import RunsFailed
from stemcal.formats import significant
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.solvers import make_solver
from stemcal.stages.result import Head, StageResult
from stemcal.stages.stage import Stage
from stemcal.stages.work import Work, a_stage
from stemcal.storage.typed import inline
from stemcal.study.model.study import Study
from stemcal.study.types.field_types import Frozen
from stemcal.vocabulary import Wording


class RepeatOptions(Frozen):
    """The section of the spec."""

    positions: Annotated[int, Field(ge=2, le=20)] = 3
    """The number of positions of the mesh."""


@dataclass(frozen=True, kw_only=True, repr=False)
class RepeatResult(StageResult):
    """The force at each position of the mesh, and their coefficient of variation."""

    name: ClassVar[str] = "repeatability"
    head: Head = inline()
    outcome: Outcome = inline()
    cv_percent: float
    notes: tuple[Note, ...] = ()

    @property
    def forces(self) -> tuple[float, ...]:
        """The force at each position, N."""
        return self.outcome.replicates.values if self.outcome.replicates else ()

    def _tables(self) -> dict[str, Table]:
        return {self.name: Table((Column("position"), Column("force")), tuple(enumerate(self.forces, 1)))}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield the one point, which has a run for each position."""
        yield "repeatability 1", self.outcome


@a_stage(RepeatResult)
def repeat(work: Work, head: Head) -> RepeatResult:
    """Simulate the middle of the ranges at every position."""
    study = Repeatability().seen(work.study)
    there = replace(work, study=study, solver=make_solver(study))
    (outcome,) = there.simulating("repeatability")(0, [study.midlevels()], [study.targets.calibrate_at])
    if len(forces := outcome.replicates.values if outcome.replicates else ()) < 2:
        raise RunsFailed(f"repeatability: {outcome.message}")
    cv = 100.0 * stdev(forces) / mean(forces)
    note = Note("repeatability", "info", f"Over {len(forces)} positions of the mesh the force scatters by {cv:.2f} %.")
    return RepeatResult(head=head, outcome=outcome, cv_percent=cv, notes=(note,))


class RepeatShowing(Showing[RepeatResult]):
    """A sentence, a table and a figure."""

    def outcome(self, result: RepeatResult, names: Wording) -> list[str]:
        return [note.text for note in result.notes]

    def tables(self, result: RepeatResult, names: Wording) -> list[Table]:
        columns = (Column("position", "Position", form=format), Column("force", "Maximum force", "N", significant))
        return [Table(columns, tuple(enumerate(result.forces, 1)), "Force over positions of the mesh")]

    def figures(self, result: RepeatResult, setting: Setting) -> list[Plot]:
        return [Plot("repeatability", result.name, "Force at each position of the mesh.", partial(draw, result))]


def draw(result: RepeatResult) -> Figure:
    """Draw the force at each position."""
    with new_figure(height=2.2) as figure:
        axes = figure.add_subplot()
        axes.plot(range(1, len(result.forces) + 1), result.forces, "o", color=BLUE)
        axes.set_xlabel("Position of the mesh")
        axes.set_ylabel("Maximum force, N")
    return figure


class Repeatability(Stage[RepeatResult]):
    """The scatter of the force over positions of the mesh."""

    name, title, by_section = "repeatability", "Repeatability", True
    help = "Simulate the middle of the ranges at several positions of the mesh."

    def seen(self, study: Study) -> Study:
        solver = study.solver.model_copy(update={"replicates": study.of(RepeatOptions).positions})
        return study.model_copy(update={"solver": solver})

    def section(self) -> type[Frozen]:
        return RepeatOptions

    def result(self) -> type[RepeatResult]:
        return RepeatResult

    def making(self) -> Callable[..., RepeatResult]:
        return repeat

    def showing(self) -> object:
        return RepeatShowing()
