"""The stages of a study, in order.

    screen        design rows → forces → effects                           screen.json
    climb         steps towards the target, if the spec asks for them      climb.json
    fit_surface   central composite rows → forces → regression, ANOVA      rsm.json
    invert        surface + target → parameters and how well known         invert.json
    refine        simulate at the solution, correct it, again              refine.json
    validate      every diameter → measured against simulated              validate.json

A stage reads the file of the one before and leaves its own, so each can be run alone and again. Runs come
from the records of the study folder where they are there; a stage that would be made of the same as before is read
(`stages.fresh`). Progress goes to `watch`, called with a `Progress`.
"""

from stemcal.executors.base import RunExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.overview.plan import plan
from stemcal.runs.answer import Progress, Watch, ignore
from stemcal.solvers.protocol import Solver
from stemcal.stages.climb import climb
from stemcal.stages.fresh import make_all
from stemcal.stages.invert.stage import invert
from stemcal.stages.refine.stage import refine
from stemcal.stages.result import read_result
from stemcal.stages.screen import screen
from stemcal.stages.surface.stage import fit_response_surface as fit_surface
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.validate.stage import validate
from stemcal.study.model import Study

__all__ = [
    "Progress",
    "calibrate",
    "climb",
    "fit_surface",
    "invert",
    "plan",
    "refine",
    "screen",
    "validate",
]


def calibrate(
    study: Study,
    folder: StudyFolder,
    executor: RunExecutor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> ValidateResult:
    """Take a study through all stages; returns the validation, the others lie in the folder."""
    with folder:
        make_all(study, folder, executor, watch, solver)
        return read_result(folder, ValidateResult)
