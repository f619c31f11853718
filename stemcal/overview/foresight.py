"""What a study takes, foretold before anything of it is begun: time and memory, and whether that is too much."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from stemcal.folder.study_folder import StudyFolder
from stemcal.notes import Note
from stemcal.overview.plan import asked, missing
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Estimating, Immediate, Request, Solver, Weighing
from stemcal.study.model import EmbeddedSolver, Study

MOST_HOURS = 48.0  # what a command begins without being told that this is meant
_COMMAND, _WORKER = 0.35e9, 0.25e9  # bytes that the command and each of its workers hold beside their models


@dataclass(frozen=True)
class Demand:
    """Number of runs, seconds of one core for all of them, bytes of memory for the largest."""

    runs: int
    seconds: float
    memory: float


def left_to_run(study: Study, folder: StudyFolder, solver: Solver, stage: str | None = None) -> list[Request]:
    """Return the runs left of all stages or of one; one that decides its runs one by one counts with one of them."""
    wanted = [part for part in asked(study, solver, folder) if stage in (None, part.stage)]
    if stage is not None and not wanted:
        return [Request(stage, 0, study.midlevels(), study.targets.calibrate_at)]
    return [run for part in wanted for run in missing(part, study, solver, folder)]


def demand_of_one(study: Study, conditions: Iterable[float]) -> Demand:
    """Return what one virtual shear test takes, at the largest of some diameters; nothing for other solvers."""
    if not isinstance(study.solver, EmbeddedSolver):
        return Demand(0, 0.0, 0.0)
    each = [demand_of([Request("simulate", 0, study.midlevels(), d)], make_solver(study)) for d in conditions]
    return Demand(1, max(one.seconds for one in each), max(one.memory for one in each))


def demand_of(requests: Iterable[Request], solver: Solver) -> Demand:
    """Return what these runs take; nothing where the solver cannot say."""
    if isinstance(solver, Immediate) or not isinstance(solver, Estimating | Weighing):
        return Demand(0, 0.0, 0.0)
    runs = list(requests)
    seconds = sum(map(solver.cost_estimate, runs)) if isinstance(solver, Estimating) else 0.0
    memory = max(map(solver.memory_estimate, runs), default=0.0) if isinstance(solver, Weighing) else 0.0
    return Demand(len(runs), seconds, memory)


class TooMuchMemory(Note):
    """Runs need more memory than this machine has, bytes; with at most `workers` at a time they would not, 0: none."""

    each: float
    at_a_time: int
    machine: float
    workers: int


class ScarceMemory(Note):
    """The runs at a time, with the programs that compute them, need more memory than is free now, bytes."""

    needed: float
    at_a_time: int
    free: float


class TooLong(Note):
    """The runs would take more hours than a command begins unasked."""

    hours: float
    most: float


def scarce(demand: Demand, workers: int, free: float) -> Iterator[Note]:
    """Yield a note if the runs will not find the memory that they need, though the machine has it."""
    at_a_time = max(1, min(workers, demand.runs))
    needed = _COMMAND + at_a_time * (_WORKER + demand.memory)
    if demand.runs and needed > free:
        yield ScarceMemory(needed, at_a_time, free)


def excess(demand: Demand, workers: int, memory: float | None) -> Iterator[Note]:
    """Yield what is more than this machine's memory (bytes, None if it is not known), or than `MOST_HOURS`."""
    at_a_time = max(1, min(workers, demand.runs))
    if memory is not None and at_a_time * demand.memory > memory:
        yield TooMuchMemory(demand.memory, at_a_time, memory, int(memory // demand.memory))
    hours = demand.seconds / 3600.0 / at_a_time
    if hours > MOST_HOURS:
        yield TooLong(hours, MOST_HOURS)
