"""What a stage works with, and how a function on it becomes a stage."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import Protocol, TypeVar

from stemcal.executors.base import RunExecutor
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.runs.answer import Watch, answer_all, ignore
from stemcal.runs.outcome import Outcome, outcome_of
from stemcal.runs.stepwise import SimulateAt, simulating
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.fresh import head_of, read_fresh
from stemcal.stages.repeating import POLICY, require_same, second_time
from stemcal.stages.result import Head, R, StageResult, leave
from stemcal.study.model import Study

R_co = TypeVar("R_co", bound=StageResult, covariant=True)
HERE = InlineExecutor()


@dataclass(frozen=True)
class Work:
    """A study in hand: its folder, locked, and who answers and computes its runs."""

    study: Study
    folder: StudyFolder
    executor: RunExecutor
    watch: Watch
    solver: Solver

    def head(self, stage: str) -> Head:
        """Return how a stage's file begins; tells what has changed since it was written before."""
        return head_of(self.study, self.solver, self.folder, stage)

    def fresh(self, kind: type[R]) -> R:
        """Return the result of a stage before; raise `UsageError` if it is missing or stale."""
        return read_fresh(self.study, self.solver, self.folder, kind)

    def answers(self, requests: Sequence[Request]) -> list[Answer]:
        """Answer every request, from the records or by computing.

        Raises
        ------
        UsageError
            If the program answers the first of them differently the second time, and no chance was declared.
        """
        if again := second_time(self.study, requests):
            policy = POLICY.model_copy(
                update={"tries": self.study.runs.tries, "time_limit": self.study.runs.time_limit}
            )
            both = answer_all(again, self.solver, self.folder, self.executor, ignore, policy)
            require_same(self.study.solver.kind, again, both)
        return answer_all(requests, self.solver, self.folder, self.executor, self.watch, self.study.runs)

    def outcomes(self, requests: Sequence[Request], answers: Sequence[Answer] | None = None) -> list[Outcome]:
        """Return what is told of each request, answered now unless its `answers` are there already."""
        found = self.answers(requests) if answers is None else answers
        return [outcome_of(request, answer, self.solver) for request, answer in zip(requests, found, strict=True)]

    def simulating(self, stage: str, pictured: bool = False) -> SimulateAt:
        """Return what simulates points at some diameters."""
        return simulating(stage, self.study, self.solver, self.folder, self.executor, self.watch, pictured)


class StageFunction(Protocol[R_co]):
    """A stage as the workflow calls it: its result then also lies in the folder."""

    def __call__(
        self,
        study: Study,
        folder: StudyFolder,
        executor: RunExecutor = HERE,
        watch: Watch = ignore,
        solver: Solver | None = None,
    ) -> R_co:
        """Return the result."""


def a_stage(found: Callable[[Work], R]) -> StageFunction[R]:
    """Make a stage of a function: the folder is locked while it works, and its result left there."""

    @wraps(found)
    def stage(
        study: Study,
        folder: StudyFolder,
        executor: RunExecutor = HERE,
        watch: Watch = ignore,
        solver: Solver | None = None,
    ) -> R:
        with folder:
            return leave(folder, found(Work(study, folder, executor, watch, solver or make_solver(study))))

    return stage
