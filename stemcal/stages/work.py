"""The working context of a stage, and the decorator of the function that computes its result."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import wraps

from stemcal.errors import UsageError
from stemcal.runs.answer import QUORUM, Watch, answer_all, watch_nothing
from stemcal.runs.executors import InlineExecutor, RunExecutor
from stemcal.runs.record import Outcome, merged
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.solvers.replicates import repeated
from stemcal.stages.fresh import head_of, require_fresh
from stemcal.stages.result import Head, R, read_result, write_result
from stemcal.stages.stage import has_surface, stage_called, stages_of
from stemcal.study.model.study import Study

HERE = InlineExecutor()

SimulateAt = Callable[[int, Sequence[Mapping[str, float]], Sequence[float]], list[Outcome]]
"""Arguments: row of the first point (from 0), levels of each point, conditions; returns outcomes, point by point."""


@dataclass(frozen=True)
class Work:
    """Working context of a stage: the study, its locked folder, and the executor and solver of its runs."""

    study: Study
    folder: StudyFolder
    executor: RunExecutor
    watch: Watch
    solver: Solver

    def there(self) -> "Work":
        """Return the same context for the model of `refine.in`."""
        study = self.study.there
        return replace(self, study=study, solver=make_solver(study).placed(self.folder.work))

    def result(self, kind: type[R]) -> R:
        """Return the result of an earlier stage by its class or base class; it is fresh while a stage works."""
        kinds = (stage.result() for stage in stages_of(self.study))
        return read_result(self.folder, next((candidate for candidate in kinds if issubclass(candidate, kind)), kind))

    def outcomes(self, requests: Sequence[Request]) -> list[Outcome]:
        """Return recorded or computed outcomes; `UsageError` if a repeated first run gives another response."""
        if again := second_time(self.study, requests):
            first, second = (outcome.response for outcome in self._answered(again))
            if first is not None and second is not None and abs(first - second) > SAME * max(abs(first), abs(second)):
                where = f"{again[0].stage} run {again[0].row + 1}"
                raise UsageError(
                    f"solver: the program is stochastic (two runs at the levels of {where} returned {first:.9g} and "
                    f"{second:.9g}). {self.study.solver.chance_remedy().text}"
                )
        return self._answered(requests, QUORUM)

    def _answered(self, requests: Sequence[Request], quorum: float = 0.0) -> list[Outcome]:
        limit, naming = self.study.solver.run_limit, self.study.naming
        how = (self.solver, self.folder, self.executor, self.watch, limit, quorum)
        return answer_all(requests, *how, naming=naming)

    def simulating(self, stage: str, pictured: bool = False) -> SimulateAt:
        """Return a function that simulates points at conditions; `pictured` runs keep the data for pictures."""

        def simulate(first: int, points: Sequence[Mapping[str, float]], conditions: Sequence[float]) -> list[Outcome]:
            rows = enumerate(points, first)
            requests = [Request(stage, row, levels, d, pictured) for row, levels in rows for d in conditions]
            times = self.study.solver.repeats
            return merged(self._answered(repeated(requests, times)), times)

        return simulate


def a_stage(kind: type[R]) -> Callable[[Callable[[Work, Head], R]], Callable[..., R]]:
    """Decorate the function that computes a stage's result: lock the folder, check earlier stages, store the result."""

    def decorated(analysis: Callable[[Work, Head], R]) -> Callable[..., R]:
        @wraps(analysis, assigned=("__module__", "__name__", "__qualname__", "__doc__"))
        def stage(
            study: Study,
            folder: StudyFolder,
            executor: RunExecutor = HERE,
            watch: Watch = watch_nothing,
            solver: Solver | None = None,
        ) -> R:
            with folder:
                work = Work(study, folder, executor, watch, (solver or make_solver(study)).placed(folder.work))
                if (own := stage_called(kind.name)).of_surface and not has_surface(study):
                    raise UsageError(
                        f"{kind.name}: this study has no response surface (`rsm.design: none`), so it has no analysis "
                        "of variance and no confidence intervals. Choose a design, or run `stemcal run SPEC`."
                    )
                if (before := own.needs(study)) is not None:
                    require_fresh(study, work.solver, folder, before)
                return write_result(folder, analysis(work, head_of(study, work.solver, folder, kind.name)))

        del stage.__wrapped__  # otherwise `inspect.signature` shows the arguments of the inner function
        return stage

    return decorated


SAME = 1e-6  # relative difference that another order of summation may cause


def repeats_itself(study: Study) -> bool:
    """Check that the solver computes its responses and has no replicates, so that equal inputs give equal responses."""
    return study.kind.answers == "computes" and not study.solver.repeats


def second_time(study: Study, requests: Sequence[Request]) -> list[Request]:
    """Return the first run and its repetition, to detect a stochastic program; empty if not needed."""
    known = study.kind.of_spec_alone or not repeats_itself(study)
    if known or not requests or stage_called(requests[0].stage).needs(study) is not None:
        return []
    conditions = {request.condition for request in requests}
    if len(conditions) == 1 and study.targets.calibrate_at not in conditions:
        return []
    return [requests[0], replace(requests[0], replicate=1)]
