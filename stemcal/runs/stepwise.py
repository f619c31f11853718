"""Runs that are decided one by one, each after the answer before it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from stemcal.errors import UsageError
from stemcal.executors.base import RunExecutor
from stemcal.folder.store import StudyFolder
from stemcal.runs.answer import Watch, answer_all
from stemcal.runs.outcome import Outcome, outcome_of
from stemcal.solvers.protocol import Request, Solver
from stemcal.study.model import Study

SimulateAt = Callable[[int, Mapping[str, float], Sequence[float]], list[Outcome]]
"""Row (from 0), levels, diameters → what came of the run at each diameter."""


def simulating(
    stage: str,
    study: Study,
    solver: Solver,
    folder: StudyFolder,
    executor: RunExecutor,
    watch: Watch,
    pictured: bool = False,
) -> SimulateAt:
    """Return what simulates one point at some diameters; `pictured` runs keep what pictures are made from.

    Raises
    ------
    UsageError
        If the solver answers from a table.
    """
    if study.solver.kind == "table":
        raise UsageError(f"{stage}: a table answers only what it holds; this needs a solver that can simulate")
    policy = study.runs.model_copy(update={"quorum": 0.0, "keep_going": True})

    def simulate(row: int, levels: Mapping[str, float], diameters: Sequence[float]) -> list[Outcome]:
        requests = [Request(stage, row, levels, diameter, pictured) for diameter in diameters]
        answers = answer_all(requests, solver, folder, executor, watch, policy)
        return [outcome_of(request, answer, solver) for request, answer in zip(requests, answers, strict=True)]

    return simulate
