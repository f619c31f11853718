"""The run sheet in the study folder: written for the runs that a study awaits, and entered before it is replaced."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from stemcal.by_hand.entering import awaited_runs, enterable_runs, record_results
from stemcal.by_hand.row_checks import RowRefused, by_name, meant_run
from stemcal.by_hand.run_sheet import (
    FAILED,
    MAX_BYTES,
    REMARK,
    STUDY,
    WHEN,
    WHO,
    SheetRow,
    entered_responses,
    filled,
    run_name,
    sheet_text,
)
from stemcal.errors import Waiting
from stemcal.runs.record import Run, by_key
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import RESPONSES, Request
from stemcal.storage.atomic import make_folder, move_new, write_atomic
from stemcal.storage.plain import read_plain
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST

SHEET = "sheet.csv"
_EARLIER, _INPUTS = "sheets", "inputs"  # folders for replaced sheets and for the input files of runs


def awaiting_sheet(study: Study, folder: StudyFolder) -> str | None:
    """Return the place of the sheet of the study folder, None if there is none or no runs are done by hand."""
    path = folder.path / SHEET
    return str(path) if study.by_hand.kind.answers == "asks_people" and path.exists() else None


class OwnSheet:
    """The run sheet in a locked study folder. Whatever was saved to it is entered before another sheet replaces it."""

    def __init__(self, study: Study, folder: StudyFolder) -> None:
        self.study, self.folder, self.path = study, folder, folder.path / SHEET
        self.earlier: Path | None = None
        """The place of the sheet that was replaced."""
        self._entered: bytes | None = None

    def enter_saved(self) -> bool:
        """Enter results saved since the last call and return whether any is new; `UsageError` if rows are rejected."""
        content = self._saved(self.path)
        if content is None or content == self._entered:
            return False
        entered = record_results(self.study, self.folder, filled(content, str(self.path), self.study.by_hand))
        entered.require_all()
        self._entered = content
        return bool(entered.taken or entered.replaced)

    def write_sheet(self, waiting: Waiting) -> int:
        """Write results and a row for each awaited run; return their number, 0 if the sheet was saved meanwhile."""
        if self.enter_saved():
            return 0
        study, runs = self.study, awaited_runs(self.study, self.folder, waiting)
        remarks = self._remarks(runs)
        rows: list[SheetRow] = [*_entered(study, self.folder, runs), *zip(runs, remarks, strict=True)]
        if not self._replace(sheet_text(study.by_hand, rows)):
            return self.write_sheet(waiting)
        solver = make_solver(study.by_hand)
        for name, request in _named(study.by_hand, runs):
            solver.write_inputs(self.folder.path / _INPUTS, name, request)
        return len(runs)

    def _saved(self, path: Path) -> bytes | None:
        try:
            return read_plain(path, MAX_BYTES)
        except FileNotFoundError:
            return None

    def _replace(self, text: str) -> bool:
        """Move the sheet, which may be saved any moment, then compare, then write; False if it was saved since."""
        if self._entered == text.encode() == self._saved(self.path):
            return True
        stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%S%f}"
        earlier = make_folder(self.folder.path / _EARLIER) / f"{stamp}-{self.path.name}"
        try:
            self.path.replace(earlier)
        except FileNotFoundError:
            return write_atomic(self.path, text, new=True)
        self.earlier = earlier
        if self._saved(earlier) != self._entered:
            move_new(earlier, self.path)  # unless it has been saved once more
            return False
        return write_atomic(self.path, text, new=True)

    def _remarks(self, runs: Sequence[Request]) -> list[dict[str, str | float]]:
        """Return person, date and remark of each run in the present sheet that has no result yet."""
        study, solver, named = self.study.by_hand, make_solver(self.study.by_hand), by_name(runs)
        remarks: dict[str, dict[str, str | float]] = {}
        for row in filled(self._entered, str(self.path), study) if self._entered else []:
            with suppress(RowRefused):
                cells = {name: text for name, text in row.origin.items() if name != STUDY and row.is_empty}
                remarks[Run.of(solver, meant_run(study, named, row)).key] = {**cells}
        return [remarks.get(Run.of(solver, run).key, {}) for run in runs]


def _entered(study: Study, folder: StudyFolder, awaited: Sequence[Request]) -> Iterator[SheetRow]:
    """Yield the runs whose results were entered, with these."""
    solver = make_solver(study.by_hand)
    left = by_key(solver, awaited)
    for key, run in enterable_runs(study, folder, None).items():
        record = folder.peek(key) if key not in left else None
        if record is None or "entered" not in (details := record["details"]):
            continue
        cells = {WHO: details.get("entered_by", ""), WHEN: details.get("done", ""), REMARK: details.get("remark", "")}
        if record["status"] == "ok":
            first = entered_responses(study.by_hand)[0].name
            yield run, {**cells, first: record[FIRST], **details.get(RESPONSES, {})}
        else:
            yield run, {**cells, REMARK: f"{FAILED}: {record['message']}"}


def _named(study: Study, runs: Sequence[Request]) -> Iterator[tuple[str, Request]]:
    """Yield the folder of each run's input files; without spaces, which not all programs read in included paths."""
    several = len({run.condition for run in runs}) > 1
    for run in runs:
        at = f"-at-{run.condition:g}" if several else ""
        replicate = f"-replicate-{run.replicate}" if study.solver.repeats > 1 else ""
        yield f"{run_name(run).replace(' ', '-')}{at}{replicate}", run
