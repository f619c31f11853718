"""Estimate the time and memory of a study before it begins, and check its solver for likely mistakes."""

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
from stemcal.stages.ledger import missing, required_runs
from stemcal.study.model.study import Study

_MOST_HOURS = 48.0  # a command whose runs take longer starts with a warning


@dataclass(frozen=True)
class Demand:
    """Number of runs, their computing time on one core in total (s), and the memory of the largest run (bytes)."""

    runs: int
    seconds: float
    memory: float


def demand_left(study: Study, folder: StudyFolder, solver: Solver, stage: str | None = None) -> Demand:
    """Return the demand of the remaining runs of all stages or of one `stage`; of a single run if they are unknown."""
    wanted = [part for part in required_runs(study, solver, folder) if stage in (None, part.stage)]
    if stage is not None and not wanted:
        return demand_of([Request(stage, 0, study.midlevels(), study.targets.calibrate_at)], solver)
    return demand_of((run for part in wanted for run in missing(part, study, solver, folder)), solver)


def demand_of_one(study: Study, conditions: Iterable[float]) -> Demand:
    """Return the demand of the most costly virtual shear test at some diameters (mm); zero for other solvers."""
    if not study.kind.simulates_stems:
        return Demand(0, 0.0, 0.0)
    demands = [demand_of([Request("simulate", 0, study.midlevels(), d)], make_solver(study)) for d in conditions]
    return Demand(1, max(demand.seconds for demand in demands), max(demand.memory for demand in demands))


def demand_of(requests: Iterable[Request], solver: Solver) -> Demand:
    """Return the demand of these runs; runs for which the solver has no estimate are not included."""
    runs = [] if solver.immediate else list(requests)
    seconds = [second for run in runs if (second := solver.cost_estimate(run)) is not None]
    memory = [bytes_ for run in runs if (bytes_ := solver.memory_estimate(run)) is not None]
    return Demand(max(len(seconds), len(memory)), sum(seconds), max(memory, default=0.0))


def excess(demand: Demand, workers: int, memory: float | None) -> list[Note]:
    """Return notes if runs need more than `memory` (bytes; None: unlimited), or take longer than `_MOST_HOURS`."""
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
    """Return warnings of long computing times; `UsageError` if runs on this machine (`here`) exceed its memory."""
    notes = excess(demand, workers, machine_memory() if here else None)
    if impossible := [str(note) for note in notes if note.severity == "error"]:
        raise UsageError(" ".join(impossible))
    return [str(note) for note in notes]


_LEAST_STROKE = {"first_fracture": 0.35, "severed": 1.0}
"""Recommended stroke as a share of the diameter. The maximum force of stems that fracture at once is at 0.06 to 0.1 of
the diameter, that of stems that fold first at 0.2 to 0.35. Stems on two supports are cut through at 0.35 to 0.9."""


def beforehand(study: Study) -> Iterator[Note]:
    """Yield notes on settings of the solver that are valid but may cause wrong results."""
    thickest = max((target.condition for target in study.targets.means), default=study.specimen.outer_diameter)
    cuts, least = study.kind.simulates_stems and study.naming.is_cutting, _LEAST_STROKE[study.loading.until] * thickest
    if cuts and (stroke := study.loading.stroke_at(thickest)) < least * (1.0 - 1e-9):
        text = (
            f"The stroke of {stroke:.3g} mm is only {stroke / thickest:.2g} times the largest diameter "
            f"({thickest:g} mm). If a run stops before the peak force is reached, the simulated force is too low."
        )
        yield Note("short_stroke", "warning", text, lasting(study, least, thickest))
    if study.solver.has_lengths and "failure_strain" in study.names:
        text = (
            f"The failure strain depends on `internal_length` ({study.material.internal_length}) and `edge_spread` "
            f"({study.blade.edge_spread}): a force–travel curve cannot determine the three values separately."
        )
        choose = "Choose `internal_length` and `edge_spread` before the calibration"
        yield Note("lengths_belong", "caution", text, Remedy(f"{choose}, and report both with the failure strain."))


def lasting(study: Study, travel: float, diameter: float) -> Remedy:
    """Return the remedy: a longer stroke, so that the blade travels this distance (mm) at a stem diameter (mm)."""
    longer = study.loading.longer(travel / study.loading.stroke_at(diameter))
    if longer.stroke is None:
        step = 10.0 ** (floor(log10(longer.duration)) - 1)
        written = f"duration: {ceil(round(longer.duration / step, 6)) * step:.6g} s"
    else:
        written = f"stroke: d/{floor(10.0 * diameter / travel) / 10.0:g}"
    edit = f"loading: {{{written}}}"
    end = "when the stem is cut through" if study.loading.until == "severed" else "at the first fracture"
    return Remedy(f"Set `{edit}`; each run still ends {end}.", edit)
