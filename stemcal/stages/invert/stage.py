"""The calibration as a stage: one measured force, or several measured means together."""

from __future__ import annotations

from dataclasses import replace

from stemcal.doe.regression.least_squares import Array
from stemcal.remarks import Remark, Weight
from stemcal.solvers.protocol import Belonging
from stemcal.stages.design import half_spaces
from stemcal.stages.invert.joint import solve_jointly
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.invert.single import assess_published, solve
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import Study

__all__ = ["InvertResult", "invert"]

_BEYOND = Remark(
    Weight.NUMBERS,
    "The solution breaks a constraint of `rsm.constraints`, where no run lies: the surface extrapolates there.",
)


@a_stage
def invert(work: Work) -> InvertResult:
    """Solve the surface for the force measured at the calibration diameter, or several surfaces for theirs."""
    study, surface = work.study, work.fresh(SurfaceResult)
    solved = (solve_jointly if study.joint_targets else solve)(study, work.head("invert"), surface)
    published, remarks = assess_published(study, surface)
    belongs_to = work.solver.belongings(solved.condition) if isinstance(work.solver, Belonging) else None
    notes = (*solved.notes, *_beyond(study, surface, surface.scales.point(solved.point.coded)), *remarks)
    return replace(solved, belongs_to=belongs_to, published=published, notes=notes)


def _beyond(study: Study, surface: SurfaceResult, point: Array) -> list[str]:
    """Say that a solution breaks a constraint of the surface's design: no run lies there."""
    if all(bool(half.holds(point[None])[0]) for half in half_spaces(study, surface.scales)):
        return []
    return [_BEYOND()]
