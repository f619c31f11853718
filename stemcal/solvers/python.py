"""A solver that calls a class in a Python file next to the spec."""

import importlib.util
import inspect
import math
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.machinery import SourceFileLoader
from numbers import Real
from pathlib import Path
from typing import Any, Self

from stemcal.errors import SimulationFailed, UsageError
from stemcal.processes.child import ChildDied, computed_apart
from stemcal.processes.limits import RunTimedOut
from stemcal.registry import ForeignError, contained
from stemcal.solvers.imported import imported_files
from stemcal.solvers.options import PythonSolver
from stemcal.solvers.program import file_hash
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.solvers.replicates import seed_of
from stemcal.study.model.study import Study


@dataclass(frozen=True)
class PythonClass(Solver):
    """Answers requests by calling a class in a Python file.

    code     hash of the file when the study was read
    inputs   hashes, by path, of its data files and of the modules that it imports from the folders of file and spec
    """

    study: Study
    code: str
    inputs: Mapping[Path, str]

    @classmethod
    def of(cls, study: Study) -> Self:
        """Return the solver of a study, with the hashes of the current content of its files."""
        assert isinstance(study.solver, PythonSolver)
        file = study.solver.file
        traced = [file, *study.solver.files]
        inputs = {module for path in traced for module in imported_files(path, [path.parent, *_roots(study)])}
        inputs = (inputs | set(study.solver.files)) - {file}
        return cls(study, file_hash(file), {path: file_hash(path) for path in sorted(inputs)})

    @property
    def options(self) -> PythonSolver:
        assert isinstance(self.study.solver, PythonSolver)
        return self.study.solver

    def prepare(self) -> None:
        """Load the class in a separate process, which writes no bytecode; raise `UsageError` if this fails."""
        try:
            computed_apart(self._try, self.options.time_limit, {"PYTHONDONTWRITEBYTECODE": "1"})
        except ChildDied as problem:
            raise _cannot_be_loaded(self.options, f"the process ended with {problem}") from None
        except RunTimedOut as problem:
            raise _cannot_be_loaded(self.options, f"loading took longer than {problem.limit:g} s") from None
        except SimulationFailed as problem:
            raise UsageError(f"solver.file {self.options.file.name}: {problem}") from None
        except RuntimeError as problem:  # the class has raised KeyboardInterrupt
            raise _cannot_be_loaded(self.options, str(problem).removesuffix(": ")) from None

    def get_ready(self) -> None:
        """Load the class; if this fails, `solve` reports the reason."""
        with suppress(UsageError, SimulationFailed):
            self._load()

    def identity(self, request: Request) -> dict[str, Any]:
        """Return all data that determine the answer: file hashes, class, levels, condition and seed."""
        inputs = {self._name(path): sha256 for path, sha256 in self.inputs.items()}
        return {
            "solver": "python",
            "code": self.code,
            "class": self.options.class_,
            "levels": dict(request.levels),
            "condition": request.condition,
            **({"inputs": inputs} if inputs else {}),
            **({"replicate": request.replicate} if request.replicate else {}),
            **({"seed": seed_of(request)} if self.options.replicates else {}),
        }

    def solve(self, request: Request) -> Answer:
        """Call the method `solve` of the class; if it raises an exception, the run fails with its message."""
        try:
            for path, sha256 in {self.options.file: self.code, **self.inputs}.items():
                if not path.is_file() or file_hash(path) != sha256:
                    raise SimulationFailed("input_changed", f"{path.name} has changed since the study was started")
            user_solver, modules_before = self._load()
            seed = (seed_of(request),) if self.options.replicates else ()
            with contained(), _importing_from(_roots(self.study)):
                returned = user_solver.solve(dict(request.levels), request.condition, *seed)
            self._require_traced(modules_before)
            responses = (self.naming.response, *self.naming.others)
            values = {response.name: _number(returned, response.name) for response in responses}
        except SimulationFailed as failure:
            return Answer("failed", reason=failure.reason, message=str(failure))
        except (ForeignError, UsageError) as error:
            return Answer("failed", reason="raised", message=str(error))
        first = values.pop(self.naming.response.name)
        return Answer("ok", first, details={RESPONSES: values} if values else {})

    def _load(self) -> tuple[Any, frozenset[str]]:
        """Return the object of the class, and the names of the modules that were loaded before the class."""
        user_solver, modules_before = _object(self)
        self._require_traced(modules_before)
        return user_solver, modules_before

    def _try(self) -> None:
        self._load()

    def _name(self, path: Path) -> str:
        """Return the path relative to the folder of the spec, with slashes on every system."""
        folder = self.study.source.resolve().parent
        return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name

    def _require_traced(self, modules_before: frozenset[str]) -> None:
        """Raise `SimulationFailed` if a module was imported that is not in `inputs`: its changes would be unnoticed."""
        folder = self.study.source.resolve().parent
        for name in sys.modules.keys() - modules_before:
            path = Path(getattr(sys.modules[name], "__file__", None) or "")
            own = path.is_relative_to(folder) and not _is_installed(path, folder) and not name.startswith("stemcal")
            if own and path not in self.inputs:
                place = self._name(path)
                message = f"the import of {place} cannot be traced; add `files: [{place}]` under `solver`"
                raise SimulationFailed("unknown_input", message)


def _number(returned: object, name: str) -> float:
    if not isinstance(returned, Mapping) or name not in returned:
        raise SimulationFailed("no_result", f"`solve` returned no {name}; return a mapping such as {{{name!r}: 12.5}}")
    if not isinstance(returned[name], Real) or isinstance(returned[name], bool):
        message = f"the returned {name} is of type {type(returned[name]).__name__}, not a number"
        raise SimulationFailed("bad_result", message)
    with suppress(OverflowError):
        return float(returned[name])
    return math.inf  # an integer of 400 digits


def _roots(study: Study) -> list[Path]:
    assert isinstance(study.solver, PythonSolver)
    return list(dict.fromkeys([study.solver.file.parent, study.source.resolve().parent]))


def _is_installed(path: Path, folder: Path) -> bool:
    """Check whether a file is in a Python environment, even if the environment is below the folder."""
    places = {Path(place).resolve() for place in (sys.prefix, sys.base_prefix)} - {folder}
    below = [place for place in places if place.is_relative_to(folder)]
    return "site-packages" in path.parts or any(path.is_relative_to(place) for place in below)


@dataclass(frozen=True)
class _Loaded:
    """An object of the user's class, the names of the modules loaded before it, and the folders it imports from."""

    key: Any
    user_solver: Any
    modules_before: frozenset[str]
    roots: list[Path]

    def forget(self) -> None:
        """Unload the modules of the class, because another class may have modules of the same names."""
        for name in sys.modules.keys() - self.modules_before:
            path = Path(getattr(sys.modules[name], "__file__", None) or "")
            if any(path.is_relative_to(root) and not _is_installed(path, root) for root in self.roots):
                del sys.modules[name]


_loaded: list[_Loaded] = []  # the class that this process has loaded last, or empty


@contextmanager
def _importing_from(roots: list[Path]) -> Iterator[None]:
    """Append folders to the end of the module search path, where they cannot hide modules of Python."""
    added = [str(root) for root in roots if str(root) not in sys.path]
    sys.path += added
    try:
        yield
    finally:
        sys.path[:] = [place for place in sys.path if place not in added]  # keeps the folders that the class has added


def _object(solver: PythonClass) -> tuple[Any, frozenset[str]]:
    """Return the object of the class (created again if a file has changed), and the modules loaded before it."""
    options, roots = solver.options, _roots(solver.study)
    key = (options, solver.code, tuple(solver.inputs.items()))
    if not _loaded or _loaded[-1].key != key:
        while _loaded:
            _loaded.pop().forget()
        before = frozenset(sys.modules)
        try:
            with _importing_from(roots):
                user_solver = _new_object(options, solver.code)
        except UsageError:
            _Loaded(key, None, before, roots).forget()
            raise
        _loaded.append(_Loaded(key, user_solver, before, roots))
    return _loaded[-1].user_solver, _loaded[-1].modules_before


def _new_object(options: PythonSolver, code: str) -> Any:
    module_name = f"stemcal_solver_{code[:12]}"
    loader = SourceFileLoader(module_name, str(options.file))  # accepts any file extension
    spec = importlib.util.spec_from_file_location(module_name, options.file, loader=loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    try:
        with contained():
            loader.exec_module(module)
            user_solver = getattr(module, options.class_)()
            can_solve = _accepts(getattr(user_solver, "solve", None), 3 if options.replicates else 2)
    except ForeignError as error:
        raise _cannot_be_loaded(options, str(error)) from None
    if not can_solve:
        seed = ", seed" if options.replicates else ""
        raise _cannot_be_loaded(options, f"it has no method `solve(self, levels, condition{seed})`")
    return user_solver


def _accepts(function: Any, count: int) -> bool:
    """Check that a function can be called with a number of arguments; true if its signature is unknown."""
    with suppress(ValueError):  # compiled functions may have no signature
        try:
            inspect.signature(function).bind(*range(count))
        except TypeError:  # the function has other parameters
            return False
    return True


def _cannot_be_loaded(options: PythonSolver, reason: str) -> UsageError:
    return UsageError(f"solver.file {options.file.name}: the class {options.class_} cannot be loaded: {reason}")
