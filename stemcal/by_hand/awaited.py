"""The runs by hand that a study is waiting for, and those whose results may be entered."""

from stemcal.errors import Waiting
from stemcal.runs.answer import watch_nothing
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import by_key
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request
from stemcal.solvers.replicates import seed_of
from stemcal.stages.fresh import make
from stemcal.stages.ledger import asked, ledger, missing
from stemcal.stages.stage import stage_called, stages_of
from stemcal.study.model.study import Study


def advance_study(study: Study, folder: StudyFolder) -> Waiting | None:
    """Take a study through its stages as far as its results allow; return what it waits for, None at the end."""
    try:
        for stage in stages_of(study):
            make(stage, study, folder, InlineExecutor(), watch_nothing)
    except Waiting as waiting:
        return waiting
    return None


def awaited_runs(study: Study, folder: StudyFolder, waiting: Waiting) -> list[Request]:
    """Return the runs without results: all that the waiting stage will ask for, if that is known already.

    Where equal runs may differ they are in random order, so that no drift is taken for an effect.
    """
    study = stage_called(waiting.stage).seen(study)
    solver = make_solver(study)
    wanted = by_key(solver, waiting.requests)
    for part in asked(study, solver, folder):
        left = by_key(solver, missing(part, study, solver, folder))
        if part.stage == waiting.stage and part.settled and wanted.keys() <= left.keys():
            wanted = left
    rows = list(wanted.values())
    if study.solver.repeats:
        rows.sort(key=lambda row: seed_of(row))
    return rows


def enterable_runs(study: Study, folder: StudyFolder, waiting: Waiting | None) -> dict[str, Request]:
    """Return by their keys the runs whose results may be entered: those that are awaited, and those that have some."""
    elsewhere = {stage.name for stage in stages_of(study) if stage.seen(study) is not study}
    there = study.by_hand is not study
    solver = make_solver(study.by_hand)
    awaited = () if waiting is None else waiting.requests
    asked_for = [entry.request for entry in ledger(study, folder) if (entry.stage in elsewhere) is there]
    return by_key(solver, (*awaited, *asked_for))
