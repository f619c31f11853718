"""The solver for manual runs: it looks up results in a file, and waits for people to perform all other runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from stemcal.by_hand.likely import likely_columns, require_likely
from stemcal.by_hand.options import SheetSolver
from stemcal.by_hand.row_checks import RowRefused, Unread, first_of, number_in, other_level, result_in
from stemcal.by_hand.run_sheet import MAX_BYTES, Filled, filled, run_name
from stemcal.errors import UsageError, Waiting
from stemcal.solvers.program import Inputs
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.solvers.replicates import seed_of, values_of
from stemcal.stages.stage import STAGES
from stemcal.storage.atomic import make_folder
from stemcal.storage.plain import read_plain
from stemcal.study.model.study import Study

_SHEET_VERSION = 1


@dataclass(frozen=True)
class _KnownRow:
    """A row of the file: its cells, its levels as numbers, and its result; None for a run without a result."""

    cells: Filled
    levels: Mapping[str, float]
    answer: Answer | None

    def as_data(self) -> list[Any]:
        """Return the run, the levels and the answer as JSON values."""
        answer = self.answer and [self.answer.response, self.answer.message, self.answer.details]
        return [self.cells.run, dict(self.levels), self.cells.levels, answer]


@dataclass(frozen=True)
class Sheet(Solver):
    """Answers requests from `solver.file`; for other runs it waits until people enter the results.

    Runs with equal levels share a result if they are not in the file and the spec has no key `replicates`.
    """

    immediate, asks_people = True, True

    study: Study
    inputs: Inputs
    rows: Mapping[str, Sequence[_KnownRow]] = field(default_factory=dict)

    @classmethod
    def of(cls, study: Study) -> Self:
        """Return the solver of a study, with the rows of its file and the hashes of its templates as they are now."""
        options = study.solver
        assert isinstance(options, SheetSolver)
        rows = {} if options.file is None else _known_rows(study, options.file)
        return cls(study, Inputs.of(options.templates, ()), rows)

    @property
    def options(self) -> SheetSolver:
        assert isinstance(self.study.solver, SheetSolver)
        return self.study.solver

    def identity(self, request: Request) -> dict[str, Any]:
        """Return all data that determine the answer; stage and row are left out if runs with equal levels share one."""
        known = self._row(request)
        row = {} if not self.options.repeats and known is None else {"stage": request.stage, "row": request.row}
        return {
            "kind": "sheet",
            "version": _SHEET_VERSION,
            "inputs": self.inputs.identity(),
            **({"known": known.as_data()} if known is not None and known.answer is not None else {}),
            **row,
            "levels": dict(request.levels),
            "condition": request.condition,
            **({"replicate": request.replicate} if request.replicate else {}),
        }

    def has_result(self, request: Request) -> bool:
        return (row := self._row(request)) is not None and row.answer is not None

    def solve(self, request: Request) -> Answer:
        """Return the result of a run in the file; raise `Waiting` if there is none."""
        row = self._row(request)
        if row is None or row.answer is None:
            raise Waiting(request.stage, [request])
        return row.answer

    def table_of(self, stage: str) -> list[Any]:
        return [row.as_data() for row in self._of_stage(stage)]

    def given_design(self, stage: str) -> list[dict[str, float]] | None:
        if not (rows := self._of_stage(stage)):
            return None
        return [dict(levels) for levels in {row.cells.run: row.levels for row in rows}.values()]

    def _of_stage(self, stage: str) -> list[_KnownRow]:
        return [row for name, rows in self.rows.items() for row in rows if name.split()[0] == stage]

    def _row(self, request: Request) -> _KnownRow | None:
        rows = self.rows.get(run_name(request), ())
        return next((row for row in rows if other_level(self.study, request, row.cells) is None), None)

    def write_inputs(self, place: Path, name: str, request: Request) -> None:
        if not self.options.templates:
            return
        folder = make_folder(place) / name
        folder.mkdir(parents=True, exist_ok=True)
        self.inputs.write(folder, values_of(request, seed_of(request), self.study.naming))


def _known_rows(study: Study, path: Path) -> dict[str, list[_KnownRow]]:
    """Return the rows of a sheet by run name, sorted by the number of the run; `UsageError` with all wrong rows."""
    try:
        content = read_plain(path, MAX_BYTES)
    except OSError as error:
        raise UsageError(f"solver.file: {path.name}: {error.strerror}; specify the path of a run sheet") from None
    known: dict[str, list[_KnownRow]] = {}
    wrong: list[str] = []
    for filled_row in filled(content, path.name, study, partial=True):
        cells = replace(filled_row.without_empty_levels(), run=filled_row.run_name)
        try:
            known.setdefault(cells.run, []).append(_known_row(study, cells))
        except RowRefused as refused:
            wrong.append(str(refused))
    if wrong := wrong or _gaps(path.name, known) or _unlikely_values(study, known):
        raise UsageError("\n".join(first_of(wrong)))
    return dict(sorted(known.items(), key=lambda item: _number(item[0])))


def _unlikely_values(study: Study, rows: Mapping[str, Sequence[_KnownRow]]) -> list[str]:
    at, usual = study.naming.condition, study.targets.calibrate_at
    runs = []
    known = {name: several for name, several in rows.items() if STAGES.named(name.split()[0]) is not None}
    for name, row in ((name, row) for name, several in known.items() for row in several):
        where = None if at is None else _level(row.cells, at.name, at.unit)
        request = Request(name.split()[0], _number(name) - 1, dict(row.levels), usual if where is None else where)
        runs += [(f"{name} {where}", request, row.answer, row.cells)] if row.answer is not None else []
    columns, wrong = likely_columns(study, (run[:3] for run in runs)), []
    for key, request, answer, cells in runs:
        try:
            require_likely(study, columns, key, cells, request, answer)
        except RowRefused as refused:
            wrong.append(str(refused))
    return wrong


def _number(run: str) -> int:
    stage, _, number = run.partition(" ")
    return int(number) if stage.isalpha() and number.isascii() and number.isdigit() and len(number) < 10 else 0


def _known_row(study: Study, cells: Filled) -> _KnownRow:
    if cells.broken:
        raise RowRefused(cells, "broken_row", cells.broken)
    if _number(cells.run) < 1:
        message = f"{cells.run!r} is not a run; write a stage and a number, such as rsm 3"
        raise RowRefused(cells, "unknown_run", message)
    at = study.naming.condition
    if at is not None:
        _level(cells, at.name, at.unit)
    all_levels = {factor.name: _level(cells, factor.name, factor.unit) for factor in study.factors}
    levels = {name: level for name, level in all_levels.items() if level is not None}
    return _KnownRow(cells, levels, None if cells.is_empty else result_in(study, cells))


def _level(cells: Filled, name: str, unit: str) -> float | None:
    if not (text := cells.levels.get(name)):
        return None
    try:
        return number_in(text, cells.decimal, cells.units.get(name, unit), unit)
    except Unread as why:
        raise RowRefused(cells, "unreadable", f"{cells.run}, {name}: {why}") from None


def _gaps(source: str, rows: Mapping[str, Sequence[_KnownRow]]) -> list[str]:
    """Return the errors of whole designs: gaps in the numbering, and levels that are missing in some rows."""
    wrong = []
    for stage in dict.fromkeys(name.split()[0] for name in rows):
        of_stage = {name: row[0] for name, row in rows.items() if name.split()[0] == stage}
        if {_number(name) for name in of_stage} != set(range(1, len(of_stage) + 1)):
            message = f"{source}: the rows of {stage} are not numbered from 1 to {len(of_stage)}; renumber these rows"
            wrong.append(message)
        columns = [set[str](row.levels) for row in of_stage.values()]
        if partial := sorted(set().union(*columns) - columns[0].intersection(*columns)):
            wrong.append(
                f"{source}: some rows of {stage} have no levels for {', '.join(partial)}; fill in these levels"
            )
    return wrong
