"""Runs done by hand: what tells one from another, and the input files that help whoever does them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.solvers.programs.inputs import Inputs, file_hash, values_of
from stemcal.solvers.programs.seeds import seed_of
from stemcal.solvers.protocol import Answer, ByHand, Request
from stemcal.solvers.table import ReplaySolver
from stemcal.study.model import ManualSolver, Study, TableSolver

MANUAL_VERSION = 1


@dataclass(frozen=True)
class Manual(ByHand):
    """Has no answers of its own: those that were entered lie in the records of the study folder.

    Rows of a design with equal levels are runs of their own, unless the spec says that they answer equally.
    """

    study: Study
    inputs: Inputs
    designs: ReplaySolver | None = None

    @classmethod
    def of(cls, study: Study) -> Manual:
        """Take note of what templates and designs hold now."""
        options = study.solver
        assert isinstance(options, ManualSolver)
        tables = TableSolver(screen=options.screen, rsm=options.rsm)
        given = options.screen is not None or options.rsm is not None
        designs = ReplaySolver(study.model_copy(update={"solver": tables})) if given else None
        return cls(study, Inputs.of(options.templates, options.files), designs)

    @property
    def options(self) -> ManualSolver:
        """What the spec says of the runs."""
        assert isinstance(self.study.solver, ManualSolver)
        return self.study.solver

    def prepare(self) -> None:
        """Do nothing."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Return what was asked for, the row of its design too unless equal levels answer equally."""
        row = {} if self.options.deterministic else {"stage": request.stage, "row": request.row}
        return {
            "kind": "manual",
            "version": MANUAL_VERSION,
            "program": self.options.version,
            "inputs": self.inputs.identity(),
            **({} if (path := self._table(request.stage)) is None else {"design": file_hash(path)}),
            **row,
            "levels": dict(request.levels),
            "condition": request.condition,
            **({"replicate": request.replicate} if request.replicate else {}),
        }

    def solve(self, request: Request) -> Answer:
        """Refuse: nobody but people can do the run."""
        raise UsageError(f"{request.stage} run {request.row + 1} is done by hand; `stemcal enter` takes its result")

    def given_design(self, stage: str) -> list[dict[str, float]] | None:
        """Return the design that another program has made, None where stemcal makes it."""
        return None if self.designs is None or self._table(stage) is None else self.designs.given_design(stage)

    def _table(self, stage: str) -> Path | None:
        return {"screen": self.options.screen, "rsm": self.options.rsm}.get(stage)

    def write_inputs(self, folder: Path, request: Request) -> None:
        """Put the files of a run into a folder, templates filled."""
        folder.mkdir(parents=True, exist_ok=True)
        self.inputs.write(folder, values_of(request, seed_of(request, self.options.seed), self.study.naming))
