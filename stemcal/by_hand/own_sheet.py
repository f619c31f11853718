"""The run sheet in the study folder: it is written for the pending runs, and read again before it is replaced."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

from stemcal.by_hand import run_sheet
from stemcal.by_hand.entering import awaited_runs, enterable_runs, record_results
from stemcal.by_hand.row_checks import RowRefused, by_name, meant_run
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
    """Return the path of the sheet in the study folder; None if there is no sheet or the study has no manual runs."""
    path = folder.path / SHEET
    return str(path) if study.by_hand.kind.answers == "asks_people" and path.exists() else None


class OwnSheet:
    """The run sheet in a locked study folder. All results saved to it are recorded before a new sheet replaces it.

    A ``with`` block begins with recording the results, unless the sheet is the file `skipped`. If `Waiting` ends the
    block, a new sheet is written for the pending runs; `awaited` is their number.
    """

    def __init__(self, study: Study, folder: StudyFolder, skipped: Path | None = None) -> None:
        self.study, self.folder, self.path = study, folder, folder.path / SHEET
        self.awaited, self._skipped = 0, skipped
        self.earlier: Path | None = None
        """Path to which the replaced sheet was moved."""
        self._entered: bytes | None = None  # content of the sheet when its results were last recorded

    def __enter__(self) -> Self:
        if not (self._skipped and self.path.exists() and self.path.samefile(self._skipped)):
            self.enter_saved()
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if isinstance(error, Waiting):
            self.awaited = self.write_sheet(error)
            self.folder.remember_spec(self.study.source)

    def enter_saved(self) -> bool:
        """Record the results saved since the last call; true if any is new. `UsageError` if rows are refused."""
        content = _content_of(self.path)
        if content is None or content == self._entered:
            return False
        entered = record_results(self.study, self.folder, run_sheet.filled(content, str(self.path), self.study.by_hand))
        entered.require_all()
        self._entered = content
        return bool(entered.taken or entered.replaced)

    def write_sheet(self, waiting: Waiting) -> int:
        """Write a sheet with the recorded results and a row for each pending run, and the input files of these runs.

        Return the number of pending runs; 0 without writing if the previous sheet has new results.
        """
        if self.enter_saved():
            return 0
        study, runs = self.study, awaited_runs(self.study, self.folder, waiting)
        recorded, pending = _entered(study, self.folder, runs), zip(runs, self._remarks(runs), strict=True)
        if not self._replace(run_sheet.sheet_text(study.by_hand, [*recorded, *pending])):
            return self.write_sheet(waiting)
        solver, several = make_solver(study.by_hand), len({run.condition for run in runs}) > 1
        for run in runs:
            name = run_sheet.run_name(run).replace(" ", "-")  # not all programs accept spaces in included paths
            name += f"-at-{run.condition:g}" if several else ""
            name += f"-replicate-{run.replicate}" if study.by_hand.solver.repeats > 1 else ""
            solver.write_inputs(self.folder.path / _INPUTS, name, run)
        return len(runs)

    def _replace(self, text: str) -> bool:
        """Replace the sheet; return False, and keep it, if it was saved again after its results were recorded."""
        if self._entered == text.encode() == _content_of(self.path):
            return True
        stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%S%f}"
        earlier = make_folder(self.folder.path / _EARLIER) / f"{stamp}-{self.path.name}"
        try:
            self.path.replace(earlier)
        except FileNotFoundError:
            return write_atomic(self.path, text, new=True)
        self.earlier = earlier
        if _content_of(earlier) != self._entered:
            move_new(earlier, self.path)  # does nothing if the sheet exists because it was saved once more
            return False
        return write_atomic(self.path, text, new=True)

    def _remarks(self, runs: Sequence[Request]) -> list[dict[str, str | float]]:
        study, solver, named = self.study.by_hand, make_solver(self.study.by_hand), by_name(runs)
        remarks: dict[str, dict[str, str | float]] = {}
        for row in run_sheet.filled(self._entered, str(self.path), study) if self._entered else []:
            with suppress(RowRefused):
                cells = {name: text for name, text in row.origin.items() if name != run_sheet.STUDY and row.is_empty}
                remarks[Run.of(solver, meant_run(study, named, row)).key] = {**cells}
        return [remarks.get(Run.of(solver, run).key, {}) for run in runs]


def _content_of(path: Path) -> bytes | None:
    try:
        return read_plain(path, run_sheet.MAX_BYTES)
    except FileNotFoundError:
        return None


def _entered(study: Study, folder: StudyFolder, awaited: Sequence[Request]) -> Iterator[run_sheet.SheetRow]:
    left = by_key(make_solver(study.by_hand), awaited)
    for key, run in enterable_runs(study, folder, None).items():
        record = folder.peek(key) if key not in left else None
        if record is None or "entered" not in (details := record["details"]):
            continue
        origin = {run_sheet.WHO: "entered_by", run_sheet.WHEN: "done", run_sheet.REMARK: "remark"}
        cells = {column: details.get(entry, "") for column, entry in origin.items()}
        if record["status"] == "ok":
            first = run_sheet.entered_responses(study.by_hand)[0].name
            yield run, {**cells, first: record[FIRST], **details.get(RESPONSES, {})}
        else:
            yield run, {**cells, run_sheet.REMARK: f"{run_sheet.FAILED}: {record['message']}"}
