"""The solver kind `sheet` for manual runs, and its capabilities."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.by_hand.options import SheetSolver
from stemcal.solvers import rules
from stemcal.study.types.solver_kind import SolverKind

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model.study import Study


class SheetKind(SolverKind):
    """A run sheet in which people enter the results of manual runs."""

    name, options = "sheet", SheetSolver
    answers = "asks_people"
    replicates = "seed"
    rules = rules.OF_TEMPLATES

    def make(self, study: Study) -> Solver:
        from stemcal.by_hand.solver import Sheet

        return Sheet.of(study)
