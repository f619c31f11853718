"""What programs see: runs that are awaited as data, results taken as data."""

import getpass
from collections.abc import Callable, Sequence
from typing import Any

from stemcal.by_hand.awaited import gone_on, known_runs, run_name
from stemcal.by_hand.entering import Correction, Entered, enter
from stemcal.by_hand.reading import Filled
from stemcal.by_hand.refusals import Refused
from stemcal.by_hand.sheet import entered_responses
from stemcal.errors import StemcalError, UsageError, Waiting
from stemcal.files.typed import to_json
from stemcal.folder.study_folder import StudyFolder
from stemcal.solvers.protocol import Request
from stemcal.study.model import Study

SCHEMA_VERSION = 1


def asked_runs(study: Study, runs: Sequence[Request]) -> list[dict[str, Any]]:
    """Return each run that is awaited, with its levels as they were asked for and its responses still empty."""
    names = [response.name for response in entered_responses(study)]
    return [
        {
            "run": run_name(run),
            "levels": dict(run.levels),
            **({} if study.naming.condition is None else {"condition": run.condition}),
            **({"replicate": run.replicate} if study.replicates > 1 else {}),
            "responses": dict.fromkeys(names),
        }
        for run in runs
    ]


def asked_json(study: Study, waiting: Waiting | None, runs: Sequence[Request]) -> dict[str, Any]:
    """Return what `stemcal ask --json` prints; `waiting_for` names the stage, None at the end."""
    return {
        "schema_version": SCHEMA_VERSION,
        "stage": "ask",
        "study": study.name,
        "waiting_for": None if waiting is None else waiting.stage,
        "naming": to_json(study.naming),
        "runs": asked_runs(study, runs),
    }


def entered_json(found: Entered, said: Callable[[Refused], str]) -> dict[str, Any]:
    """Return what became of a sheet, each refused row with its sentence."""
    refused = [{**to_json(one), "text": said(one)} for one in found.refused]
    return {"schema_version": SCHEMA_VERSION, "stage": "enter", **to_json(found), "refused": refused}


def enter_filled(study: Study, folder: StudyFolder, sheet: Sequence[Filled], how: Correction) -> Entered:
    """Record what a sheet tells of the runs that a study knows by now; the folder must be locked."""
    try:
        waiting = gone_on(study, folder)
    except StemcalError:  # results may be the remedy; if not, it is told when the study goes on
        waiting = None
    return enter(study.by_hand, folder, known_runs(study, folder, waiting), sheet, how)


def require_manual(study: Study) -> None:
    """Raise `UsageError` if a solver answers by itself."""
    if study.by_hand.solver.kind != "manual":
        raise UsageError(
            f"solver.kind is {study.solver.kind}, whose runs nobody enters; write solver: {{kind: manual}} for runs "
            "done by hand"
        )


def user_name() -> str:
    """Return who works here, nothing if the system does not tell."""
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""
