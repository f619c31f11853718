"""The files of a study folder that ask for results: the sheet, and the input files of each run."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

from stemcal.by_hand.awaited import run_name
from stemcal.by_hand.reading import MAX_BYTES, filled
from stemcal.by_hand.sheet import ASKED, cells, fields_of, plain, sheet_text
from stemcal.by_hand.workbook import written
from stemcal.errors import UsageError
from stemcal.files.plain import read_plain
from stemcal.folder.study_folder import StudyFolder
from stemcal.outputs import make_folder, write_output
from stemcal.overview.status import SHEET
from stemcal.solvers import make_solver
from stemcal.solvers.manual import Manual
from stemcal.solvers.protocol import Request
from stemcal.study.model import Study

WORKBOOK = "sheet.xlsx"
OLD, INPUTS = "sheets", "inputs"


def hand_out(study: Study, folder: StudyFolder, runs: Sequence[Request]) -> Path:
    """Write the sheet, and the input files of each run if there are templates; return the one to be filled in.

    A sheet that lies there and asks for the same runs is left as it is, somebody may be filling it in; another one is
    put aside, with whatever is written in it.
    """
    sheet, workbook = folder.path / SHEET, folder.path / WORKBOOK
    if not _asks_for(sheet, study, runs):
        _put_aside(sheet)
        write_output(sheet, sheet_text(study, runs))
    _write_inputs(study, folder, runs)
    if not _asks_for(workbook, study, runs):
        _put_aside(workbook)
        fields = fields_of(study)
        write_output(workbook, written(study.name, fields, [cells(run, fields) for run in runs]))
    return workbook


def take_back(folder: StudyFolder) -> None:
    """Put the sheets aside: nothing is awaited any more."""
    for name in (SHEET, WORKBOOK):
        _put_aside(folder.path / name)


def _asks_for(path: Path, study: Study, runs: Sequence[Request]) -> bool:
    """Whether a sheet has just these runs, with these levels."""
    fields = [field for field in fields_of(study) if field.kind in ("run", *ASKED)]
    wanted = {tuple(plain(cell) for cell in cells(run, fields)) for run in runs}
    try:
        sheet = filled(read_plain(path, MAX_BYTES), path.name, study)
    except (OSError, UsageError):
        return False
    return {(row.run, *(row.levels[field.name] for field in fields[1:])) for row in sheet} == wanted


def _put_aside(path: Path) -> None:
    """Move a sheet that lies there into a folder of such sheets."""
    if path.exists():
        stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%S%f}"
        path.replace(make_folder(path.parent / OLD) / f"{stamp}-{path.name}")


def _write_inputs(study: Study, folder: StudyFolder, runs: Sequence[Request]) -> None:
    solver = make_solver(study)
    if not isinstance(solver, Manual) or not (solver.options.templates or solver.options.files):
        return
    for name, request in _named(study, runs):
        solver.write_inputs(make_folder(folder.path / INPUTS) / name, request)


def _named(study: Study, runs: Sequence[Request]) -> Iterator[tuple[str, Request]]:
    """Yield the folder of each run's input files, called by its run, its condition and its replicate.

    No name has a space: decks include files by their paths, and not all programs read a path with spaces.
    """
    several = len({run.condition for run in runs}) > 1
    for run in runs:
        at = f"-at-{run.condition:g}" if several else ""
        replicate = f"-replicate-{run.replicate}" if study.replicates > 1 else ""
        yield f"{run_name(run).replace(' ', '-')}{at}{replicate}", run
