"""Progress of a stage with good, censored, failed and damaged runs, and the faults of its files."""

from pathlib import Path

import pytest
import workflow
from fakes import SpecSolver, make_study
from test_demand import TWO

from stemcal.overview.status import StageStatus, inspect, retry, stage_states
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.ledger import ledger
from stemcal.study.model.study import Study
from stemcal.study.types.solver_kind import SOLVERS

TROUBLE = {1: "failed", 4: "nan", 6: "failed", 9: "rising"}


@pytest.fixture
def screened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Study, StudyFolder]:
    """A screening of 20 runs, of which two turned inside out, one had no force, and one was still rising."""
    study, folder = make_study(tmp_path, f"screen: {{runs: 20}}\n{TWO}"), StudyFolder(tmp_path / "out")
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: SpecSolver(trouble=TROUBLE))
    workflow.run_stage("screen", study, folder, InlineExecutor())
    return study, folder


def damage_last(study: Study, folder: StudyFolder) -> str:
    """Garble the record of the last run of the screening; return its key."""
    key = next(entry.key for entry in ledger(study, folder) if (entry.stage, entry.run) == ("screen", 20))
    folder.record_path(key).write_bytes(b"{")
    return key


def test_every_state_of_a_run_is_counted(screened: tuple[Study, StudyFolder]) -> None:
    study, folder = screened
    damage_last(study, folder)
    found = stage_states(study, folder)
    assert (found.schema_version, found.stage, found.study, found.working) == (2, "status", "known", None)
    assert found.folder == str(folder.path)
    screen, rsm, validate = found.stages
    reasons = {"inverted": 2, "nan": 1}
    assert screen == StageStatus("screen", 20, 16, 1, 3, reasons, left=1, damaged=1, file="fresh", changed=())
    assert list(screen.reasons) == ["inverted", "nan"]
    assert rsm == StageStatus("rsm", 9, 0, 0, 0, {}, left=9, damaged=0, file="none", changed=())
    assert validate == StageStatus("validate", None, 0, 0, 0, {}, left=None, damaged=0, file="none", changed=())
    assert not found.verdict.holds


def test_a_damaged_file_of_a_stage_is_neither_fresh_nor_stale(screened: tuple[Study, StudyFolder]) -> None:
    study, folder = screened
    (folder.path / "screen.json").write_bytes(b"{")
    screen = stage_states(study, folder).stages[0]
    assert (screen.file, screen.changed, screen.done) == ("damaged", (), 17)


def test_faults_by_file_name(screened: tuple[Study, StudyFolder]) -> None:
    study, folder = screened
    assert inspect(study, folder) == (20, {})
    key = damage_last(study, folder)
    count, faults = inspect(study, folder)
    assert count == 20 and list(faults) == [f"runs/{key}.json"]
    (folder.path / "screen_runs.csv").unlink()
    assert inspect(study, folder)[1]["screen_runs.csv"].startswith("is missing or has been changed")


def test_failed_runs_are_repeated_once_each_and_returned_in_order(
    screened: tuple[Study, StudyFolder], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Row 6 still fails."""
    study, folder = screened
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: SpecSolver(trouble={6: "failed"}))
    rows = retry(study, folder, InlineExecutor())
    assert [(row.stage, row.run, row.status, row.reason) for row in rows] == [
        ("screen", 2, "ok", ""),
        ("screen", 5, "ok", ""),
        ("screen", 7, "failed", "inverted"),
    ]
    assert [row.run for row in retry(study, folder, InlineExecutor())] == [7]
