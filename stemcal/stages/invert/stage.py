"""The calibration as a stage: one measured force, or several measured means together."""

from __future__ import annotations

from dataclasses import dataclass, replace

from stemcal.doe.regression.least_squares import Array
from stemcal.notes import Note, Weight
from stemcal.solvers.protocol import Belonging
from stemcal.stages.design import half_spaces
from stemcal.stages.invert.joint import solve_jointly
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.invert.single import assess_published, solve
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import Study

__all__ = ["InvertResult", "invert"]


@dataclass(frozen=True)
class ConstraintBroken(Note):
    """The solution breaks a constraint of the surface's design, where no run lies."""

    weight = Weight.NUMBERS


@a_stage
def invert(work: Work) -> InvertResult:
    """Solve the surface for the force measured at the calibration diameter, or several surfaces for theirs."""
    study, surface = work.study, work.fresh(SurfaceResult)
    solved = (solve_jointly if study.joint_targets else solve)(study, work.head("invert"), surface)
    published, on_published = assess_published(study, surface)
    belongs_to = work.solver.belongings(solved.condition) if isinstance(work.solver, Belonging) else None
    broken = _broken_constraints(study, surface, surface.scales.point(solved.point.coded))
    notes = (*solved.notes, *broken, *on_published)
    return replace(solved, belongs_to=belongs_to, published=published, notes=notes)


def _broken_constraints(study: Study, surface: SurfaceResult, point: Array) -> list[Note]:
    holds = all(bool(half.holds(point[None])[0]) for half in half_spaces(study, surface.scales))
    return [] if holds else [ConstraintBroken()]
