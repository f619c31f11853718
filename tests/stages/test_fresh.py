"""A stage that would be made of the same as before is read; whatever changes, it is made anew."""

import json
import re
import shutil
from collections.abc import Callable, Sequence
from inspect import signature
from pathlib import Path

import pytest
import workflow

from stemcal.errors import UsageError
from stemcal.overview.status import inspect
from stemcal.runs.answer import Progress, Watch, watch_nothing
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.stages.fresh import _TEST, _leaves, changes_since, finished, inputs_of, make, require_fresh
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.stage import STAGES, stage_called
from stemcal.stages.validate.analysis import validate
from stemcal.study.model.study import Study
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


def made(place: Path, stages: Sequence[str] = ("screen",), watch: Watch = watch_nothing) -> list[str]:
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


def record_damaged(place: Path) -> None:
    path = next((place / "out" / "runs").glob("*.json"))
    path.write_bytes(path.read_bytes().replace(b"ok", b"OK", 1))


@pytest.mark.parametrize(
    "change",
    [
        replaced("paper-replay.yaml", "alpha: 0.05", "alpha: 0.06"),
        replaced("data/paper-forces.csv", ",90.3", ",90.4"),
        replaced("out/screen.csv", "1", "2"),
        replaced("out/screen.json", "1", "2"),
        lambda place: (place / "out" / "screen.json").unlink(),
        record_damaged,
        lambda place: (place / "out" / "screen.csv").unlink(),
        lambda place: next((place / "out" / "runs").glob("*.json")).unlink(),
        replaced("paper-replay.yaml", "title: ", "title: Another "),
    ],
)
def test_whatever_changes_is_seen(place: Path, change: Callable[[Path], object]) -> None:
    assert made(place) == []
    change(place)
    assert made(place) == ["screen"]
    assert made(place) == []


def test_leaves_are_named_by_their_paths() -> None:
    """An entry of a list has no number if it is the only one; an empty section is itself a leaf."""
    part = {"layers": [{"name": "skin"}], "blade": {}, "factors": ["a", "b"]}
    assert _leaves("test", part) == {"test.layers.name": "skin", "test.blade": {}, "test.factors": ["a", "b"]}


def test_what_other_code_has_made_is_stale_and_told(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, folder = load_study(place / "paper-replay.yaml"), StudyFolder(place / "out")
    monkeypatch.setattr("stemcal.stages.fresh.code_version", lambda: "0.0.1+other")
    assert changes_since(study, None, folder, "screen") == ["stemcal"]
    with pytest.raises(UsageError, match=r"out of date \(stemcal changed\)\. Run `stemcal screen SPEC` again"):
        require_fresh(study, None, folder, "screen")
    assert made(place) == ["screen"] and made(place) == []


def test_a_stage_of_another_shape_from_other_code_is_stale_not_damaged(place: Path) -> None:
    study, folder = load_study(place / "paper-replay.yaml"), StudyFolder(place / "out")
    content = folder.read_stage("screen")
    folder.write_stage("screen", {**content, "inputs": {**content["inputs"], "stemcal": "0.0.1"}, "effects": "many"})
    assert inspect(study, folder)[1] == {} and changes_since(study, None, folder, "screen") == ["stemcal"]
    folder.write_stage("screen", {**content, "effects": "many"})
    assert "effects" in inspect(study, folder)[1]["screen.json"]


def test_a_run_that_came_out_otherwise_since_is_taken_in(place: Path) -> None:
    """As `stemcal run --retry` leaves it: the same key, another answer."""
    study, folder = load_study(place / "paper-replay.yaml"), StudyFolder(place / "out")
    result = stage_called("screen").result().from_json(folder.read_stage("screen"))
    key = next(result.runs())[1].key
    record = folder.peek(key)
    assert record is not None
    folder.save({**record, "status": "failed", "force": None, "reason": "inverted"})
    assert not finished(study, folder, "screen") and made(place) == ["screen"]
    assert [event["stage"] for event in events(folder) if event["event"] == "stage_done"] == ["screen"] * 2


def test_every_section_of_the_spec_is_an_input_of_some_stage() -> None:
    """What is no input of any stage is named here: a new section must be one, or be written here with its reason."""
    options = {name for stage in STAGES.built_in for name in stage.reads}
    no_inputs = {
        "name", "title",  # stand in the file, and are compared
        "responses", "conditions", "machine",  # under `named`, where they are not the shear test's
        "source", "warnings", "materials", "pending",  # no part of a dump; a material changes with its source
        "further",  # each is an input of its own stage
    }  # fmt: skip
    keys = {field.serialization_alias or name for name, field in Study.model_fields.items()}
    assert keys == options | set(_TEST) | {"factors", "tests"} | no_inputs


def test_the_embedded_solver_tells_nothing_that_the_spec_does_not(tmp_path: Path) -> None:
    """So its stages are known to be fresh without loading it."""
    study, folder = load_study(CONFIGS / "smoke.yaml"), StudyFolder(tmp_path)
    by_spec = inputs_of(study, None, folder, "screen")
    assert by_spec == inputs_of(study, make_solver(study), folder, "screen") and "blade.edge_radius" in by_spec
    threads = study.model_copy(update={"solver": study.solver.model_copy(update={"threads": 2})})
    assert inputs_of(threads, None, folder, "screen") == by_spec
    blunt = study.model_copy(update={"blade": study.blade.model_copy(update={"edge_radius": 0.2})})
    other = inputs_of(blunt, None, folder, "screen")
    assert [name for name in other if other[name] != by_spec[name]] == ["blade.edge_radius"]


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
    workflow.run_stage("screen", study, folder)
    assert [event["event"] for event in events(folder)[before:]] == ["stage_begins", "stage_done"]


def test_the_signature_of_a_stage_lists_what_its_callers_pass() -> None:
    assert list(signature(validate).parameters) == ["study", "folder", "executor", "watch", "solver"]
    assert "StudyFolder" in str(signature(validate).parameters["folder"])


def test_a_screening_that_the_spec_no_longer_includes_is_no_reason(place: Path) -> None:
    """After advice such as `screen: {design: none}` the old file remains: to screen again is then no remedy."""
    replaced("paper-replay.yaml", "alpha: 0.05", "alpha: 0.06")(place)
    path, folder = place / "paper-replay.yaml", StudyFolder(place / "out")
    assert len(fresh_results(load_study(path), folder).stale) == 1
    path.write_text(re.sub(r"(?m)^  design: plackett-burman", "  design: none", path.read_text("utf-8")), "utf-8")
    assert fresh_results(load_study(path), folder) == Results()
