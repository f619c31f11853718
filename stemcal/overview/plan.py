"""Runs, recorded ones, seconds (from recorded runs or the solver) and what designs of a study cannot estimate."""

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
from stemcal.runs.record import Run, by_key
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.design import Asked, Design
from stemcal.stages.ledger import asked, missing
from stemcal.stages.stage import stages_of
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study

_MOST_RECORDS = 50  # that are looked at

Source = Literal["none", "by_hand", "guess", "recorded"]
"""How costs are known: not for runs that people do, else by the solver's guess, or by runs recorded here."""


@dataclass(frozen=True)
class _Costs:
    """The seconds of a run on one core, None if unknown, their source, and the number of recorded runs."""

    of: Callable[[Request], float] | None
    source: Source = "none"
    recorded: int = 0


@dataclass(frozen=True)
class _PlannedStage:
    """The runs of a stage; `seconds` on one core, bytes of `memory` of the largest; None: unknown."""

    stage: str
    rows: int
    distinct_runs: int
    recorded: int
    to_run: int
    seconds: float | None
    memory: float | None = None


@dataclass(frozen=True)
class Plan:
    """What a study would run.

    `seconds` are those of one core for the runs, known from `source` (with `recorded_runs`); those of each test are in
    `tests`. `elapsed` is what the study takes with `workers`, runs that are decided one by one counted as usual.
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
    """Return the runs of every stage, and their cost with a number of workers (all cores), without running any."""
    solver, workers = solver or make_solver(study), workers or available_cores()
    wanted = asked(study, solver, folder)
    costs = costs_of(solver, folder, Request("plan", 0, study.midlevels(), study.targets.calibrate_at))
    left = [missing(part, study, solver, folder) for part in wanted]
    stages = [_count(part, runs, solver, costs) for part, runs in zip(wanted, left, strict=True)]
    to_run = sum(stage.to_run for stage in stages)
    seconds = [stage.seconds for stage in stages]
    later = [found for stage in stages_of(study) if (found := stage.later(study)) is not None]
    rounds = [part for found in later for part in found.rounds] if not wanted[-1].settled else []
    spent = [] if costs.of is None else [list(map(costs.of, runs)) for runs in (*left, *rounds)]
    notes: list[Note] = [part.note for part in wanted if part.note is not None]
    notes += [found.note for found in later]
    notes += [note for part in wanted if part.design is not None for note in judged(part.design)]
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
    """Return the seconds of each test of the runs left on one core; nothing if the solver has one test only."""
    found: dict[str, float] = defaultdict(float)
    cost = costs.of or (lambda _request: 0.0)
    for request in chain.from_iterable(left):
        each = solver.cost_by_test(request)
        for name, share in each.items():
            found[name] += cost(request) * share / sum(each.values())
    return dict(found)


def _count(part: Asked, left: Sequence[Request], solver: Solver, costs: _Costs) -> _PlannedStage:
    distinct = by_key(solver, part.requests)
    memory = [bytes_ for request in left if (bytes_ := solver.memory_estimate(request)) is not None]
    counts = len(part.requests), len(distinct), len(distinct) - len(left), len(left)
    seconds = None if costs.of is None else sum(map(costs.of, left))
    return _PlannedStage(part.stage, *counts, seconds, max(memory, default=None))


def judged(design: Design) -> Iterator[Note]:
    """Yield the terms that a design cannot estimate, or what main effects are aliased with where it is for them."""
    terms = ("1", *design.names) if design.order == 1 else term_names(design.names)
    if lost := not_estimable(term_columns(design.coded)[:, : len(terms)], terms):
        text = (
            f"{design.stage}: the design ({design.kind}, {len(design.coded)} runs) is not sufficient to estimate "
            f"{series(lost)}."
        )
        yield Note("cannot_estimate", "caution", text, Remedy("Add runs or factor levels."))
    elif design.order == 1:
        yield aliases_note(design.coded, design.names)


def total(found: Plan) -> list[str]:
    """Return sentences on the number of runs left, their time and their memory."""
    if found.source == "by_hand":
        stages = " + ".join(str(stage.to_run) for stage in found.stages)
        return [f"{stages} {'run' if found.to_run == 1 else 'runs'} must be done by hand, {found.to_run} in total."]
    lines = [f"{counted(found.to_run, 'run')} must be computed."]
    if found.seconds is not None:
        source = {
            "guess": " (rough estimate)",
            "recorded": f" (estimated from {counted(found.recorded_runs, 'recorded run')} on this machine)",
        }.get(found.source, "")
        lines.append(f"On one core, the runs take {duration(found.seconds)}{source}{_of_tests(found.tests)}.")
    if found.elapsed is not None and found.to_run:
        workers = counted(found.workers, "worker")
        lines.append(f"The whole study takes about {duration(found.elapsed)} with {workers}.")
    if found.memory:
        lines.append(f"One run needs about {in_bytes(found.memory)} of memory.")
    return lines


def _of_tests(seconds: Mapping[str, float]) -> str:
    """Return the time of each of several tests, with its part of the whole.

    >>> _of_tests({"cutting": 30.0, "bending": 570.0})
    ': cutting 30 s (5 %), bending 10 min (95 %)'
    """
    parts = [f"{name} {duration(each)} ({each / sum(seconds.values()):.0%})" for name, each in seconds.items()]
    return f": {', '.join(parts)}".replace("%", " %") if len(parts) > 1 else ""


def costs_of(solver: Solver, folder: StudyFolder | None, like: Request) -> _Costs:
    """Return the cost of runs on this machine; `like` is one of them."""
    if solver.asks_people:
        return _Costs(None, "by_hand")

    def guess(request: Request) -> float:
        return solver.cost_estimate(request) or 1.0

    recorded = [] if folder is None else list(islice(_timed_runs(solver, folder, guess), _MOST_RECORDS))
    if taken := sum(seconds for seconds, _ in recorded):
        pace = taken / sum(guessed for _, guessed in recorded)
        return _Costs(lambda request: pace * guess(request), "recorded", len(recorded))
    if solver.cost_estimate(like) is None:
        return _Costs(None)
    return _Costs(guess, "guess")


def _timed_runs(
    solver: Solver, folder: StudyFolder, guess: Callable[[Request], float]
) -> Iterable[tuple[float, float]]:
    """Yield time and estimate of each recorded run of this solver on this machine, s."""
    for key in folder.keys():  # noqa: SIM118
        record = folder.peek(key)
        if record is None or record["status"] != "ok":
            continue
        request, circumstances = Request(**record["request"]), record["provenance"]
        if circumstances.get("host") == socket.gethostname() and Run.of(solver, request).key == key:
            seconds, guessed = circumstances.get("wall_seconds"), guess(request)
            if seconds and guessed:
                yield seconds, guessed


def elapsed(stages: Iterable[Sequence[float]], workers: int) -> float:
    """Return the time of stages in sequence, s: each worker makes an equal number of runs of mean length.

    >>> elapsed([[3.0, 1.0, 1.0, 1.0], [4.0]], 2)
    7.0
    """
    return sum(ceil(len(costs) / workers) * fmean(costs) for costs in stages if costs)


def overhead(solver: Solver) -> float:
    """Return the seconds that starting, statistics, page, workers and compiling take, of two cores at 2.1 GHz."""
    return 7.5 if solver.immediate else 9.0 + 30.0 * solver.preparing()
