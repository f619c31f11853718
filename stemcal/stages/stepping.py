"""Runs that are decided one by one, each after the answer before it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any

from stemcal.errors import UsageError
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.answering import Watch, answer_all
from stemcal.stages.artefacts import run_entry
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

Simulate = Callable[[int, Mapping[str, float]], dict[str, Any]]
"""Row (from 0) and levels → a run's entry: force, status, reason, message, key."""

SimulateAt = Callable[[int, Mapping[str, float], Sequence[float]], list[dict[str, Any]]]
"""The same at several diameters, an entry for each."""


def simulating(
    stage: str, study: Study, solver: Solver, folder: StudyFolder, executor: Executor, watch: Watch
) -> Simulate:
    """Return what simulates one point at the calibration diameter; raises as `simulating_at` does."""
    return at_one(study.targets.calibrate_at, simulating_at(stage, study, solver, folder, executor, watch))


def at_one(diameter: float, simulate: SimulateAt) -> Simulate:
    """Simulate always at the same diameter."""
    return lambda row, levels: simulate(row, levels, [diameter])[0]


def simulating_at(
    stage: str, study: Study, solver: Solver, folder: StudyFolder, executor: Executor, watch: Watch
) -> SimulateAt:
    """Return what simulates one point at several diameters.

    Raises
    ------
    UsageError
        If the solver answers from a table.
    """
    if study.solver.kind == "table":
        raise UsageError(f"{stage}: a table answers only what it holds; this needs a solver that can simulate")
    policy = study.runs.model_copy(update={"quorum": 0.0, "keep_going": True})

    def simulate(row: int, levels: Mapping[str, float], diameters: Sequence[float]) -> list[dict[str, Any]]:
        requests = [Request(stage, row, levels, diameter) for diameter in diameters]
        answers = answer_all(requests, solver, folder, executor, watch, policy)
        return [run_entry(request, answer, solver) for request, answer in zip(requests, answers, strict=True)]

    return simulate
