"""What the workflow asks of a solver: these levels, this diameter, which force?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol


@dataclass(frozen=True)
class Request:
    """One run to be answered.

    Parameters
    ----------
    stage : str
        ``screen``, ``rsm`` or ``validate``.
    row : int
        Row of the stage's design, from 0.
    levels : mapping
        Every factor's value in the units of the spec.
    diameter : float
        Outer diameter of the stem, mm.
    """

    stage: str
    row: int
    levels: Mapping[str, float]
    diameter: float


@dataclass(frozen=True)
class Answer:
    """What came of a request: a force in N, or a status and the reason why there is none."""

    status: str
    force: float | None = None
    reason: str = ""
    message: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether the force may enter an analysis."""
        return self.status == "ok"


class Solver(Protocol):
    """One way to answer requests. Instances are pickled to worker processes.

    Notes
    -----
    A solver may offer four things more: ``cost_estimate(request) -> float``, the seconds a run takes on one
    core, for plans; ``inline = True`` if an answer takes less time than starting a worker process;
    ``placed(path) -> Solver``, itself with a folder of the study for the files of its runs; and ``get_ready()``,
    what every process does before its first run, which does not count against the run's time limit.
    """

    def prepare(self) -> None:
        """Do once, before workers start, what they would otherwise all do (compile, check a licence)."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Everything that determines the answer, as JSON values; equal identities share one record."""

    def solve(self, request: Request) -> Answer:
        """Answer one request. A failed simulation is an `Answer`, not an exception."""

    def given_design(self, stage: str) -> list[dict[str, float]] | None:
        """The rows of levels this solver can answer for `stage`, or None if it answers any."""
