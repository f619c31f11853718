"""What a study takes, foretold before anything of it is begun: time and memory, and whether that is too much."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from stemcal.folder.store import StudyFolder
from stemcal.overview.plan import asked, missing
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Estimating, Immediate, Request, Solver, Weighing
from stemcal.study.model import EmbeddedSolver, Study

__all__ = ["MOST_HOURS", "Demand", "Left", "demand_of_left", "demand_of_one", "excess", "in_bytes", "left_to_run"]

MOST_HOURS = 48.0  # what a command begins without being told that this is meant


@dataclass(frozen=True)
class Demand:
    """Number of runs, seconds of one core for all of them, bytes of memory for the largest."""

    runs: int
    seconds: float
    memory: float


@dataclass(frozen=True)
class Left:
    """What a stage has still to compute: of so many rows of its design these runs, as far as is known now."""

    stage: str
    rows: int
    runs: tuple[Request, ...]


def left_to_run(study: Study, folder: StudyFolder, solver: Solver, stage: str | None = None) -> list[Left]:
    """Return what is left of all stages or of one; one that decides its runs one by one counts with one of them."""
    wanted = [part for part in asked(study, solver, folder) if stage in (None, part.stage)]
    if stage is not None and not wanted:
        return [Left(stage, 1, (Request(stage, 0, study.midlevels(), study.targets.calibrate_at),))]
    return [Left(part.stage, len(part.requests), tuple(missing(part, study, solver, folder))) for part in wanted]


def demand_of_one(study: Study, conditions: Iterable[float], symmetry: str | None = None) -> Demand:
    """Return what one virtual shear test takes, at the largest of some diameters; nothing for other solvers."""
    if not isinstance(study.solver, EmbeddedSolver):
        return Demand(0, 0.0, 0.0)
    if symmetry is not None:
        study = study.model_copy(update={"solver": study.solver.model_copy(update={"symmetry": symmetry})})
    each = [_demand([Request("simulate", 0, study.midlevels(), d)], make_solver(study)) for d in conditions]
    return Demand(1, max(one.seconds for one in each), max(one.memory for one in each))


def demand_of_left(left: Iterable[Left], solver: Solver) -> Demand:
    """Return what all that is left of some stages takes."""
    return _demand([run for part in left for run in part.runs], solver)


def _demand(requests: Iterable[Request], solver: Solver) -> Demand:
    """Return what these runs take; nothing where the solver cannot say."""
    if isinstance(solver, Immediate) or not isinstance(solver, Estimating | Weighing):
        return Demand(0, 0.0, 0.0)
    runs = list(requests)
    seconds = sum(map(solver.cost_estimate, runs)) if isinstance(solver, Estimating) else 0.0
    memory = max(map(solver.memory_estimate, runs), default=0.0) if isinstance(solver, Weighing) else 0.0
    return Demand(len(runs), seconds, memory)


def excess(demand: Demand, workers: int, memory: float | None) -> list[str]:
    """Say what is more than this machine's memory (bytes, None if it is not known), or than `MOST_HOURS`."""
    said = []
    at_a_time = max(1, min(workers, demand.runs))
    needed = at_a_time * demand.memory
    if memory is not None and needed > memory:
        each = "" if at_a_time == 1 else f", {at_a_time} at a time {in_bytes(needed)}"
        remedy = "take coarser elements (solver.element_size) or a shorter specimen"
        if demand.memory <= memory:
            remedy = f"take fewer workers (--workers {int(memory // demand.memory)})"
        have = f"this machine has {in_bytes(memory)}"
        said.append(f"a run needs about {in_bytes(demand.memory)} of memory{each}; {have}: {remedy}")
    hours = demand.seconds / 3600.0 / at_a_time
    if hours > MOST_HOURS:
        said.append(
            f"the runs would take {_in_hours(hours)}, more than {MOST_HOURS:g} h: take coarser elements "
            "(solver.element_size), a larger time_step or mass_scaling, or fewer runs"
        )
    return said


def in_bytes(count: float) -> str:
    """Return an amount of memory as people say it.

    >>> in_bytes(2.5e8), in_bytes(7.1e9), in_bytes(3e15), in_bytes(float('inf'))
    ('0.2 GB', '7.1 GB', 'more than 1000 TB', 'more than 1000 TB')
    """
    if count < 1e12:
        return f"{max(count / 1e9, 0.1):.1f} GB"
    return f"{count / 1e12:.1f} TB" if count < 1e15 else "more than 1000 TB"


def _in_hours(hours: float) -> str:
    """Return a long time as people say it.

    >>> _in_hours(49.6), _in_hours(2e4), _in_hours(float('inf'))
    ('about 50 h', 'about 833 days', 'more than 100 years')
    """
    if hours > 100 * 8766:
        return "more than 100 years"
    return f"about {hours:.0f} h" if hours < 240 else f"about {hours / 24:.0f} days"
