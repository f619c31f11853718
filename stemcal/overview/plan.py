"""The plan of a study: its runs, their computing time, and the terms that its designs cannot estimate."""

import socket
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice
from math import ceil
from statistics import fmean
from typing import Literal

from stemcal.doe.coding import term_columns, term_names
from stemcal.doe.effects import aliases_note
from stemcal.doe.regression.least_squares import not_estimable
from stemcal.formats import counted, duration, in_bytes, series
from stemcal.notes import Note, Remedy
from stemcal.runs.executors import available_cores
from stemcal.runs.record import Run
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.design import Design, StageRuns
from stemcal.stages.ledger import keyed, missing, required_runs
from stemcal.stages.stage import stages_of
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study

_MOST_RECORDS = 50  # largest number of records from which the time of a run is estimated

Source = Literal["none", "by_hand", "guess", "recorded"]
"""Source of the computing times: unknown, unknown for manual runs, estimate of the solver, or recorded runs."""


@dataclass(frozen=True)
class _Costs:
    """The computing time of runs: a function of the request (s on one core; None if unknown), and its source."""

    of: Callable[[Request], float] | None
    source: Source = "none"
    recorded: int = 0  # number of recorded runs from which the time is estimated


@dataclass(frozen=True)
class _PlannedStage:
    """The runs of a stage, their computing time on one core (s), and the `memory` of the largest run (bytes)."""

    stage: str
    rows: int
    distinct_runs: int
    recorded: int
    to_run: int
    seconds: float | None
    memory: float | None = None


@dataclass(frozen=True)
class Plan:
    """The runs of a study that remain, with their estimated cost.

    seconds         computing time of these runs on one core, s; `tests` contains the part of each laboratory test
    memory          memory of the largest run, bytes
    source          source of the times, with the number of `recorded_runs` if they are from records
    elapsed         time of the whole study with `workers` parallel runs, s; adaptive stages count with their usual runs
    """

    schema_version: int
    stage: str
    study: str
    stages: Rows[_PlannedStage]
    to_run: int
    seconds: float | None
    notes: tuple[Note, ...]
    memory: float | None = None
    source: Source = "none"
    recorded_runs: int = 0
    workers: int = 1
    elapsed: float | None = None
    tests: Mapping[str, float] = field(default_factory=dict)


def plan(
    study: Study, folder: StudyFolder | None = None, solver: Solver | None = None, workers: int | None = None
) -> Plan:
    """Return the runs of every stage and their cost with this number of `workers`, by default one per core."""
    solver, workers = solver or make_solver(study), workers or available_cores()
    wanted = required_runs(study, solver, folder)
    costs = costs_of(solver, folder, Request("plan", 0, study.midlevels(), study.targets.calibrate_at))
    left = [missing(part, study, solver, folder) for part in wanted]
    every = [keyed(part, study, solver) for part in wanted]
    stages = [_count(*part, solver, costs) for part in zip(wanted, every, left, strict=True)]
    to_run = sum(stage.to_run for stage in stages)
    seconds = [stage.seconds for stage in stages]
    later = [runs for stage in stages_of(study) if (runs := stage.later(study)) is not None]
    rounds = [part for runs in later for part in runs.rounds] if not wanted[-1].settled else []
    spent = [] if costs.of is None else [list(map(costs.of, runs)) for runs in (*left, *rounds)]
    notes: list[Note] = [part.note for part in wanted if part.note is not None]
    notes += [runs.note for runs in later]
    notes += [note for part in wanted if part.design is not None for note in design_notes(part.design)]
    return Plan(
        1,
        "plan",
        study.name,
        Rows(stages),
        to_run,
        None if None in seconds else sum(second or 0.0 for second in seconds),
        tuple(notes),
        max((stage.memory for stage in stages if stage.memory is not None), default=None),
        costs.source,
        costs.recorded,
        workers,
        None if costs.of is None else overhead(solver) + elapsed(spent, workers),
        _by_test(left, solver, costs),
    )


def _by_test(left: Iterable[Sequence[Request]], solver: Solver, costs: _Costs) -> dict[str, float]:
    seconds: dict[str, float] = defaultdict(float)
    cost = costs.of or (lambda _request: 0.0)
    for request in chain.from_iterable(left):
        shares = solver.cost_by_test(request)
        for name, share in shares.items():
            seconds[name] += cost(request) * share / sum(shares.values())
    return dict(seconds)


def _count(
    part: StageRuns, runs: Sequence[tuple[str, Request, object]], left: Sequence[Request], solver: Solver, costs: _Costs
) -> _PlannedStage:
    distinct = {key for key, *_ in runs}
    memory = [bytes_ for request in left if (bytes_ := solver.memory_estimate(request)) is not None]
    counts = len(runs), len(distinct), len(distinct) - len(left), len(left)
    seconds = None if costs.of is None else sum(map(costs.of, left))
    return _PlannedStage(part.stage, *counts, seconds, max(memory, default=None))


def design_notes(design: Design) -> Iterator[Note]:
    """Yield a note on the terms that a design cannot estimate, or on the aliases of its main effects."""
    terms = ("1", *design.names) if design.order == 1 else term_names(design.names)
    if lost := not_estimable(term_columns(design.coded)[:, : len(terms)], terms):
        text = (
            f"{design.stage}: the design ({design.kind}, {len(design.coded)} runs) is not sufficient to estimate "
            f"{series(lost)}."
        )
        yield Note("cannot_estimate", "caution", text, Remedy("Add runs or factor levels."))
    elif design.order == 1:
        yield aliases_note(design.coded, design.names)


def total(plan: Plan) -> list[str]:
    """Return sentences on the number of remaining runs, their computing time and their memory."""
    if plan.source == "by_hand":
        stages = " + ".join(str(stage.to_run) for stage in plan.stages)
        return [f"{stages} {'run' if plan.to_run == 1 else 'runs'} must be done by hand, {plan.to_run} in total."]
    lines = [f"{counted(plan.to_run, 'run')} must be computed."]
    if plan.seconds is not None:
        source = {
            "guess": " (rough estimate)",
            "recorded": f" (estimated from {counted(plan.recorded_runs, 'recorded run')} on this machine)",
        }.get(plan.source, "")
        whole = sum(plan.tests.values())
        shares = [f"{name} {duration(part)} ({100 * part / whole:.0f} %)" for name, part in plan.tests.items()]
        of_tests = f": {', '.join(shares)}" if len(shares) > 1 else ""
        lines.append(f"On one core, the runs take {duration(plan.seconds)}{source}{of_tests}.")
    if plan.elapsed is not None and plan.to_run:
        workers = counted(plan.workers, "worker")
        lines.append(f"The whole study takes about {duration(plan.elapsed)} with {workers}.")
    if plan.memory:
        lines.append(f"One run needs about {in_bytes(plan.memory)} of memory.")
    return lines


def costs_of(solver: Solver, folder: StudyFolder | None, like: Request) -> _Costs:
    """Return the cost of runs on this machine; `like` is a typical run."""
    if solver.asks_people:
        return _Costs(None, "by_hand")

    def guess(request: Request) -> float:
        return solver.cost_estimate(request) or 1.0

    recorded = [] if folder is None else list(islice(_timed_runs(solver, folder, guess), _MOST_RECORDS))
    if total_seconds := sum(seconds for seconds, _ in recorded):
        pace = total_seconds / sum(guessed for _, guessed in recorded)
        return _Costs(lambda request: pace * guess(request), "recorded", len(recorded))
    if solver.cost_estimate(like) is None:
        return _Costs(None)
    return _Costs(guess, "guess")


def _timed_runs(
    solver: Solver, folder: StudyFolder, guess: Callable[[Request], float]
) -> Iterable[tuple[float, float]]:
    """Yield the measured and the estimated time (s) of each recorded run of this solver on this machine."""
    for key in folder.keys():  # noqa: SIM118
        record = folder.peek(key)
        if record is None or record["status"] != "ok":
            continue
        request, provenance = Request(**record["request"]), record["provenance"]
        if provenance.get("host") == socket.gethostname() and Run.of(solver, request).key == key:
            seconds, guessed = provenance.get("wall_seconds"), guess(request)
            if seconds and guessed:
                yield seconds, guessed


def elapsed(stages: Iterable[Sequence[float]], workers: int) -> float:
    """Return the time of stages in sequence, s, if each worker computes an equal number of runs of mean duration.

    >>> elapsed([[3.0, 1.0, 1.0, 1.0], [4.0]], 2)
    7.0
    """
    return sum(ceil(len(costs) / workers) * fmean(costs) for costs in stages if costs)


def overhead(solver: Solver) -> float:
    """Return the time for starting, compiling, statistics and the report, s, measured on two cores at 2.1 GHz."""
    return 7.5 if solver.immediate else 9.0 + 30.0 * solver.preparing()
