"""Solvers that run a program: make the run folder, write the input files, run the program, read the result."""

import hashlib
import shutil
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar, cast

from stemcal.errors import SimulationFailed, UsageError
from stemcal.notes import Note, Remedy
from stemcal.processes.program import ProgramRun, run_program
from stemcal.solvers.imported import imported_files
from stemcal.solvers.kept_curve import curve_scores, kept_curve
from stemcal.solvers.options import CommandSolver, ProgramOptions
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.solvers.readers import read_curve, read_number, require_end, still_rising
from stemcal.solvers.replicates import seed_of, values_of
from stemcal.storage.atomic import make_folder, write_atomic
from stemcal.storage.canonical import key_of
from stemcal.storage.plain import open_plain
from stemcal.storage.typed import to_json
from stemcal.study.model.study import Study
from stemcal.study.types.named import fill, template_bytes
from stemcal.vocabulary import FIRST

O = TypeVar("O", bound=ProgramOptions)
OUTPUT = "program-output.txt"
_ENDED = "The extreme value is the last number of the result. The simulation may have ended before the true one."
_AT_END = Note("largest_at_end", "warning", _ENDED, Remedy("Use a longer stroke, or `ends_with` if it stops early."))


@dataclass(frozen=True)
class Inputs:
    """The input files of a run, each with its hash at the time when the study was read.

    templates   files in which placeholders are replaced
    files       files that are copied unchanged
    named       files that are not copied because the command contains their paths, such as scripts
    """

    templates: Mapping[Path, str]
    files: Mapping[Path, str]
    named: Mapping[Path, str] = field(default_factory=dict)

    @classmethod
    def of(cls, templates: Sequence[Path], files: Sequence[Path], named: Sequence[Path] = ()) -> Self:
        """Return the inputs with the hashes of the files as they are now."""
        return cls(*({path: file_hash(path) for path in paths} for paths in (templates, files, named)))

    def identity(self) -> dict[str, str]:
        """Return the hash of each file by its name."""
        copied = {path.name: sha256 for path, sha256 in {**self.templates, **self.files}.items()}
        return copied | {f"command {number}: {path.name}": self.named[path] for number, path in enumerate(self.named)}

    def write(self, folder: Path, values: Mapping[str, str]) -> None:
        """Write the input files of a run; raise `SimulationFailed` if one has changed since the study was read."""
        for path, sha256 in {**self.templates, **self.files, **self.named}.items():
            if not path.is_file() or file_hash(path) != sha256:
                raise SimulationFailed("input_changed", f"{path.name} has changed since the study was started")
        for path in self.templates:
            (folder / path.name).write_bytes(fill(template_bytes(path), values))
        for path in self.files:
            shutil.copyfile(path, folder / path.name)


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file."""
    try:
        with open_plain(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; specify an existing file") from None


def run_folder(place: Path | None, identity: Mapping[str, Any]) -> Path:
    """Make an empty folder for a run: below `place`, named by the record key; without `place`, a temporary folder."""
    if place is None:
        return Path(tempfile.mkdtemp(prefix="stemcal-run-"))
    folder = make_folder(place) / key_of(identity)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


_KEPT_OUTPUT = 2000  # characters of the output of a failed program that are stored in the record


@dataclass(frozen=True)
class Program(Solver, ABC, Generic[O]):
    """Base class of solvers that run a program in a separate folder for each run, below `place` or a temporary folder.

    A subclass writes the input files, runs the program, and lists the other data that determine an answer.
    """

    study: Study
    place: Path | None = None
    inputs: Inputs = field(init=False)

    revision: ClassVar[int] = 1

    def __post_init__(self) -> None:
        options = cast(Any, self.study.solver)
        named = scripts_in(options.command, self.study.source.resolve().parent)
        object.__setattr__(self, "inputs", Inputs.of(getattr(options, "templates", ()), options.files, named))

    @property
    def options(self) -> O:
        return cast(O, self.study.solver)

    def placed(self, place: Path) -> Self:
        return replace(self, place=place)

    @abstractmethod
    def prepare(self) -> None:
        """Raise `UsageError` if the program is not installed."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Return all data that determine the answer: content of the files, command, environment, result readers."""
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
        """Run the program for a request; keep the run folder if the run fails."""
        folder = run_folder(self.place, self.identity(request))
        try:
            self._write(folder, request)
        except SimulationFailed as failure:
            return Answer("failed", reason=failure.reason, message=f"{failure} ({folder})")
        answer = self._run(folder, request)
        if answer.ok:
            shutil.rmtree(folder, ignore_errors=True)  # Windows cannot delete files that another program has open
        return answer

    @abstractmethod
    def _determining(self, request: Request) -> dict[str, Any]: ...

    @abstractmethod
    def _write(self, folder: Path, request: Request) -> None: ...

    @abstractmethod
    def _run(self, folder: Path, request: Request) -> Answer: ...


def executable(program: str, folder: Path) -> str:
    """Return the full path of a program: on PATH or, if its name contains a slash, relative to `folder`.

    Raises `UsageError` for the key `solver.command` if there is no such program.
    """
    by_path = "/" in program or "\\" in program
    path = shutil.which(str(folder / program) if by_path else program)
    if path is None:
        where = f"in {folder}" if by_path else "on PATH"
        missing = f"the program {program!r} was not found {where}"
        raise UsageError(f"solver.command: {missing}; install the program or correct its name")
    return str(Path(path).absolute())


# Extensions of scripts. Unlike an installed program, a script may be changed during a study.
_SCRIPTS = frozenset({".py", ".sh", ".bat", ".cmd", ".ps1", ".pl", ".rb", ".m", ".r", ".jl", ".tcl", ".js", ".lua"})


def scripts_in(command: Sequence[str], folder: Path) -> list[Path]:
    """Return the files in a command whose content affects a run: scripts, the modules they import, files in `folder`.

    The program may be relative to `folder`; other paths are absolute, since each run has a separate folder.
    """
    program, *arguments = command or ("",)
    places = [folder / program] if "/" in program or "\\" in program else []
    texts = [text for argument in arguments for text in (argument, argument.rpartition("=")[2])]
    places += [path for path in map(Path, texts) if path.is_absolute()]
    files: list[Path] = []
    for path in places:
        with suppress(OSError, ValueError):  # the argument is not a valid file name on this system
            if path.is_file() and (path.suffix.lower() in _SCRIPTS or path.resolve().is_relative_to(folder)):
                files += [path, *imported_files(path, [path.parent])]
    return list(dict.fromkeys(files))


def run_command(
    folder: Path,
    command: Sequence[str],
    options: ProgramOptions,
    place: Path,
    values: Mapping[str, str],
    read: Callable[[ProgramRun], Answer],
) -> Answer:
    """Run a command of a spec by `run_in`; `values` replace its placeholders, `place` is the folder of the spec."""
    program, *arguments = command
    filled = [fill(argument.encode(), values).decode() for argument in arguments]
    return run_in(folder, [executable(program, place), *filled], options, read)


def run_in(
    folder: Path,
    command: Sequence[str],
    options: ProgramOptions,
    read: Callable[[ProgramRun], Answer],
    seconds: float | None = None,
) -> Answer:
    """Run a command, at most for `seconds` (default: time limit of the spec); return the answer that `read` returns."""
    try:
        finished = run_program(command, folder, options.environment, options.time_limit if seconds is None else seconds)
    except OSError as error:
        return Answer("failed", reason="not_started", message=f"{command[0]}: {error.strerror or error}")
    write_atomic(folder / OUTPUT, finished.output)
    details: dict[str, Any] = {"exit_code": finished.code, "program_seconds": round(finished.seconds, 3)}
    try:
        if finished.timed_out:
            limit = f"{options.time_limit:g} s (`solver.time_limit`)"
            raise SimulationFailed("timeout", f"the program was terminated after {limit}")
        answer = read(finished)
    except SimulationFailed as failure:
        details["output"] = finished.output[-_KEPT_OUTPUT:]
        return Answer("failed", reason=failure.reason, message=f"{failure} ({folder})", details=details)
    return replace(answer, details={**details, **answer.details})


def code_is_zero(finished: ProgramRun) -> None:
    """Raise `SimulationFailed` if the exit code of a program is not 0."""
    if finished.code < 0:
        raise SimulationFailed("exit_code", f"the program was terminated by signal {-finished.code}")
    if finished.code != 0:
        last = next((f": {text.strip()[:200]}" for text in reversed(finished.output.splitlines()) if text.strip()), "")
        raise SimulationFailed("exit_code", f"the program finished with exit code {finished.code}{last}")


_IF_WRITTEN = {"ends_with"}  # keys that are in a record only if the spec has them, so that older records remain valid


@dataclass(frozen=True)
class Command(Program[CommandSolver]):
    """Answers requests by running any program; see `solvers.options.CommandSolver`."""

    def prepare(self) -> None:
        executable(self.options.command[0], self.study.source.parent)

    def _determining(self, request: Request) -> dict[str, Any]:
        options = self.options
        drawn = {"seed": seed_of(request)} if request.replicate else {}
        readers = options.result.items()
        result = {name: r.model_dump(mode="json", exclude=_IF_WRITTEN - r.model_fields_set) for name, r in readers}
        return {"command": list(options.command), "result": result, **drawn}

    def _write(self, folder: Path, request: Request) -> None:
        self.inputs.write(folder, self._values(request))

    def _values(self, request: Request) -> Mapping[str, str]:
        return values_of(request, seed_of(request), self.study.naming)

    def _run(self, folder: Path, request: Request) -> Answer:
        place, values = self.study.source.parent, self._values(request)
        read = partial(self._read, folder, request)
        return run_command(folder, self.options.command, self.options, place, values, read)

    def _read(self, folder: Path, request: Request, finished: ProgramRun) -> Answer:
        code_is_zero(finished)
        naming = self.study.naming
        for reader in self.options.result.values():
            require_end(reader, folder, finished.output)
        numbers = {name: read_number(reader, folder) for name, reader in self.options.result.items()}
        name = naming.response.name if naming.response.name in numbers else FIRST
        first, rising = numbers.pop(name), still_rising(self.options.result[name], folder)
        modes, curve = self.study.targets.modes_at(request.condition), {}
        if modes is not None and FIRST in self.options.result:
            travel, force = read_curve(self.options.result[FIRST], folder)
            numbers |= curve_scores(modes, travel, force)
            curve = {"curve": kept_curve(travel, force)}
        limited = {"stroke_was_enough": False, "warnings": to_json([_AT_END])} if rising else {}
        return Answer("ok", response=first, details={**({RESPONSES: numbers} if numbers else {}), **curve, **limited})
