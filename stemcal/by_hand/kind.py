"""The solver kind `sheet` for manual runs: the keys of its `solver` section in a spec, and its capabilities."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from stemcal.solvers import rules
from stemcal.solvers.options import MOST_FILES
from stemcal.study.types.field_types import SpecFile, Whole
from stemcal.study.types.solver_kind import SolverKind, SolverOptions

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model.study import Study


class SheetSolver(SolverOptions):
    """A run sheet: a CSV file with one row per run. A stage that needs results adds rows to the sheet and waits.

    The sheet is `sheet.csv` in the study folder. `stemcal run` reads the results from this
    sheet, and `stemcal enter` reads them from a copy.
    """

    kind: Literal["sheet"] = "sheet"
    """A run sheet in which results are entered by hand."""
    file: SpecFile | None = None
    """Run sheet (CSV or xlsx) that lists existing or planned runs, with columns for the run, the factors and the
    responses. The rows of a stage form the design of that stage. stemcal requests any missing results."""
    templates: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Input files that are written for each run; `{{factor}}` is replaced by the value of the factor."""
    replicates: Annotated[Whole, Field(ge=1, le=100)] | None = None
    """Number of repeats of each run, in random order, for experiments and stochastic programs. Every interval
    includes the scatter of the repeats. Without this key, runs with equal levels are performed only once."""


class SheetKind(SolverKind):
    """A run sheet in which people enter the results of manual runs."""

    name, options = "sheet", SheetSolver
    answers = "asks_people"
    replicates = "seed"
    rules = rules.OF_TEMPLATES

    def make(self, study: Study) -> Solver:
        from stemcal.by_hand.solver import Sheet

        return Sheet.of(study)
