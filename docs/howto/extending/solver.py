# ruff: noqa: D100, D101, I001
# fmt: off
from typing import Literal

from stemcal.solvers.protocol import RESPONSES, Answer, Solver
from stemcal.study.types.solver_kind import SolverKind, SolverOptions

class SpringOptions(SolverOptions):
    kind: Literal["spring"] = "spring"
    stiffness: float = 10.0

class Spring(SolverKind):
    name, options = "spring", SpringOptions

    def make(self, study):
        return SpringSolver(study.solver.stiffness)

class SpringSolver(Solver):
    def __init__(self, stiffness):
        self.stiffness = stiffness

    def identity(self, request):
        return {"stiffness": self.stiffness, "levels": dict(request.levels), "condition": request.condition}

    def solve(self, request):
        force = self.stiffness * request.levels["stretch"]
        return Answer("ok", force, details={RESPONSES: {"energy": 0.5 * force * request.levels["stretch"]}})
