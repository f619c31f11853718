"""The results of the finished stages of a study."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from stemcal.errors import UsageError
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.stages.fresh import fresh, require_fresh
from stemcal.stages.result import R, StageResult, read_result
from stemcal.stages.stage import Stage, stages_known
from stemcal.study.model.study import Study


@dataclass(frozen=True)
class Results:
    """Results of the finished stages (`done`), in order, and the reasons why others are not used (`stale`)."""

    done: tuple[StageResult, ...] = ()
    stale: tuple[str, ...] = ()

    def of(self, kind: type[R]) -> R | None:
        """Return the result of a stage by its class; None if the stage is not finished."""
        return next((result for result in self.done if isinstance(result, kind)), None)

    @property
    def calibrated(self) -> bool:
        """Whether a finished stage has calibrated the parameters."""
        return any(result.settles is not None for result in self.done)

    @property
    def parameters(self) -> dict[str, float]:
        """Calibrated parameter values of the study's own solver, in spec units; `UsageError` if there are none."""
        levels = [settled for result in self.done if (settled := result.settles) is not None]
        if not levels:
            raise UsageError("The study is not calibrated yet. Run `stemcal run SPEC` first.")
        return dict(levels[-1])


def fresh_results(study: Study, folder: StudyFolder, known_fresh: Sequence[StageResult] = ()) -> Results:
    """Return the fresh results, and the reasons why others are not used; stages in `known_fresh` are not checked."""
    known = {result.name: result for result in known_fresh}
    reasons: list[str] = []
    solver = functools.cache(lambda: make_solver(study))  # created only if needed

    def read(stage: Stage[Any]) -> StageResult | None:
        if not folder.has_stage(stage.name):
            return None
        if (result := known.get(stage.name) or fresh(stage.result(), study, folder)) is not None:
            return result
        try:
            require_fresh(study, solver(), folder, stage.name)
            current: StageResult = read_result(folder, stage.result())
            return current
        except UsageError as error:
            if stage.by_section or stage.asked_for(study):  # otherwise the file is from an earlier spec
                reasons.append(str(error))
            return None

    results = map(read, stages_known(study))
    return Results(tuple(result for result in results if result is not None), tuple(dict.fromkeys(reasons)))
