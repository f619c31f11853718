"""What a study takes on this machine: its runs, and what comes next to them.

How long a run takes is known best from the runs that the study already has, else from half a second of a run like it,
else from the solver's own guess. What comes next to it is a constant of a small machine; compiling is known from the
last time.
"""

import socket
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from heapq import heapify, heapreplace
from itertools import islice
from typing import Literal

from stemcal.folder.study_folder import StudyFolder
from stemcal.runs.outcome import record_key
from stemcal.solvers.protocol import Request, Solver

_MOST_RECORDS = 50  # that are looked at
# Of two cores at 2.1 GHz, s: starting and statistics; what workers add; compiling, as long as it was never timed.
_STARTING, _WORKERS, _COMPILING = 2.5, 1.5, 30.0
# So too: the page with its figures.
_PAGE = 5.0

Source = Literal["none", "by_hand", "guess", "tried", "recorded"]
"""How costs are known: not for runs that people do, else by the solver's guess, by half a second of a run here, by runs
recorded here."""


@dataclass(frozen=True)
class Costs:
    """The seconds of a run on one core, None if unknown, their source, and the number of recorded runs."""

    of: Callable[[Request], float] | None
    source: Source = "none"
    recorded: int = 0


def costs_of(solver: Solver, folder: StudyFolder | None, like: Request) -> Costs:
    """Return what runs cost here; `like` is the request that may be tried for a moment."""
    if solver.asks_people:
        return Costs(None, "by_hand")

    def guess(request: Request) -> float:
        return solver.cost_estimate(request) or 1.0

    recorded = [] if folder is None else list(islice(_recorded(solver, folder, guess), _MOST_RECORDS))
    if taken := sum(seconds for seconds, _ in recorded):
        pace = taken / sum(guessed for _, guessed in recorded)
        return Costs(lambda request: pace * guess(request), "recorded", len(recorded))
    if solver.cost_estimate(like) is None:
        return Costs(None)
    if (tried := solver.pace(like)) is None:
        return Costs(guess, "guess")
    return Costs(lambda request: tried * guess(request), "tried")


def _recorded(solver: Solver, folder: StudyFolder, guess: Callable[[Request], float]) -> Iterable[tuple[float, float]]:
    """Yield what runs of this solver took on this machine, and the guess, s."""
    for key in folder.keys():  # noqa: SIM118
        record = folder.peek(key)
        if record is None or record["status"] != "ok":
            continue
        request, circumstances = Request(**record["request"]), record["provenance"]
        if circumstances.get("host") == socket.gethostname() and record_key(solver, request) == key:
            seconds, guessed = circumstances.get("wall_seconds"), guess(request)
            if seconds and guessed:
                yield seconds, guessed


def elapsed(stages: Iterable[Sequence[float]], workers: int) -> float:
    """Return how long stages take one after the other, the runs of each shared out to the workers in their order.

    >>> elapsed([[3.0, 1.0, 1.0, 2.0], [4.0]], 2)
    8.0
    """
    total = 0.0
    for costs in stages:
        free = [0.0] * max(1, min(workers, len(costs)))
        heapify(free)
        for cost in costs:
            heapreplace(free, free[0] + cost)
        total += max(free)
    return total


def overhead(solver: Solver) -> float:
    """Return the seconds that compiling, starting, statistics and the page take."""
    if solver.immediate:
        return _STARTING + _PAGE
    compiling = solver.preparing()
    return _STARTING + _WORKERS + _PAGE + (_COMPILING if compiling is None else compiling)
