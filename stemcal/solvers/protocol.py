"""The interface of a solver: it returns the response at given levels and a given diameter or other condition."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Self

from stemcal.storage.encodings import in_a_line, visible
from stemcal.vocabulary import CUTTING, Vocabulary


@dataclass(frozen=True)
class Request:
    """One requested run: the stage that requests it, and the row of the stage's design, from 0.

    levels      value of every factor in the units of the spec
    condition   outer diameter of the stem, mm, or the condition declared by the study, in its unit
    pictured    whether the answer should contain the data for pictures of the run, if the solver can
    replicate   number of this simulation of the same levels, from 1; 0 if there is only one. A numbered run is random:
                its answer also depends on its stage and row.
    """

    stage: str
    row: int
    levels: Mapping[str, float]
    condition: float
    pictured: bool = False
    replicate: int = 0

    def as_record(self) -> dict[str, Any]:
        """Return it as stored in a record: the replicate only if there are several."""
        fields = {**vars(self), "levels": dict(self.levels), "replicate": self.replicate or None}
        return {name: value for name, value in fields.items() if value is not None}


NOT_RUN = "not_run"  # the reason of a run that could not be done by hand
MOST_MESSAGE = 5000  # characters
RESPONSES = "responses"  # among the details of an answer: further responses by name


@dataclass(frozen=True)
class Answer:
    """The outcome of a request: a force in N, or a status and the reason why there is none.

    If the study declares responses, `response` is the first of them, in its unit; details contain the others.
    """

    status: str
    response: float | None = None
    reason: str = ""
    message: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether the force may be used in an analysis."""
        return self.status == "ok"

    def readable(self) -> Self:
        """Return it without control characters in its texts, which may come from a program, at limited length."""
        more = "…" * (len(self.message) > MOST_MESSAGE)
        return replace(self, reason=in_a_line(self.reason)[:100], message=visible(self.message[:MOST_MESSAGE]) + more)


class Solver:
    """One way to answer requests, by `identity` and `solve` of a subclass; pickled to worker processes."""

    immediate: ClassVar[bool] = False
    """Whether the solver answers faster than a worker process can start."""
    asks_people: ClassVar[bool] = False
    """Whether the runs are performed by hand. Their results are entered as records, unless it `has_result`."""
    of_spec_alone: ClassVar[bool] = False
    """Whether the answers depend only on the spec and on the stemcal code."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Return everything that determines the answer, as JSON values; equal identities share one record."""
        raise NotImplementedError

    def solve(self, request: Request) -> Answer:
        """Answer one request, also for a failed simulation; raise `Waiting` for a run by hand that is not done yet."""
        raise NotImplementedError

    def prepare(self) -> None:
        """Do the work that all workers would otherwise repeat (compile, check a licence), before they start."""

    def get_ready(self) -> None:
        """Prepare this process for its first run; this time does not count towards a time limit."""

    def placed(self, _folder: Path) -> Self:
        """Return the solver with a folder of the study for the files of its runs."""
        return self

    def given_design(self, _stage: str) -> list[dict[str, float]] | None:
        """Return the rows of levels that it can answer for a stage; None if it can answer any."""
        return None

    def has_result(self, _request: Request) -> bool:
        """Whether it has the answer to a request without a run."""
        return False

    def given(self, _stage: str) -> list[Any]:
        """Return the inputs of its known answers of a stage, as JSON values."""
        return []

    def write_inputs(self, _place: Path, _name: str, _request: Request) -> None:
        """Write the input files of a run by hand into a folder with this name."""

    def cost_estimate(self, _request: Request) -> float | None:
        """Return the approximate seconds of a run on one core; None if unknown."""
        return None

    def cost_by_test(self, _request: Request) -> dict[str, float]:
        """Return the approximate seconds of each test of a run on one core; nothing if unknown."""
        return {}

    def memory_estimate(self, _request: Request) -> float | None:
        """Return the bytes that a process needs for a run; None if unknown."""
        return None

    def preparing(self) -> bool:
        """Check for a long `prepare`."""
        return False

    def settings_that_matter(self, _condition: float) -> dict[str, str] | None:
        """Return the settings at a stem diameter on which calibrated values depend, by name; None if there are none."""
        return None

    @property
    def naming(self) -> Vocabulary:
        """The names of responses and condition in the study."""
        naming: Vocabulary = self.study.naming if hasattr(self, "study") else CUTTING
        return naming
