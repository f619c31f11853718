"""The calibration as a stage: one measured force, or several measured means together."""

from __future__ import annotations

from dataclasses import replace

from stemcal.executors.base import RunExecutor
from stemcal.folder.store import StudyFolder
from stemcal.runs.answer import Watch, ignore
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Solver
from stemcal.stages.invert.joint import solve_jointly
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.invert.single import assess_published, solve
from stemcal.stages.result import head_of, leave, read_fresh
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.model import Study

__all__ = ["InvertResult", "invert"]


def invert(
    study: Study,
    folder: StudyFolder,
    _executor: RunExecutor | None = None,
    _watch: Watch = ignore,
    solver: Solver | None = None,
) -> InvertResult:
    """Solve the surface for the force measured at the calibration diameter, or several surfaces for theirs."""
    solver = solver or make_solver(study)
    with folder:
        surface = read_fresh(study, solver, folder, SurfaceResult)
        head = head_of(study, solver, folder, "invert")
        result = solve_jointly(study, head, surface) if study.joint_targets else solve(study, head, surface)
        published, remarks = assess_published(study, surface)
        return leave(folder, replace(result, published=published, notes=(*result.notes, *remarks)))
