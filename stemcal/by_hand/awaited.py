"""Which runs a study waits for, and which it knows."""

from stemcal.errors import Waiting
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.overview.plan import asked, missing
from stemcal.overview.status import ledger
from stemcal.runs.answer import Watch, ignore
from stemcal.runs.outcome import record_key
from stemcal.solvers import make_solver
from stemcal.solvers.programs.seeds import seed_of
from stemcal.solvers.protocol import Request
from stemcal.stages.base import stages_of
from stemcal.stages.fresh import make
from stemcal.study.model import ManualSolver, Study


def run_name(request: Request) -> str:
    """Return what the sheet calls a run.

    >>> run_name(Request("screen", 2, {}, 8.0))
    'screen 3'
    """
    return f"{request.stage} {request.row + 1}"


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


def sheet_rows(study: Study, folder: StudyFolder, waiting: Waiting) -> list[Request]:
    """Return the rows of the sheet: all that the waiting stage will ask for, if that is known already.

    A program with chance in it gets them in random order, so that nothing that drifts is taken for an effect.
    """
    study = study.seen_by(waiting.stage)
    solver = make_solver(study)
    wanted = {record_key(solver, request): request for request in waiting.requests}
    for part in asked(study, solver, folder):
        left = {record_key(solver, request): request for request in missing(part, study, solver, folder)}
        if part.stage == waiting.stage and part.settled and wanted.keys() <= left.keys():
            wanted = left
    rows, options = list(wanted.values()), study.solver
    if isinstance(options, ManualSolver) and options.by_chance:
        rows.sort(key=lambda row: seed_of(row, options.seed))
    return rows


def known_runs(study: Study, folder: StudyFolder, waiting: Waiting | None) -> list[Request]:
    """Return the runs whose results may be entered: those that are awaited, and those that have some."""
    there = study.by_hand is not study
    solver = make_solver(study.by_hand)
    awaited = [] if waiting is None else list(waiting.requests)
    asked_for = [entry.request for entry in ledger(study, folder) if (entry.stage == "transfer") is there]
    return list({record_key(solver, request): request for request in (*awaited, *asked_for)}.values())
