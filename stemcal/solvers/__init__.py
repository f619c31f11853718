"""The solvers: each returns the response at given factor levels and a given diameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.study.types.solver_kind import kind_of

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model.study import Study


def make_solver(study: Study) -> Solver:
    """Return the solver of a study, as specified in the `solver` section of its spec."""
    solver: Solver = kind_of(study.solver).make(study)
    return solver
