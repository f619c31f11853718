"""A stage that would be made of the same as before is read; whatever changes, it is made anew."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from stemcal import workflow
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.store import StudyFolder
from stemcal.runs.answer import Progress, Watch, ignore
from stemcal.stages.base import stage_called
from stemcal.stages.kept import NOTE
from stemcal.stages.making import finished, make
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
ALL = ("screen", "rsm", "invert", "validate")


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Return a folder with the spec of the paper's tables, its data and its screening."""
    shutil.copytree(CONFIGS / "data", tmp_path / "data")
    shutil.copy(CONFIGS / "paper-replay.yaml", tmp_path)
    assert made(tmp_path) == ["screen"]
    return tmp_path


def made(place: Path, stages: Sequence[str] = ("screen",), watch: Watch = ignore) -> list[str]:
    """Return which of the stages are made when they are asked for, the others being kept."""
    study, folder = load_study(place / "paper-replay.yaml"), StudyFolder(place / "out")
    before = len(events(folder))
    for stage in stages:
        make(stage_called(stage), study, folder, InlineExecutor(), watch)
    return [event["stage"] for event in events(folder)[before:] if event["event"] == "stage_done"]


def events(folder: StudyFolder) -> list[dict[str, str]]:
    log = folder.path / "log.jsonl"
    return [json.loads(line) for line in log.read_text("utf-8").splitlines()] if log.exists() else []


def bytes_of(place: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for kind in ("json", "csv") for path in (place / "out").glob(f"*.{kind}")}


def replaced(name: str, old: str, new: str) -> Callable[[Path], object]:
    def change(place: Path) -> None:
        text = (place / name).read_text("utf-8")
        assert old in text
        (place / name).write_text(text.replace(old, new, 1), encoding="utf-8")

    return change


def note_is(content: str) -> Callable[[Path], object]:
    return lambda place: (place / "out" / NOTE).write_text(content, encoding="utf-8")


def record_damaged(place: Path) -> None:
    path = next((place / "out" / "runs").glob("*.json"))
    path.write_bytes(path.read_bytes().replace(b"ok", b"OK", 1))


@pytest.mark.parametrize(
    "change",
    [
        replaced("paper-replay.yaml", "alpha: 0.05", "alpha: 0.06"),
        replaced("data/printed_screening.csv", "1", "2"),
        replaced("out/screen.csv", "1", "2"),
        replaced("out/screen.json", "1", "2"),
        lambda place: (place / "out" / "screen.json").unlink(),
        record_damaged,
        lambda place: (place / "out" / NOTE).unlink(),
        note_is("{"),
        note_is('{"screen": 1}'),
        note_is('{"screen": {"of": 1, "files": 2}}'),
    ],
)
def test_whatever_changes_is_seen(place: Path, change: Callable[[Path], object]) -> None:
    assert made(place) == []
    change(place)
    assert made(place) == ["screen"]
    assert made(place) == []


def test_a_whole_study_is_kept_and_a_stage_that_comes_out_alike_keeps_those_after_it(place: Path) -> None:
    assert made(place, ALL) == ["rsm", "invert", "validate"]
    study, folder, before = load_study(place / "paper-replay.yaml"), StudyFolder(place / "out"), bytes_of(place)
    assert finished(study, folder)
    told: list[Progress] = []
    assert made(place, ALL, told.append) == []
    counts = {progress.stage: (progress.done, progress.total, progress.cached) for progress in told}
    assert counts == {"screen": (12, 12, 12), "rsm": (20, 20, 20), "validate": (5, 5, 5)}
    replaced("out/rsm.json", "1", "2")(place)
    assert not finished(study, folder)
    assert made(place, ALL) == ["rsm"]
    assert bytes_of(place) == before


def test_a_solver_of_ones_own_is_always_asked(place: Path) -> None:
    study, folder = load_study(place / "paper-replay.yaml"), StudyFolder(place / "out")
    before = len(events(folder))
    workflow.screen(study, folder)
    assert [event["event"] for event in events(folder)[before:]] == ["stage_begins", "stage_done"]
