"""Before a study begins: time and memory of its runs, and what its designs and solver need."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil, floor, log10

from stemcal.errors import UsageError
from stemcal.formats import duration, in_bytes
from stemcal.notes import Note, Remedy
from stemcal.runs.executors import machine_memory
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.ledger import asked, missing
from stemcal.study.model.study import Study

_MOST_HOURS = 48.0  # a command with longer runs starts with a warning


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
    """Return time and memory of one virtual shear test at the largest of some diameters; None for other solvers."""
    if not study.kind.simulates_stems:
        return Demand(0, 0.0, 0.0)
    each = [demand_of([Request("simulate", 0, study.midlevels(), d)], make_solver(study)) for d in conditions]
    return Demand(1, max(demand.seconds for demand in each), max(demand.memory for demand in each))


def demand_of(requests: Iterable[Request], solver: Solver) -> Demand:
    """Return time and memory of these runs; None if the solver has no estimate."""
    runs = [] if solver.immediate else list(requests)
    seconds = [second for run in runs if (second := solver.cost_estimate(run)) is not None]
    memory = [bytes_ for run in runs if (bytes_ := solver.memory_estimate(run)) is not None]
    return Demand(max(len(seconds), len(memory)), sum(seconds), max(memory, default=0.0))


def excess(demand: Demand, workers: int, memory: float | None) -> list[Note]:
    """Return notes on what is more than this machine's memory (bytes; None: does not count), or than `_MOST_HOURS`."""
    notes, at_a_time = [], max(1, min(workers, demand.runs))
    if memory is not None and at_a_time * demand.memory > memory:
        text, fitting = f"One run needs about {in_bytes(demand.memory)} of memory", int(memory // demand.memory)
        remedy = "Use larger elements (`solver.element_size`) or a shorter specimen."
        if fitting:
            text += f", and {at_a_time} parallel runs need {in_bytes(at_a_time * demand.memory)}"
            remedy = f"Use fewer workers (`--workers {fitting}`)."
        text += f", but this machine has only {in_bytes(memory)}."
        notes.append(Note("too_much_memory", "error", text, Remedy(remedy)))
    hours = demand.seconds / 3600.0 / at_a_time
    if hours > _MOST_HOURS:
        text = f"The runs would take about {duration(3600.0 * hours)}, which is more than {_MOST_HOURS:g} h."
        larger = "larger elements (`solver.element_size`), a larger `solver.time_step`, a larger `solver.mass_scaling`"
        notes.append(Note("too_long", "warning", text, Remedy(f"Use {larger}, or fewer runs.")))
    return notes


def warnings_before(demand: Demand, workers: int, here: bool = True) -> list[str]:
    """Return warnings of what takes days; raise `UsageError` for more memory than this machine has, if it computes."""
    notes = excess(demand, workers, machine_memory() if here else None)
    if impossible := [str(note) for note in notes if note.severity == "error"]:
        raise UsageError(" ".join(impossible))
    return [str(note) for note in notes]


_LEAST_STROKE = 0.35
"""Of the diameter: stems that fracture have their maximum at 0.06 to 0.1 of it, that fold first at 0.2 to 0.35."""


def beforehand(study: Study) -> Iterator[Note]:
    """Yield notes on the solver; none is a mistake."""
    thickest = max((target.condition for target in study.targets.means), default=study.specimen.outer_diameter)
    cuts = study.kind.simulates_stems and study.naming.is_cutting
    if cuts and (stroke := study.loading.stroke_at(thickest)) < _LEAST_STROKE * thickest:
        text = (
            f"The stroke of {stroke:.3g} mm is only {stroke / thickest:.2g} times the largest diameter "
            f"({thickest:g} mm). If a run stops before the peak force is reached, the simulated force is too low."
        )
        yield Note("short_stroke", "warning", text, lasting(study, _LEAST_STROKE * thickest, thickest))
    if study.solver.has_lengths and "failure_strain" in study.names:
        text = (
            f"The failure strain depends on `internal_length` ({study.material.internal_length}) and `edge_spread` "
            f"({study.blade.edge_spread}): a force–travel curve cannot determine the three values separately."
        )
        choose = "Choose `internal_length` and `edge_spread` before the calibration"
        yield Note("lengths_belong", "caution", text, Remedy(f"{choose}, and report both with the failure strain."))


def lasting(study: Study, travel: float, diameter: float) -> Remedy:
    """Return the remedy that gives the blade a travel at a stem diameter (mm)."""
    longer = study.loading.longer(travel / study.loading.stroke_at(diameter))
    if longer.stroke is None:
        step = 10.0 ** (floor(log10(longer.duration)) - 1)
        written = f"duration: {ceil(round(longer.duration / step, 6)) * step:.6g} s"
    else:
        written = f"stroke: d/{floor(10.0 * diameter / travel) / 10.0:g}"
    edit = f"loading: {{{written}}}"
    return Remedy(f"Set `{edit}`; each run still ends at the first fracture.", edit)
