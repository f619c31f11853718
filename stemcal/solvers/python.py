"""A class in a Python file next to the spec as a solver."""

from __future__ import annotations

import functools
import importlib.util
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from numbers import Real
from typing import Any

from stemcal.errors import SimulationFailed, UsageError
from stemcal.processes.child import ChildDied, computed_apart
from stemcal.registry import ForeignError, contained
from stemcal.solvers.options import PythonSolver
from stemcal.solvers.program import file_hash
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.study.model.study import Study


@dataclass(frozen=True)
class PythonClass(Solver):
    """Answers requests by the class of a file; `code` is the hash of the file when the study was read."""

    study: Study
    code: str

    @classmethod
    def of(cls, study: Study) -> PythonClass:
        """Take note of what the file holds now."""
        assert isinstance(study.solver, PythonSolver)
        return cls(study, file_hash(study.solver.file))

    @property
    def options(self) -> PythonSolver:
        """The section of the spec."""
        assert isinstance(self.study.solver, PythonSolver)
        return self.study.solver

    def prepare(self) -> None:
        """Refuse to begin if the class cannot be loaded; it is loaded in a separate process, which writes no files."""
        try:
            computed_apart(self._try, None, {"PYTHONDONTWRITEBYTECODE": "1"})
        except ChildDied as problem:
            raise _cannot_be_loaded(self.options, f"the process ended with {problem}") from None

    def get_ready(self) -> None:
        """Load the class; `solve` reports why it cannot be loaded."""
        with suppress(UsageError):
            self._made()

    def identity(self, request: Request) -> dict[str, Any]:
        """Return the code, the class, levels and condition."""
        return {
            "solver": "python",
            "code": self.code,
            "class": self.options.class_,
            "levels": dict(request.levels),
            "condition": request.condition,
            **({"replicate": request.replicate} if request.replicate else {}),
        }

    def solve(self, request: Request) -> Answer:
        """Call `solve` of the class; what it raises is why the run failed."""
        try:
            if file_hash(self.options.file) != self.code:
                raise SimulationFailed(
                    "input_changed", f"{self.options.file.name} has changed since the study was started"
                )
            made = self._made()
            with contained():
                found = made.solve(dict(request.levels), request.condition)
            responses = (self.naming.response, *self.naming.others)
            values = {named.name: _number(found, named.name) for named in responses}
        except SimulationFailed as failure:
            return Answer("failed", reason=failure.reason, message=str(failure))
        except (ForeignError, UsageError) as error:
            return Answer("failed", reason="raised", message=str(error))
        first = values.pop(self.naming.response.name)
        return Answer("ok", first, details={RESPONSES: values} if values else {})

    def _made(self) -> Any:
        return _object(self.options, self.code)

    def _try(self) -> None:
        self._made()


def _number(found: object, name: str) -> float:
    if not isinstance(found, Mapping) or name not in found:
        raise SimulationFailed("no_result", f"`solve` returned no {name}; return a mapping such as {{{name!r}: 12.5}}")
    if not isinstance(found[name], Real):
        raise SimulationFailed(
            "bad_result", f"the returned {name} is of type {type(found[name]).__name__}, not a number"
        )
    return float(found[name])


@functools.cache
def _object(options: PythonSolver, code: str) -> Any:
    """Return the object of a class, made once in this process for each state of its file."""
    module_name = f"stemcal_solver_{code[:12]}"
    spec = importlib.util.spec_from_file_location(module_name, options.file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    try:
        with contained():
            spec.loader.exec_module(module)
            made = getattr(module, options.class_)()
            can_solve = callable(getattr(made, "solve", None))
    except ForeignError as error:
        raise _cannot_be_loaded(options, str(error)) from None
    if not can_solve:
        raise _cannot_be_loaded(options, "it has no `solve(levels, condition)` method")
    return made


def _cannot_be_loaded(options: PythonSolver, reason: str) -> UsageError:
    return UsageError(f"solver.file {options.file.name}: the class {options.class_} cannot be loaded: {reason}")
