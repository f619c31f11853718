"""A kind of solver from another package: a hollow stem in three-point bending by beam theory, ``solver: {kind: beam}``.

Its factors are the modulus and the yield stress, its responses the stiffness and the force of a plastic hinge.
Source: S. P. Timoshenko, Strength of Materials, parts I and II.
"""

from dataclasses import dataclass
from math import pi
from typing import Any, Literal

from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.study.model.study import Study
from stemcal.study.types.solver_kind import SolverKind, SolverOptions


class BeamOptions(SolverOptions):
    """The keys of the solver in a spec, lengths in mm."""

    kind: Literal["beam"] = "beam"
    span: float = 80.0
    """Distance between the supports, mm."""
    outer_diameter: float = 8.0
    """Outer diameter of the stem, mm."""
    diameter_ratio: float = 0.4
    """Diameter of the bore over the outer diameter."""


class Beam(SolverKind):
    """The entry point."""

    name, options = "beam", BeamOptions

    def make(self, study: Study) -> Solver:
        return BeamSolver(study.solver)


@dataclass(frozen=True)
class BeamSolver(Solver):
    """Answers from two formulas; it needs no worker process."""

    options: Any
    immediate = True

    def identity(self, request: Request) -> dict[str, Any]:
        return {"beam": self.options.model_dump(), "levels": dict(request.levels), "condition": request.condition}

    def solve(self, request: Request) -> Answer:
        span, ratio, radius = self.options.span, self.options.diameter_ratio, 0.5 * self.options.outer_diameter
        # k = 48 E I/L³, I = π (R⁴ − r⁴)/4
        stiffness = 12.0 * pi * request.levels["elastic_modulus"] * radius**4 * (1.0 - ratio**4) / span**3
        # F = 4 σ Z/L, Z = 4 (R³ − r³)/3
        hinge = 16.0 / 3.0 * request.levels["yield_stress"] * radius**3 * (1.0 - ratio**3) / span
        return Answer("ok", stiffness, details={RESPONSES: {"hinge_force": hinge}})
