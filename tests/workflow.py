"""A study taken through its stages, or through one of them."""

from typing import Any

from stemcal.runs.answer import Watch, watch_nothing
from stemcal.runs.executors import RunExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Solver
from stemcal.stages.fresh import make_all
from stemcal.stages.result import read_result
from stemcal.stages.stage import stage_called, stages_of
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.work import HERE
from stemcal.study.model.study import Study


def calibrate(
    study: Study, folder: StudyFolder, executor: RunExecutor, watch: Watch = watch_nothing, solver: Solver | None = None
) -> ValidateResult:
    """Take a study through all stages; return the validation."""
    if solver is None:
        make_all(study, folder, executor, watch)
    for stage in stages_of(study) if solver is not None else ():
        stage.making()(study, folder, executor, watch, solver)
    return read_result(folder, ValidateResult)


def run_stage(
    name: str,
    study: Study,
    folder: StudyFolder,
    executor: RunExecutor = HERE,
    watch: Watch = watch_nothing,
    solver: Solver | None = None,
) -> Any:
    """Run one stage whether it is fresh or not; return its result."""
    return stage_called(name).making()(study, folder, executor, watch, solver)
