"""A run of any program from beginning to end: templates, process, result."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from stemcal.errors import SimulationFailed, UsageError
from stemcal.solvers.command.readers import read_number
from stemcal.solvers.command.reductions import NoResult
from stemcal.solvers.command.rooms import OUTPUT, discard, run_folder
from stemcal.solvers.command.templates import Inputs, values_of
from stemcal.solvers.processes import Ended, run_program
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.model import Study
from stemcal.study.outside import CommandSolver
from stemcal.study.placeholders import fill

__all__ = ["Command", "checked", "executable", "run_in"]

REVISION = 1
# Characters of a program's last output that a record keeps.
_KEPT_OUTPUT = 2000


@dataclass(frozen=True)
class Command:
    """Answers requests by running a program in a folder of its own; see `study.outside.CommandSolver`.

    Parameters
    ----------
    study : Study
    place : path, optional
        Where run folders are made; among the temporary files by default.
    """

    study: Study
    place: Path | None = None
    inputs: Inputs = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", Inputs.of(self.options.templates, self.options.files))

    @property
    def options(self) -> CommandSolver:
        """What the spec says of the program."""
        assert isinstance(self.study.solver, CommandSolver)
        return self.study.solver

    def placed(self, place: Path) -> Command:
        """Return the same solver with its run folders below `place`."""
        return replace(self, place=place)

    def prepare(self) -> None:
        """Refuse to begin if the program is not there."""
        executable(self.options.command[0], self.study.source.parent)

    def identity(self, request: Request) -> dict[str, Any]:
        """Return everything that determines the answer: the files' content, the command, how the result is read."""
        options = self.options
        return {
            "solver": "command",
            "revision": REVISION,
            "version": options.version,
            "command": list(options.command),
            "environment": dict(options.environment),
            "inputs": self.inputs.identity(),
            "result": options.result.model_dump(mode="json"),
            "levels": dict(request.levels),
            "diameter": request.diameter,
        }

    def given_design(self, _stage: str) -> list[dict[str, float]] | None:
        """Return None: any levels can be written into the templates."""
        return None

    def solve(self, request: Request) -> Answer:
        """Run the program for a request; its folder is kept if it fails."""
        folder = run_folder(self.place, self.identity(request))
        try:
            self.inputs.write(folder, values_of(request))
        except SimulationFailed as failure:
            return Answer("failed", reason=failure.reason, message=f"{failure} ({folder})")
        answer = run_in(folder, self._command(request), self.options, lambda _: self._read(folder))
        if answer.ok and self.options.keep == "failed":
            discard(folder)
        return answer

    def _command(self, request: Request) -> list[str]:
        """Return the program and its arguments, values in place of placeholders."""
        program, *arguments = self.options.command
        values = values_of(request)
        filled = [fill(argument.encode(), values).decode() for argument in arguments]
        return [executable(program, self.study.source.parent), *filled]

    def _read(self, folder: Path) -> Answer:
        return Answer("ok", force=read_number(self.options.result, folder))


def executable(program: str, folder: Path) -> str:
    """Return the full path of a program: one on PATH, or, if it is written with a folder, one beside the spec.

    Raises
    ------
    UsageError
        If there is none.
    """
    by_path = "/" in program or "\\" in program
    found = shutil.which(str(folder / program) if by_path else program)
    if found is None:
        where = f"in {folder}" if by_path else "on PATH"
        raise UsageError(f"solver.command: there is no program {program!r} {where}; install it or correct its name")
    return str(Path(found).absolute())


def run_in(folder: Path, command: Sequence[str], options: Any, read: Any) -> Answer:
    """Run a command in `folder` and return what `read(ended)` makes of it, or why there is no result."""
    try:
        ended = run_program(command, folder, options.environment, options.time_limit)
    except OSError as error:
        return Answer("failed", reason="not_started", message=f"{command[0]}: {error.strerror or error}")
    (folder / OUTPUT).write_text(ended.output, encoding="utf-8", newline="")
    details = {"exit_code": ended.code, "program_seconds": round(ended.seconds, 3)}
    try:
        checked(ended, options.time_limit)
        answer: Answer = read(ended)
    except (NoResult, SimulationFailed) as failure:
        return Answer("failed", reason=failure.reason, message=f"{failure} ({folder})", details=_told(details, ended))
    return replace(answer, details={**details, **answer.details})


def checked(ended: Ended, time_limit: float) -> None:
    """Raise `NoResult` if a program was stopped or ended with another code than 0."""
    if ended.timed_out:
        raise NoResult("timeout", f"ended after {time_limit:g} s, its solver.time_limit")
    if ended.code < 0:
        raise NoResult("exit_code", f"the program was ended by signal {-ended.code}")
    if ended.code != 0:
        last = next((line.strip() for line in reversed(ended.output.splitlines()) if line.strip()), "")
        said = f": {last[:200]}" if last else ""
        raise NoResult("exit_code", f"the program ended with exit code {ended.code}{said}")


def _told(details: Mapping[str, Any], ended: Ended) -> dict[str, Any]:
    return {**details, "output": ended.output[-_KEPT_OUTPUT:]}
