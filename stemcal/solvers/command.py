"""Any program as a solver: templates in, a number out, or one for each response."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from stemcal.naming import FIRST
from stemcal.processes import Ended
from stemcal.solvers.measures import curve_scores, kept_curve
from stemcal.solvers.options import CommandSolver
from stemcal.solvers.program import Inputs, Program, executable, run_command, seed_of, values_of
from stemcal.solvers.protocol import RESPONSES, Answer, Request
from stemcal.solvers.readers import read_curve, read_number


@dataclass(frozen=True)
class Command(Program):
    """Answers requests by any program; see `study.outside.CommandSolver`."""

    @property
    def options(self) -> CommandSolver:
        """The keys of the program in the spec."""
        assert isinstance(self.study.solver, CommandSolver)
        return self.study.solver

    def prepare(self) -> None:
        """Refuse to begin if the program is not there."""
        executable(self.options.command[0], self.study.source.parent)

    def identity(self, request: Request) -> dict[str, Any]:
        """Return what determines the answer, the command among it."""
        return {**super().identity(request), "command": list(self.options.command)}

    def _inputs(self) -> Inputs:
        return Inputs.of(self.options.templates, self.options.files)

    def _determining(self, request: Request) -> dict[str, Any]:
        options = self.options
        drawn = {"seed": seed_of(request)} if request.replicate else {}
        return {"result": {name: one.model_dump(mode="json") for name, one in options.result.items()}, **drawn}

    def _write(self, folder: Path, request: Request) -> None:
        self.inputs.write(folder, self._values(request))

    def _values(self, request: Request) -> Mapping[str, str]:
        return values_of(request, seed_of(request), self.study.naming)

    def _run(self, folder: Path, request: Request) -> Answer:
        place, values = self.study.source.parent, self._values(request)
        read = partial(self._read, folder, request)
        return run_command(folder, self.options.command, self.options, place, values, read)

    def _read(self, folder: Path, request: Request, _ended: Ended) -> Answer:
        naming = self.study.naming
        found = {name: read_number(reader, folder) for name, reader in self.options.result.items()}
        first = found.pop(naming.response.name if naming.response.name in found else FIRST)
        modes, curve = self.study.targets.modes_at(request.condition), {}
        if modes is not None and FIRST in self.options.result:
            travel, force = read_curve(self.options.result[FIRST], folder)
            found |= curve_scores(modes, travel, force)
            curve = {"curve": kept_curve(travel, force)}
        return Answer("ok", response=first, details={**({RESPONSES: found} if found else {}), **curve})
