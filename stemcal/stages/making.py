"""A stage of the list run, or its result read: what it is made of is imported only then."""

from __future__ import annotations

from importlib import import_module

from stemcal.executors.base import RunExecutor
from stemcal.folder.store import StudyFolder
from stemcal.runs.answer import Progress, Watch
from stemcal.solvers.protocol import Solver
from stemcal.stages.base import Stage, stage_called, stages_of
from stemcal.stages.kept import any_kept, keep, kept
from stemcal.stages.result import StageResult
from stemcal.study.model import Study


def make(
    stage: Stage, study: Study, folder: StudyFolder, executor: RunExecutor, watch: Watch, solver: Solver | None = None
) -> StageResult:
    """Run a stage; its result then lies in the folder. Without a `solver` of one's own it is read where it is there
    already, made of the same.
    """
    with folder:
        if solver is None and (known := kept(kind_of(stage), study, folder)) is not None:
            return _told(known, watch)
        made: StageResult = getattr(import_module(stage.module), stage.function)(study, folder, executor, watch, solver)
        return keep(made, study, folder) if solver is None else made


def finished(study: Study, folder: StudyFolder, stage: str | None = None) -> bool:
    """Tell whether all stages of a study, or one, are there and made of what they would be made of now."""
    stages = stages_of(study) if stage is None else (stage_called(stage),)
    return any_kept(folder) and all(kept(kind_of(one), study, folder) is not None for one in stages)


def _told(result: StageResult, watch: Watch) -> StageResult:
    """Tell the watcher of a stage that is kept."""
    outcomes = [outcome for _, outcome in result.runs()]
    count, failed = len(outcomes), sum(not outcome.ok for outcome in outcomes)
    if outcomes:
        watch(Progress(result.name, count, count, count, failed, None))
    return result


def kind_of(stage: Stage) -> type[StageResult]:
    """Return the class of a stage's result."""
    kind: type[StageResult] = getattr(import_module(stage.module), stage.result)
    return kind


def read(stage: Stage, folder: StudyFolder) -> StageResult:
    """Return the result that lies in a folder; raise `UsageError` if it is not there or cannot be read."""
    return kind_of(stage).from_json(folder.read_stage(stage.name))
