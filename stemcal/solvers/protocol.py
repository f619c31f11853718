"""What the workflow asks of a solver: these levels, this diameter, which force? Or what a study has in their place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

from stemcal.files.reading import in_a_line, visible
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
        Whether the answer should contain the data for pictures of the run, if the solver can.
    replicate : int
        Which of the simulations of the same levels it is, from 1; 0 where there is one only. A numbered run is drawn
        by chance: its answer also depends on its stage and row.
    """

    stage: str
    row: int
    levels: Mapping[str, float]
    condition: float
    pictured: bool = False
    replicate: int = 0

    def as_record(self) -> dict[str, Any]:
        """Return it as a record holds it: the replicate only where there are several."""
        fields = {**vars(self), "levels": dict(self.levels), "replicate": self.replicate or None}
        return {name: value for name, value in fields.items() if value is not None}


NOT_RUN = "not_run"  # the reason of a run that could not be done by hand
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


class Solver:
    """One way to answer requests. Instances are pickled to worker processes.

    A subclass gives `identity` and `solve`, and overrides further abilities.
    """

    immediate: ClassVar[bool] = False
    """Whether it answers in less time than a worker process takes to start."""
    asks_people: ClassVar[bool] = False
    """Whether people do its runs: their results are entered as records, unless it `knows` them."""
    of_spec_alone: ClassVar[bool] = False
    """Whether nothing determines its answers but the spec and stemcal's own code."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Return everything that determines the answer, as JSON values; equal identities share one record."""
        raise NotImplementedError

    def solve(self, request: Request) -> Answer:
        """Answer one request. A failed simulation is an `Answer`, not an exception."""
        raise NotImplementedError

    def prepare(self) -> None:
        """Do once, before workers start, what they would otherwise all do (compile, check a licence)."""

    def get_ready(self) -> None:
        """Make this process ready for its first run, which counts against no time limit."""

    def placed(self, _folder: Path) -> Solver:
        """Return the solver with a folder of the study for the files of its runs."""
        return self

    def given_design(self, _stage: str) -> list[dict[str, float]] | None:
        """Return the rows of levels that it can answer for a stage, None if it answers any."""
        return None

    def knows(self, _request: Request) -> bool:
        """Whether it has the answer to a request without a run."""
        return False

    def given(self, _stage: str) -> list[Any]:
        """Return what its known answers of a stage are made from, as JSON values."""
        return []

    def write_inputs(self, _place: Path, _name: str, _request: Request) -> None:
        """Write what people need for a run into a folder of that name."""

    def cost_estimate(self, _request: Request) -> float | None:
        """Return the seconds that a run takes on one core, roughly; None where that is unknown."""
        return None

    def memory_estimate(self, _request: Request) -> float | None:
        """Return the bytes that a process needs for a run; None where that is unknown."""
        return None

    def pace(self, _request: Request) -> float | None:
        """Return what a run takes here over its estimate, by a moment of it; None where that cannot be tried now."""
        return None

    def preparing(self) -> bool:
        """Return whether `prepare` takes a while now."""
        return False

    def belongings(self, _condition: float) -> dict[str, str] | None:
        """Return the settings on which calibrated values depend, by name, as they are at a stem diameter.

        With others the same values give another force. None where there are none, or they are unknown.
        """
        return None

    @property
    def naming(self) -> Naming:
        """What its study calls responses and condition."""
        naming: Naming = self.study.naming if hasattr(self, "study") else CUTTING
        return naming
