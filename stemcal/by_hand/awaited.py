"""Which runs a study waits for, which it knows, and the sheet of both in its folder."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from stemcal.errors import Waiting
from stemcal.executors.base import InlineExecutor
from stemcal.files.durable import make_folder, write_atomic
from stemcal.folder.study_folder import StudyFolder
from stemcal.naming import FIRST
from stemcal.overview.plan import asked, missing
from stemcal.overview.status import SHEET, ledger
from stemcal.runs.answer import Watch, ignore
from stemcal.runs.outcome import record_key
from stemcal.solvers import make_solver
from stemcal.solvers.programs.inputs import seed_of
from stemcal.solvers.protocol import RESPONSES, WITHDRAWN, Request
from stemcal.solvers.sheet.columns import FAILED, REMARK, WHEN, WHO, SheetRow, entered_responses, run_name, sheet_text
from stemcal.stages.fresh import make
from stemcal.stages.stage import stage_called, stages_of
from stemcal.study.model import Study

OLD, INPUTS = "sheets", "inputs"


def gone_on(study: Study, folder: StudyFolder, watch: Watch = ignore) -> Waiting | None:
    """Take a study through its stages as far as its results allow; return what it waits for, None at the end.

    Raises
    ------
    StemcalError
        Whatever a stage raises for which results are no remedy.
    """
    try:
        for stage in stages_of(study):
            make(stage, study, folder, InlineExecutor(), watch)
    except Waiting as waiting:
        return waiting
    return None


def awaited_runs(study: Study, folder: StudyFolder, waiting: Waiting) -> list[Request]:
    """Return the runs without results: all that the waiting stage will ask for, if that is known already.

    Where equal runs may differ they are in random order, so that no drift is taken for an effect.
    """
    study = stage_called(waiting.stage).seen(study)
    solver = make_solver(study)
    wanted = {record_key(solver, request): request for request in waiting.requests}
    for part in asked(study, solver, folder):
        left = {record_key(solver, request): request for request in missing(part, study, solver, folder)}
        if part.stage == waiting.stage and part.settled and wanted.keys() <= left.keys():
            wanted = left
    rows = list(wanted.values())
    if study.replicates:
        rows.sort(key=lambda row: seed_of(row))
    return rows


def known_runs(study: Study, folder: StudyFolder, waiting: Waiting | None) -> list[Request]:
    """Return the runs whose results may be entered: those that are awaited, and those that have some."""
    elsewhere = {stage.name for stage in stages_of(study) if stage.seen(study) is not study}
    there = study.by_hand is not study
    solver = make_solver(study.by_hand)
    awaited = [] if waiting is None else list(waiting.requests)
    asked_for = [entry.request for entry in ledger(study, folder) if (entry.stage in elsewhere) is there]
    return list({record_key(solver, request): request for request in (*awaited, *asked_for)}.values())


def hand_out(study: Study, folder: StudyFolder, waiting: Waiting) -> tuple[Path, int]:
    """Write the sheet of the study folder; return its place and the number of runs without results.

    It has the results that were entered, then a row for each run that is awaited. A sheet that differs is put aside.
    """
    runs = awaited_runs(study, folder, waiting)
    rows: list[SheetRow] = [*_entered(study, folder, runs), *((run, {}) for run in runs)]
    sheet, text = folder.path / SHEET, sheet_text(study.by_hand, rows)
    if sheet.exists() and sheet.read_bytes() != text.encode():
        stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%S%f}"
        sheet.replace(make_folder(folder.path / OLD) / f"{stamp}-{SHEET}")
    write_atomic(sheet, text)
    _write_inputs(study.by_hand, folder, runs)
    return sheet, len(runs)


def _entered(study: Study, folder: StudyFolder, awaited: Sequence[Request]) -> Iterator[SheetRow]:
    """Yield the runs whose results were entered, with these."""
    solver = make_solver(study.by_hand)
    left = {record_key(solver, run) for run in awaited}
    for run in known_runs(study, folder, None):
        record = folder.peek(key) if (key := record_key(solver, run)) not in left else None
        if record is not None and "entered" in record["details"] and record["reason"] != WITHDRAWN:
            yield run, _known(study.by_hand, record)


def _known(study: Study, record: dict[str, Any]) -> dict[str, str | float]:
    """Return what a record has for the columns of the sheet."""
    details, first = record["details"], entered_responses(study)[0].name
    said = {WHO: details.get("entered_by", ""), WHEN: details.get("done", ""), REMARK: details.get("remark", "")}
    if record["status"] != "ok":
        return said | {REMARK: f"{FAILED}: {record['message']}"}
    return {**said, first: record[FIRST], **details.get(RESPONSES, {})}


def _write_inputs(study: Study, folder: StudyFolder, runs: Sequence[Request]) -> None:
    solver = make_solver(study)
    for name, request in _named(study, runs):
        solver.write_inputs(folder.path / INPUTS, name, request)


def _named(study: Study, runs: Sequence[Request]) -> Iterator[tuple[str, Request]]:
    """Yield the folder of each run's input files, called by its run, its condition and its replicate.

    No name has a space: decks include files by their paths, and not all programs read a path with spaces.
    """
    several = len({run.condition for run in runs}) > 1
    for run in runs:
        at = f"-at-{run.condition:g}" if several else ""
        replicate = f"-replicate-{run.replicate}" if study.replicates > 1 else ""
        yield f"{run_name(run).replace(' ', '-')}{at}{replicate}", run
