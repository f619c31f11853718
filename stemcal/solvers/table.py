"""A solver that looks its answers up: tables of past or published runs in place of simulations."""

import math
from pathlib import Path
from typing import Any

from stemcal.errors import SpecError, SpecProblem, UsageError
from stemcal.naming import DIAMETER
from stemcal.solvers.csv_table import Answers, Sheet, read_sheet
from stemcal.solvers.protocol import RESPONSES, Answer, Immediate, Request
from stemcal.study.model import Study, TableSolver

TABLE_VERSION = 1


class ReplaySolver(Immediate):
    """Answers from the CSV files under ``solver`` in the spec.

    Parameters
    ----------
    study : Study
        Its ``solver`` names a file per stage. Columns are called by factor (name or symbol), ``validate`` has
        a column ``diameter`` in mm; the last column is the force in N. A column ``run`` is passed over. In a study
        of its own words ``validate`` has a column of its condition, if it has one, and columns called by response
        are these; a single response may also be the last column, whatever that is called.

    Raises
    ------
    SpecError
        With every problem of every table.

    Notes
    -----
    An empty response, or ``NaN``, is a run that failed. Equal rows are replicates, each with its own.
    """

    def __init__(self, study: Study) -> None:
        tables = study.solver
        if not isinstance(tables, TableSolver):
            raise TypeError(f"the study's solver is of kind {tables.kind}, not table")
        self.naming = study.naming
        self._sheets: dict[str, Sheet] = {}
        problems: list[SpecProblem] = []
        for stage, path in ("screen", tables.screen), ("rsm", tables.rsm), ("validate", tables.validate):
            if path is not None:
                self._read(stage, path, study, problems)
        if problems:
            raise SpecError(problems)

    def _read(self, stage: str, path: Path, study: Study, problems: list[SpecProblem]) -> None:
        known = {factor.symbol: factor.name for factor in study.factors}
        known |= {factor.name: factor.name for factor in study.factors}
        condition = [] if self.naming.condition is None else [self.naming.condition.name]
        if stage == "validate":
            known |= {name: name for name in condition}
            known |= {"diameter_mm": DIAMETER.name} if self.naming.condition == DIAMETER else {}
        required = {"screen": list(study.names), "validate": condition}.get(stage, [])
        try:
            self._sheets[stage] = read_sheet(path, known, required, self._answers(stage))
        except SpecError as error:
            problems += error.problems

    def _answers(self, stage: str) -> Answers:
        """Return which columns of a table are responses."""
        if self.naming.is_cutting:
            return Answers()
        names = tuple(response.name for response in self.naming.responses)
        alone = stage == "validate" and self.naming.condition is None
        return Answers(names, self.naming.response.noun, alone)

    def prepare(self) -> None:
        """Do nothing: the tables are read."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Return the row that answers and the content of its table."""
        sheet = self._sheet(request.stage)
        return {
            "kind": "table",
            "version": TABLE_VERSION,
            "sha256": sheet.sha256,
            "stage": request.stage,
            "row": request.row,
            "levels": dict(request.levels),
            **({} if self.naming.condition is None else {"condition": request.condition}),
        }

    def solve(self, request: Request) -> Answer:
        """Return what the row gives; the row with that condition in ``validate``."""
        sheet = self._sheet(request.stage)
        by_condition = request.stage == "validate" and self.naming.condition is not None
        row = self._condition_row(sheet, request) if by_condition else self._row(sheet, request)
        if row is None:
            what = self._condition(request) if by_condition else f"row {request.row + 1}"
            return Answer("failed", reason="not_in_table", message=f"{sheet.path.name} has no {what}")
        response = sheet.responses[row]
        if response is None:
            noun = self.naming.response.noun
            return Answer("failed", reason="no_response", message=f"{sheet.place(row)}: no {noun} is given")
        place = {"table": sheet.path.name, "line": sheet.lines[row]}
        further = {n: value for n, value in sheet.further[row].items() if value is not None} if sheet.further else {}
        others = {RESPONSES: further} if further else {}
        return Answer("ok", response=response, details=place | others)

    def _condition(self, request: Request) -> str:
        """Name the condition of a request."""
        place = self.naming.place(request.condition)
        return f"diameter {place}" if self.naming.condition == DIAMETER else place

    def given_design(self, stage: str) -> list[dict[str, float]]:
        """Return the rows of a table, level by factor; those of ``validate`` begin with the condition."""
        return [dict(row) for row in self._sheet(stage).rows]

    def cost_estimate(self, _request: Request) -> float:
        """Return the seconds a look-up takes, for plans."""
        return 0.0

    def _sheet(self, stage: str) -> Sheet:
        if stage not in self._sheets:
            raise UsageError(f"the table solver has no table for {stage}; give the spec a solver.{stage}: FILE.csv")
        return self._sheets[stage]

    @staticmethod
    def _row(sheet: Sheet, request: Request) -> int | None:
        if not 0 <= request.row < len(sheet.rows):
            return None
        row = sheet.rows[request.row]
        same = all(math.isclose(request.levels[name], level, rel_tol=1e-9) for name, level in row.items())
        return request.row if same else None

    def _condition_row(self, sheet: Sheet, request: Request) -> int | None:
        assert self.naming.condition is not None
        for index, row in enumerate(sheet.rows):
            if math.isclose(row[self.naming.condition.name], request.condition, rel_tol=1e-6, abs_tol=1e-12):
                return index
        return None
