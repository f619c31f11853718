"""The calibration as a stage: one measured force, or several measured means together."""

from dataclasses import replace

from stemcal.notes import Note
from stemcal.solvers.protocol import Belonging
from stemcal.stages.invert.joint import solve_jointly
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.invert.single import assess_published, solve
from stemcal.stages.result import Head
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import Work, a_stage

__all__ = ["InvertResult", "invert"]


class PriorUnused(Note):
    """Factors with a prior that the surface does not vary: they stay at mid-level."""

    factors: tuple[str, ...]


@a_stage(InvertResult)
def invert(work: Work, head: Head) -> InvertResult:
    """Solve the surface for the force measured at the calibration diameter, or several surfaces for theirs."""
    study, surface = work.study, work.result(SurfaceResult)
    solved = (solve_jointly if study.joint_targets else solve)(study, head, surface)
    published, on_published = assess_published(study, surface)
    belongs_to = work.solver.belongings(solved.condition) if isinstance(work.solver, Belonging) else None
    idle = tuple(one.name for one in study.factors if one.prior is not None and one.name not in surface.names)
    notes = (*solved.notes, *([PriorUnused(idle)] if idle else []), *on_published)
    return replace(solved, belongs_to=belongs_to, published=published, notes=notes)
