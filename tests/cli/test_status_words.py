"""What `status`, the page and the terminal say of stages, runs and the study's question."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from commanding import REPLAY

from stemcal.cli.status import _progress
from stemcal.cli.status import state as lines
from stemcal.drawing.table import Table
from stemcal.overview.status import StageStatus, Status
from stemcal.report.outcome import failures_of
from stemcal.report.page.page import _Part
from stemcal.runs.record import Outcome
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.verdict.result import Verdict
from stemcal.study.reading import load_study
from stemcal.vocabulary import Wording

NAMES = Wording()
FAILED = Outcome(response=None, status="failed", reason="inverted", message="element 17 turned inside out")
RIGHT = Outcome(response=100.0, status="ok")


def state(working: str | None = None, **facts: Any) -> list[str]:
    empty = StageStatus("screen", 12, 12, 0, 0, {}, 0, 0, "fresh", ())
    stage = StageStatus(**{**vars(empty), **facts})
    return lines(Status(2, "status", "known", "out", working, (stage,), Verdict.of([], None)), NAMES)


def stage_of(*outcomes: Outcome) -> Any:
    return SimpleNamespace(name="screen", runs=lambda: [(f"screen {i}", one) for i, one in enumerate(outcomes, 1)])


def test_a_quiet_study_says_its_verdict_alone() -> None:
    assert state() == ["No process is working on this study.", "Calibrated."]


def test_what_is_wrong_with_a_stage() -> None:
    said = state(reasons={"inverted": 2, "timeout": 1}, censored=1, damaged=2, changed=("rsm", "solver version"))
    assert said[1:-1] == [
        "screen: some runs failed: inverted (2), timeout (1); `stemcal status SPEC --failed` lists the failed runs.",
        "screen: 1 response may be too low because the stroke ended before the force had clearly passed its maximum.",
        "screen: 2 damaged records; `stemcal run SPEC` repeats these runs.",
        "screen.json is out of date: rsm, solver version changed after screen.json was written.",
    ]


def test_failed_runs_are_counted_with_their_reasons() -> None:
    assert failures_of(stage_of(RIGHT, RIGHT)) == ""
    said = "inverted (2); first message (screen 2): element 17 turned inside out; see screen.json"
    assert failures_of(stage_of(RIGHT, FAILED, FAILED)) == f"screen: 2 of 3 runs failed: {said}"


def test_what_is_folded() -> None:
    tables = (Table((), (), "Analysis of variance"),)
    folded = _Part(details=tables, plates=({},), notes=("a", "b", "c")).folded
    assert folded == "analysis of variance, 1 figure and 3 notes"
    assert _Part().folded == ""


def test_a_finished_study_waits_for_no_sheet(replayed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.by_hand.own_sheet.awaiting_sheet", lambda *_: "sheet.csv")
    assert "sheet" not in _progress(load_study(REPLAY), StudyFolder(replayed), True)
