"""A study taken through all of its stages, or through one of them whether it is fresh or not."""

from typing import Any

from stemcal.folder.study_folder import StudyFolder
from stemcal.runs.answer import Watch, ignore
from stemcal.stages.fresh import make_all
from stemcal.stages.result import read_result
from stemcal.stages.stage import stage_called
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model import Study


def calibrate(study: Study, folder: StudyFolder, executor: Any, watch: Watch = ignore, solver: Any = None) -> Any:
    """Return the validation; the results before it lie in the folder."""
    make_all(study, folder, executor, watch, solver)
    return read_result(folder, ValidateResult)


def run_stage(name: str, study: Study, folder: StudyFolder, *how: Any, **more: Any) -> Any:
    """Return the result of one stage, which then also lies in the folder."""
    return stage_called(name).making()(study, folder, *how, **more)
