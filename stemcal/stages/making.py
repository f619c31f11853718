"""A stage of the list run, or its result read: what it is made of is imported only then."""

from __future__ import annotations

from importlib import import_module

from stemcal.executors.base import RunExecutor
from stemcal.folder.store import StudyFolder
from stemcal.runs.answer import Watch
from stemcal.solvers.protocol import Solver
from stemcal.stages.base import Stage
from stemcal.stages.result import StageResult
from stemcal.study.model import Study


def make(
    stage: Stage, study: Study, folder: StudyFolder, executor: RunExecutor, watch: Watch, solver: Solver | None = None
) -> StageResult:
    """Run a stage; returns its result, which then also lies in the folder."""
    made: StageResult = getattr(import_module(stage.module), stage.function)(study, folder, executor, watch, solver)
    return made


def kind_of(stage: Stage) -> type[StageResult]:
    """Return the class of a stage's result."""
    kind: type[StageResult] = getattr(import_module(stage.module), stage.result)
    return kind


def read(stage: Stage, folder: StudyFolder) -> StageResult:
    """Return the result that lies in a folder; raise `UsageError` if it is not there or cannot be read."""
    return kind_of(stage).from_json(folder.read_stage(stage.name))
