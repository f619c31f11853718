"""What can go wrong, and the exit code each kind ends the command with.

    StemcalError                1   anything we could name but not file below
    ├── SpecError               2   the study spec is wrong: every problem at once, with line and remedy
    ├── UsageError              2   an option or the order of commands is wrong
    ├── RunsFailed              3   too many simulations failed for the analysis to mean anything
    ├── TargetUnreachable       4   no point of the design region gives the measured value
    ├── FolderLocked            5   another process works in the study folder
    ├── Waiting                 6   runs are done by hand, and their results are not entered yet: no failure
    └── SimulationFailed        1   one simulation cannot be trusted (NaN, inverted element, no contact)

They are caught once, in `stemcal.cli.guard`.
"""

import copyreg
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any


class StemcalError(Exception):
    """A failure with a message fit for the user: place, value, remedy."""

    exit_code = 1

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]:
        """Pickle and copy the text and the attributes: `__init__` often takes other arguments than the text."""
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


@dataclass(frozen=True)
class SpecProblem:
    """One mistake in a spec: its place, what is wrong, what to do."""

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
    """Every problem found in a spec, in the order of its lines."""

    exit_code = 2

    def __init__(self, problems: list[SpecProblem]) -> None:
        self.problems = sorted(problems, key=lambda p: (p.line, p.column))
        super().__init__("\n".join(str(problem) for problem in self.problems))


class UsageError(StemcalError):
    """An option has no sense here, or an earlier stage has not run yet."""

    exit_code = 2


class RunsFailed(StemcalError):
    """Too few runs of a design succeeded; the message counts them and gives their reasons."""

    exit_code = 3


class TargetUnreachable(StemcalError):
    """The surface does not take the target value anywhere in the allowed region; `unit_suffix` follows the values."""

    exit_code = 4

    def __init__(self, target: float, low: float, high: float, unit_suffix: str = " N") -> None:
        self.target, self.low, self.high = target, low, high
        side = "above" if target > high else "below"
        super().__init__(
            f"the target {target:g}{unit_suffix} is {side} all values of the response surface in the experimental "
            f"region ({low:.4g} to {high:.4g}{unit_suffix}); widen the factor ranges or choose other factors"
        )


class FolderLocked(StemcalError):
    """Another process holds the study folder."""

    exit_code = 5


class Waiting(StemcalError):
    """A stage cannot go on without results that somebody has to bring.

    `requests` are the runs (`solvers.protocol.Request`) that the stage is waiting for, as far as they are known.
    """

    exit_code = 6

    def __init__(self, stage: str, requests: Sequence[Any]) -> None:
        self.stage, self.requests = stage, tuple(requests)
        count = f"{len(requests)} result" + "s" * (len(requests) != 1)
        super().__init__(
            f"waiting for {count} from the {stage} stage; run `stemcal run SPEC` to write the sheet for these runs"
        )


class SimulationFailed(StemcalError):
    """A run has no result: its state was no longer physical, or a program left none that can be read.

    `reason` is one word for tables: ``nan``, ``inverted``, ``time_step``, ``no_contact``, ``energy_drift``,
    ``contact_energy``, ``no_result``, ``bad_result``. `message` is the sentence for people, with time and element.
    """

    def __init__(self, reason: str, message: str) -> None:
        self.reason = reason
        super().__init__(message)
