"""The interface of a solver: it returns the response at given factor levels and a given diameter (or condition)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Self

from stemcal.storage.encodings import in_a_line, visible
from stemcal.vocabulary import CUTTING, Vocabulary


@dataclass(frozen=True)
class Request:
    """A requested run.

    stage       name of the stage that requests the run
    row         number of the run in the design of the stage, from 0
    levels      value of every factor in the units of the spec
    condition   outer diameter of the stem, mm, or the condition declared by the study, in its unit
    pictured    whether the solver should store data for pictures of the run, if it can
    replicate   number of the simulation at the same levels, from 1; 0 for a deterministic solver. The seed of a
                numbered simulation also depends on stage and row.
    """

    stage: str
    row: int
    levels: Mapping[str, float]
    condition: float
    pictured: bool = False
    replicate: int = 0

    def as_record(self) -> dict[str, Any]:
        """Return the request as stored in a record, without `replicate` if it is 0."""
        fields = {**vars(self), "levels": dict(self.levels), "replicate": self.replicate or None}
        return {name: value for name, value in fields.items() if value is not None}


NOT_RUN = "not_run"  # reason of a failed manual run
_MOST_MESSAGE = 5000  # largest number of characters of a message
RESPONSES = "responses"  # key in the details of an answer: its further responses by name


@dataclass(frozen=True)
class Answer:
    """The answer to a request: status ``ok`` with a response, or ``failed`` with a reason and a message.

    The response is the force in N, or the first declared response in its unit. The details contain further responses.
    """

    status: str
    response: float | None = None
    reason: str = ""
    message: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether the run succeeded, so that its response may be used in an analysis."""
        return self.status == "ok"

    def readable(self) -> Self:
        """Return the answer with shortened texts and without control characters, which a program may have printed."""
        more = "…" * (len(self.message) > _MOST_MESSAGE)
        return replace(self, reason=in_a_line(self.reason)[:100], message=visible(self.message[:_MOST_MESSAGE]) + more)


class Solver:
    """Base class of solvers. Subclasses define `identity` and `solve`. A solver is pickled for worker processes."""

    immediate: ClassVar[bool] = False
    """Whether the solver answers faster than a worker process can start."""
    asks_people: ClassVar[bool] = False
    """Whether people perform the runs and enter their results; `solve` answers only those with `has_result`."""
    of_spec_alone: ClassVar[bool] = False
    """Whether the answers depend only on the spec and on the stemcal code."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Return all data that determine the answer, as JSON values; requests with equal identities share a record."""
        raise NotImplementedError

    def solve(self, request: Request) -> Answer:
        """Answer one request, even if the simulation fails; raise `Waiting` for a manual run that is not done yet."""
        raise NotImplementedError

    def prepare(self) -> None:
        """Do the work that each worker would otherwise repeat, such as compiling, before the workers start."""

    def get_ready(self) -> None:
        """Prepare the current process for its first run; this time does not count towards the time limit."""

    def placed(self, _folder: Path) -> Self:
        """Return a copy of the solver that keeps the files of its runs in a folder."""
        return self

    def given_design(self, _stage: str) -> list[dict[str, float]] | None:
        """Return the design of a stage (levels of each row) in the sheet `solver.file`; None without such a sheet."""
        return None

    def has_result(self, _request: Request) -> bool:
        """Whether the answer to a request is known without a run."""
        return False

    def table_of(self, _stage: str) -> list[Any]:
        """Return the rows of a stage in the sheet `solver.file`, with levels and known answers, as JSON values."""
        return []

    def write_inputs(self, _place: Path, _name: str, _request: Request) -> None:
        """Write the input files of a manual run to the folder `name` below `place`."""

    def cost_estimate(self, _request: Request) -> float | None:
        """Return the approximate seconds of a run on one core; None if unknown."""
        return None

    def cost_by_test(self, _request: Request) -> dict[str, float]:
        """Return the approximate seconds of each test of a run on one core; empty if unknown."""
        return {}

    def memory_estimate(self, _request: Request) -> float | None:
        """Return the bytes that a process needs for a run; None if unknown."""
        return None

    def preparing(self) -> bool:
        """Whether `prepare` will take a long time."""
        return False

    def settings_that_matter(self, _condition: float) -> dict[str, str] | None:
        """Return the settings (by name) on which parameters calibrated at a diameter depend; None if there are none."""
        return None

    @property
    def naming(self) -> Vocabulary:
        """The names of responses and condition in the study."""
        naming: Vocabulary = self.study.naming if hasattr(self, "study") else CUTTING
        return naming
