"""What the workflow asks of a solver: these levels, this diameter, which force? Or what a study has in their place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from stemcal.files.showing import in_a_line, visible
from stemcal.naming import CUTTING, Naming


@dataclass(frozen=True)
class Request:
    """One run to be answered.

    Parameters
    ----------
    stage : str
        Which stage asks.
    row : int
        Row of the stage's design, from 0.
    levels : mapping
        Every factor's value in the units of the spec.
    condition : float
        Outer diameter of the stem, mm; or the study's own condition, in its unit.
    pictured : bool
        Whether the answer is to tell what pictures of the run are made from, if the solver can.
    phases : int, optional
        Asked of the embedded solver: the mean over so many places of its mesh, in place of its own.
    element_size : str, optional
        Asked of the embedded solver: elements of this size, as in a spec, at the place where its mesh stands.
    replicate : int
        Which of the simulations of the same levels it is, from 1; 0 where there is one only. A numbered run is drawn
        by chance: its answer belongs to its stage and row too.
    """

    stage: str
    row: int
    levels: Mapping[str, float]
    condition: float
    pictured: bool = False
    phases: int | None = None
    element_size: str | None = None
    replicate: int = 0

    def as_record(self) -> dict[str, Any]:
        """Return it as a record holds it: mesh and replicate only where another one is asked for."""
        fields = {**vars(self), "levels": dict(self.levels), "replicate": self.replicate or None}
        return {name: value for name, value in fields.items() if value is not None}


NOT_RUN = "not_run"  # the reason of a run that could not be done by hand
WITHDRAWN = "withdrawn"  # the reason of a result that was taken back: the word on the sheet, too
RESPONSES = "responses"  # among the details of an answer: further responses by name


@dataclass(frozen=True)
class Answer:
    """What came of a request: a force in N, or a status and the reason why there is none.

    Where the study names its own responses `response` is the first of them, in its unit; details have the others.
    """

    status: str
    response: float | None = None
    reason: str = ""
    message: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether the force may enter an analysis."""
        return self.status == "ok"

    def readable(self) -> Answer:
        """Return it with words that have no control characters: they may be a program's."""
        return replace(self, reason=in_a_line(self.reason), message=visible(self.message))


class Solver(Protocol):
    """One way to answer requests. Instances are pickled to worker processes.

    A solver that can do more says so by its type: `Estimating`, `Weighing`, `Placed`, `Readied`, `Belonging`,
    `Immediate`, `ByHand`, `OfSpecAlone`.
    """

    def prepare(self) -> None:
        """Do once, before workers start, what they would otherwise all do (compile, check a licence)."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Everything that determines the answer, as JSON values; equal identities share one record."""

    def solve(self, request: Request) -> Answer:
        """Answer one request. A failed simulation is an `Answer`, not an exception."""

    def given_design(self, stage: str) -> list[dict[str, float]] | None:
        """The rows of levels this solver can answer for `stage`, or None if it answers any."""


@runtime_checkable
class Estimating(Protocol):
    """A solver that knows roughly what a run costs."""

    def cost_estimate(self, request: Request) -> float:
        """The seconds a run takes on one core, for plans."""


@runtime_checkable
class Timed(Estimating, Protocol):
    """A solver that can measure how fast this machine is for it."""

    def pace(self, request: Request) -> float | None:
        """What a run takes here over its estimate, by a moment of it; None where that cannot be tried now."""

    def preparing(self) -> float | None:
        """The seconds that `prepare` takes now; None where that is unknown."""


@runtime_checkable
class Weighing(Protocol):
    """A solver that knows how much memory a run takes."""

    def memory_estimate(self, request: Request) -> float:
        """The bytes that a process needs for a run."""


@runtime_checkable
class Placed(Protocol):
    """A solver that needs a folder for the files of its runs."""

    def placed(self, folder: Path) -> Solver:
        """Itself with a folder of the study."""


@runtime_checkable
class Readied(Protocol):
    """A solver whose every process does something before its first run, which counts against no time limit."""

    def get_ready(self) -> None:
        """Make this process ready."""


@runtime_checkable
class Belonging(Protocol):
    """A solver with settings that calibrated values belong to: with others the same values give another force."""

    def belongings(self, condition: float) -> dict[str, str]:
        """The settings by name, as they are at a stem diameter."""


def words_of(solver: Solver) -> Naming:
    """Return what a solver's study calls its responses and condition; the shear test's words where it does not tell."""
    naming: Naming = getattr(solver, "naming", CUTTING)
    return naming


class Immediate:
    """Inherited by a solver that answers in less time than a worker process takes to start."""


class ByHand:
    """Inherited by a solver whose runs people do: their results are entered as records, unless it knows them."""

    def knows(self, _request: Request) -> bool:
        """Whether it can answer a request without people."""
        return False

    def given(self, _stage: str) -> list[Any]:
        """Return what its answers of a stage are made from, as JSON values."""
        return []


class OfSpecAlone:
    """Inherited by a solver whose answers nothing determines but the spec and stemcal's own code."""
