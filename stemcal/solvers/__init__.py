"""What answers "these levels, this diameter, which force?"."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.study.types.solver_kind import kind_of

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model.study import Study


def make_solver(study: Study) -> Solver:
    """Return the solver that the spec names."""
    solver: Solver = kind_of(study.solver).make(study)
    return solver
