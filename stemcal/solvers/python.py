"""A class in a Python file next to the spec as a solver."""

from __future__ import annotations

import functools
import importlib.util
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any

from stemcal.errors import SimulationFailed, UsageError
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
        """Refuse to begin if the class cannot be made."""
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
            found = self._made().solve(dict(request.levels), request.condition)
            responses = (self.naming.response, *self.naming.others)
            values = {named.name: _number(found, named.name) for named in responses}
        except SimulationFailed as failure:
            return Answer("failed", reason=failure.reason, message=str(failure))
        except Exception as error:  # of the user's code
            return Answer("failed", reason="raised", message=f"{type(error).__name__}: {error}")
        first = values.pop(self.naming.response.name)
        return Answer("ok", first, details={RESPONSES: values} if values else {})

    def _made(self) -> Any:
        return _object(self.options.file, self.options.class_, self.code)


def _number(found: object, name: str) -> float:
    if not isinstance(found, Mapping) or name not in found:
        raise SimulationFailed("no_result", f"`solve` returned no {name}; return a mapping such as {{{name!r}: 12.5}}")
    if not isinstance(found[name], Real):
        raise SimulationFailed(
            "bad_result", f"the returned {name} is of type {type(found[name]).__name__}, not a number"
        )
    return float(found[name])


@functools.cache
def _object(file: Path, name: str, code: str) -> Any:
    """Return the object of a class, made once in this process for each state of its file."""
    module_name = f"stemcal_solver_{code[:12]}"
    spec = importlib.util.spec_from_file_location(module_name, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    try:
        spec.loader.exec_module(module)
        made = getattr(module, name)()
    except Exception as error:  # of the user's code
        raise UsageError(
            f"solver.file {file.name}: the class {name} cannot be instantiated: {type(error).__name__}: {error}"
        ) from None
    if not callable(getattr(made, "solve", None)):
        raise UsageError(f"solver.file {file.name}: the class {name} has no `solve(levels, condition)` method")
    return made
