"""The exceptions of stemcal, and the exit code of the command for each.

    StemcalError                1   any other failure
    ├── SpecError               2   the study spec is wrong; lists all mistakes with line and remedy
    ├── UsageError              2   an option or the order of commands is wrong
    ├── RunsFailed              3   too many simulations failed for a valid analysis
    ├── TargetUnreachable       4   the response surface does not reach the measured value in its region
    ├── FolderLocked            5   another process uses the study folder
    ├── Waiting                 6   results of manual runs are not entered yet; this is no failure
    └── SimulationFailed        1   a simulation cannot be trusted (NaN, inverted element, no contact)

They are caught in one place, `stemcal.cli.exit_codes`.
"""

import copyreg
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any


class StemcalError(Exception):
    """Base class of all failures; the message states the place, the value and the remedy."""

    exit_code = 1

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]:
        """Pickle message and attributes; the default would call `__init__` with the message as its only argument."""
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


@dataclass(frozen=True)
class SpecProblem:
    """A mistake in a spec: its place, a description and a remedy."""

    file: str
    line: int
    column: int
    path: str
    message: str
    remedy: str = ""

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}"
        subject = f" {self.path}:" if self.path else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{place}:{subject} {self.message}{remedy}"


class SpecError(StemcalError):
    """All mistakes found in a spec, in the order of its lines."""

    exit_code = 2

    def __init__(self, problems: list[SpecProblem]) -> None:
        self.problems = sorted(problems, key=lambda p: (p.line, p.column))
        super().__init__("\n".join(str(problem) for problem in self.problems))


class UsageError(StemcalError):
    """Raised if an option or argument is wrong, or an earlier stage has not run yet."""

    exit_code = 2


class RunsFailed(StemcalError):
    """Too many runs of a design failed; the message contains their number and the reasons."""

    exit_code = 3


class TargetUnreachable(StemcalError):
    """The target is outside the range `low` to `high` of the response surface in the experimental region."""

    exit_code = 4

    def __init__(self, target: float, low: float, high: float, unit_suffix: str = " N") -> None:
        self.target, self.low, self.high = target, low, high
        side = "above" if target > high else "below"
        super().__init__(
            f"the target {target:g}{unit_suffix} is {side} all values of the response surface in the experimental "
            f"region ({low:.4g} to {high:.4g}{unit_suffix}); widen the factor ranges or choose other factors"
        )


class FolderLocked(StemcalError):
    """Another process has locked the study folder."""

    exit_code = 5


class Waiting(StemcalError):
    """A stage needs results that a person must enter; `requests` are the known runs without a result."""

    exit_code = 6

    def __init__(self, stage: str, requests: Sequence[Any]) -> None:
        self.stage, self.requests = stage, tuple(requests)
        count = f"{len(requests)} result" + "s" * (len(requests) != 1)
        super().__init__(f"waiting for {count} from the {stage} stage; run `stemcal run SPEC` to write their sheet")


class SimulationFailed(StemcalError):
    """A run has no valid result: the simulation became unphysical, or a program wrote no readable result.

    `reason` is one word for tables: ``nan``, ``inverted``, ``time_step``, ``no_contact``, ``energy_drift``,
    ``contact_energy``, ``no_result``, ``bad_result``. `message` is a sentence with the time and the element.
    """

    def __init__(self, reason: str, message: str) -> None:
        self.reason = reason
        super().__init__(message)
