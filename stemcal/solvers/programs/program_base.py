"""A run of a program from beginning to end: its folder, its inputs, the process or processes, what it leaves."""

import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Self

from stemcal.errors import SimulationFailed, UsageError
from stemcal.files.durable import write_atomic
from stemcal.naming import Naming
from stemcal.processes import Ended, run_program
from stemcal.solvers.options import ProgramOptions
from stemcal.solvers.programs.inputs import OUTPUT, Inputs, discard, run_folder
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.study.model import Study
from stemcal.study.types.placeholders import fill

# Characters of a program's last output that a record keeps.
_KEPT_OUTPUT = 2000


@dataclass(frozen=True)
class Program(Solver, ABC):
    """Answers requests by running a program in its own folder.

    A kind of program defines its input files, how a run is written and made, and what next to the files
    determines an answer.

    Parameters
    ----------
    study : Study
    place : path, optional
        Where run folders are made; among the temporary files by default.
    """

    study: Study
    place: Path | None = None
    inputs: Inputs = field(init=False)

    revision: ClassVar[int] = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", self._inputs())

    @property
    def options(self) -> ProgramOptions:
        """The keys of the program in the spec."""
        assert isinstance(self.study.solver, ProgramOptions)
        return self.study.solver

    @property
    def naming(self) -> Naming:
        """What the study calls what is asked and answered."""
        return self.study.naming

    def placed(self, place: Path) -> Self:
        """Return the same solver with its run folders below `place`."""
        return replace(self, place=place)

    @abstractmethod
    def prepare(self) -> None:
        """Refuse to begin if the program is not there."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Return everything that determines the answer: the files' content, how the program runs and is read."""
        options = self.options
        return {
            "solver": self.study.solver.kind,
            "revision": self.revision,
            "environment": dict(options.environment),
            "inputs": self.inputs.identity(),
            **self._determining(request),
            "levels": dict(request.levels),
            **({"curves": asdict(modes)} if (modes := self.study.targets.modes_at(request.condition)) else {}),
            **({} if self.naming.condition is None else {"condition": request.condition}),
            **({"replicate": request.replicate} if request.replicate else {}),
        }

    def solve(self, request: Request) -> Answer:
        """Run the program for a request; its folder is kept if it fails."""
        folder = run_folder(self.place, self.identity(request))
        try:
            self._write(folder, request)
        except SimulationFailed as failure:
            return Answer("failed", reason=failure.reason, message=f"{failure} ({folder})")
        answer = self._run(folder, request)
        if answer.ok:
            discard(folder)
        return answer

    @abstractmethod
    def _inputs(self) -> Inputs:
        """Take note of the files that runs need."""

    @abstractmethod
    def _determining(self, request: Request) -> dict[str, Any]:
        """Return further data that determine an answer."""

    @abstractmethod
    def _write(self, folder: Path, request: Request) -> None:
        """Put what a run needs into its folder."""

    @abstractmethod
    def _run(self, folder: Path, request: Request) -> Answer:
        """Run what is in the folder and return its answer, or why there is none."""


def executable(program: str, folder: Path, key: str = "command") -> str:
    """Return the full path of a program: one on PATH, or, if it is written with a folder, one next to the spec.

    Raises
    ------
    UsageError
        If there is none.
    """
    by_path = "/" in program or "\\" in program
    found = shutil.which(str(folder / program) if by_path else program)
    if found is None:
        where = f"in {folder}" if by_path else "on PATH"
        raise UsageError(f"solver.{key}: there is no program {program!r} {where}; install it or correct its name")
    return str(Path(found).absolute())


def run_command(
    folder: Path,
    command: Sequence[str],
    options: ProgramOptions,
    place: Path,
    values: Mapping[str, str],
    read: Callable[[Ended], Answer],
) -> Answer:
    """Run a command of a spec in the folder `place`, its placeholders filled with `values`; see `run_in`."""
    program, *arguments = command
    filled = [fill(argument.encode(), values).decode() for argument in arguments]
    return run_in(folder, [executable(program, place), *filled], options, read)


def run_in(
    folder: Path,
    command: Sequence[str],
    options: ProgramOptions,
    read: Callable[[Ended], Answer],
    seconds: float | None = None,
    check: Callable[[Ended], None] | None = None,
) -> Answer:
    """Run a command in `folder` and return what `read(ended)` makes of it, or why there is no result.

    It may take `seconds`, all of the time limit by default. `check` raises if it ended badly; without it that
    is an exit code other than 0.
    """
    try:
        ended = run_program(command, folder, options.environment, options.time_limit if seconds is None else seconds)
    except OSError as error:
        return Answer("failed", reason="not_started", message=f"{command[0]}: {error.strerror or error}")
    write_atomic(folder / OUTPUT, ended.output)
    details: dict[str, Any] = {"exit_code": ended.code, "program_seconds": round(ended.seconds, 3)}
    try:
        if ended.timed_out:
            raise SimulationFailed("timeout", f"terminated after {options.time_limit:g} s (solver.time_limit)")
        (check or code_is_zero)(ended)
        answer = read(ended)
    except SimulationFailed as failure:
        details["output"] = ended.output[-_KEPT_OUTPUT:]
        return Answer("failed", reason=failure.reason, message=f"{failure} ({folder})", details=details)
    return replace(answer, details={**details, **answer.details})


def code_is_zero(ended: Ended) -> None:
    """Raise `SimulationFailed` if a program ended with another code than 0."""
    if ended.code < 0:
        raise SimulationFailed("exit_code", f"the program was terminated by signal {-ended.code}")
    if ended.code != 0:
        last = next((line.strip() for line in reversed(ended.output.splitlines()) if line.strip()), "")
        said = f": {last[:200]}" if last else ""
        raise SimulationFailed("exit_code", f"the program ended with exit code {ended.code}{said}")
