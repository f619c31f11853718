"""Runs that are decided one by one, each after the answer before it."""

from collections.abc import Callable, Mapping, Sequence

from stemcal.errors import UsageError
from stemcal.executors.base import RunExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.runs.answer import Watch, answer_all
from stemcal.runs.outcome import Outcome, outcome_of
from stemcal.runs.replicates import merged, repeated
from stemcal.solvers.protocol import Request, Solver
from stemcal.study.model import Study

SimulateAt = Callable[[int, Sequence[Mapping[str, float]], Sequence[float]], list[Outcome]]
"""Row of the first point (from 0), levels of each, diameters → what came of each point at each diameter in turn."""


def simulating(
    stage: str,
    study: Study,
    solver: Solver,
    folder: StudyFolder,
    executor: RunExecutor,
    watch: Watch,
    pictured: bool = False,
) -> SimulateAt:
    """Return what simulates points at some diameters, together; `pictured` runs keep what pictures are made from.

    Raises
    ------
    UsageError
        If the solver answers from a table.
    """
    if study.solver.kind == "table":
        raise UsageError(f"{stage}: a table answers only what it holds; this needs a solver that can simulate")
    policy = study.runs.model_copy(update={"quorum": 0.0, "keep_going": True})

    def simulate(first: int, points: Sequence[Mapping[str, float]], conditions: Sequence[float]) -> list[Outcome]:
        rows = enumerate(points, first)
        asked = [Request(stage, row, levels, d, pictured) for row, levels in rows for d in conditions]
        requests = repeated(asked, study.replicates)
        answers = answer_all(requests, solver, folder, executor, watch, policy)
        outcomes = [outcome_of(request, answer, solver) for request, answer in zip(requests, answers, strict=True)]
        return merged(outcomes, study.replicates)

    return simulate
