"""Studies with a known answer planted in them, taken through their stages and judged."""

from contextlib import suppress
from pathlib import Path

import pytest
import workflow
from edits import accepted

from stemcal.errors import TargetUnreachable
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Solver
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS


def judged(folder: Path, text: str, solver: Solver, monkeypatch: pytest.MonkeyPatch) -> tuple[Verdict, Results]:
    """Take the study of a spec as far as it comes, with a solver in the place of the embedded one."""
    folder.mkdir(exist_ok=True)
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: solver)
    study, place = load_study(folder / "study.yaml"), StudyFolder(folder / "out")
    with suppress(TargetUnreachable):
        workflow.calibrate(study, place, InlineExecutor())
    verdict = verdict_of(study, place)
    accepted(text, verdict, study.source)
    return verdict, fresh_results(study, place)
