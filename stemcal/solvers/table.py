"""A solver that looks its answers up: tables of past or published runs in place of simulations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from stemcal.errors import SpecError, SpecProblem, UsageError
from stemcal.solvers.protocol import Answer, Immediate, Request
from stemcal.solvers.sheet import Sheet, read_sheet
from stemcal.study.model import Study
from stemcal.study.model import TableSolver as Tables

DIAMETER = "diameter"
MARKS = ("block", "weight")
TABLE_VERSION = 1


class TableSolver(Immediate):
    """Answers from the CSV files under ``solver`` in the spec.

    Parameters
    ----------
    study : Study
        Its ``solver`` names a file per stage. Columns are called by factor (name or symbol), ``validate`` has
        a column ``diameter`` in mm; the last column is the force in N. A column ``run`` is passed over.

    Raises
    ------
    SpecError
        With every problem of every table.

    Notes
    -----
    An empty force, or ``NaN``, is a run that failed. Equal rows are replicates, each with its own force. The table of
    ``rsm`` may say in a column ``block`` which runs were made together, in a column ``weight`` how much each counts.
    """

    def __init__(self, study: Study) -> None:
        tables = study.solver
        if not isinstance(tables, Tables):
            raise TypeError(f"the study's solver is of kind {tables.kind}, not table")
        self._sheets: dict[str, Sheet] = {}
        self._marks: dict[str, list[dict[str, Any]]] = {}
        problems: list[SpecProblem] = []
        for stage, path in ("screen", tables.screen), ("rsm", tables.rsm), ("validate", tables.validate):
            if path is not None:
                self._read(stage, path, study, problems)
        if problems:
            raise SpecError(problems)

    def _read(self, stage: str, path: Path, study: Study, problems: list[SpecProblem]) -> None:
        known = {factor.symbol: factor.name for factor in study.factors}
        known |= {factor.name: factor.name for factor in study.factors}
        if stage == "validate":
            known |= {DIAMETER: DIAMETER, "diameter_mm": DIAMETER}
        if stage == "rsm":
            known = {mark: mark for mark in MARKS} | known
        required = {"screen": list(study.names), "validate": [DIAMETER]}.get(stage, [])
        try:
            sheet = read_sheet(path, known, required)
            marks = [name for name in MARKS if name in sheet.columns and name not in study.names]
            self._marks[stage] = [_marked(row, marks) for row in sheet.rows]
            rows = tuple({name: value for name, value in row.items() if name not in marks} for row in sheet.rows)
            self._sheets[stage] = replace(sheet, rows=rows)
        except SpecError as error:
            problems += error.problems

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
            "diameter": request.diameter,
        }

    def solve(self, request: Request) -> Answer:
        """Return the force of the row; of the row with that diameter in ``validate``."""
        sheet = self._sheet(request.stage)
        row = self._diameter_row(sheet, request) if request.stage == "validate" else self._row(sheet, request)
        if row is None:
            what = f"diameter {request.diameter:g} mm" if request.stage == "validate" else f"row {request.row + 1}"
            return Answer("failed", reason="not_in_table", message=f"{sheet.path.name} has no {what}")
        force = sheet.responses[row]
        if force is None:
            return Answer("failed", reason="no_force", message=f"{sheet.place(row)}: no force is given")
        place = {"table": sheet.path.name, "line": sheet.lines[row]}
        return Answer("ok", force=force, details=place | self._marks[request.stage][row])

    def given_design(self, stage: str) -> list[dict[str, float]]:
        """Return the rows of a table, level by factor; those of ``validate`` begin with the diameter."""
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

    @staticmethod
    def _diameter_row(sheet: Sheet, request: Request) -> int | None:
        for index, row in enumerate(sheet.rows):
            if math.isclose(row[DIAMETER], request.diameter, rel_tol=1e-6):
                return index
        return None


def _marked(row: Mapping[str, float], marks: Sequence[str]) -> dict[str, Any]:
    """Return block (as a label) and weight of a row."""
    return {name: f"{row[name]:g}" if name == "block" else row[name] for name in marks}
